"""The `artde-gym` command; the one module here that may import controllers and baselines."""

from __future__ import annotations

import datetime
import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import pandas as pd
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from artde_gym import __version__
from artde_gym.errors import ArtdeGymError, OptionError
from artde_gym.evaluation import SCENARIOS
from artde_gym.evaluation import evaluate as run_evaluation
from artde_gym.evaluation import frontier as run_frontier
from artde_gym.evaluation import reproduce as run_reproduction
from artde_gym.evaluation import tune as run_tuning
from artde_gym.evaluation.claims import confirm
from artde_gym.evaluation.console import print_claims, print_result
from artde_gym.evaluation.environments import ours, robot_of
from artde_gym.evaluation.evaluate import Update
from artde_gym.evaluation.frontier_console import print_frontier
from artde_gym.evaluation.frontier_standard import STANDARDS
from artde_gym.evaluation.reproduce import ROBOTS, scenarios_of
from artde_gym.evaluation.tune_console import print_tuning
from artde_gym.registration import registered_controllers
from controllers import GainError

WALK = "BipedWalk-Payload-v0"
MAIN_SCENARIOS = {WALK: "S1,S2,S1-L4,S2-L4", "QuadInfinity-Payload-v0": "Q1,Q1-calm,Q1-gale"}
"""What is run in an environment where no scenario is named."""
ENGINES = ("bullet", "mujoco")
VARIED = dict.fromkeys(path for standard in STANDARDS.values() for path in standard.ranges)

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Environments and judges of time-delay control.",
)


def main() -> None:
    """Run the command; a mistake of the user's is one line on standard error and exit code 2."""
    try:
        app()
    except (ArtdeGymError, GainError, gym.error.Error) as error:
        typer.echo(f"artde-gym: {error}", err=True)
        sys.exit(2)


@app.command()
def evaluate(
    controllers: Annotated[str, typer.Option(help="Names, comma-separated; see `list`.")] = "tde,atde,artde",
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Names, comma-separated; see `list`. Default: the environment's main ones, or its first in batches."
        ),
    ] = None,
    env: Annotated[str | None, typer.Option(help=f"Environment id. Default: the scenarios', or {WALK}.")] = None,
    episodes: Annotated[int, typer.Option(help="Seeded episodes of each controller in each scenario.")] = 3,
    seed: Annotated[int, typer.Option(help="Seed of the whole evaluation.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes. Default: all cores.")] = None,
    out: Annotated[Path | None, typer.Option(help="Results folder. Default: runs/<date and time>.")] = None,
    backend: Annotated[
        str, typer.Option(help="single: an engine for each episode; batch: thousands at once, where there is a vector.")
    ] = "single",
    engine: Annotated[str | None, typer.Option(help="Physics engine.")] = None,
    disturbances: Annotated[str | None, typer.Option(help="JSON, in place of the scenario's own.")] = None,
    env_kwargs: Annotated[str | None, typer.Option(help="JSON, arguments of the environment.")] = None,
    gains: Annotated[str | None, typer.Option(help='JSON, e.g. {"artde": {"gamma_0": 200}}.')] = None,
    traced: Annotated[
        int | None, typer.Option(help="Episodes that leave signals. Default: all of them; none in the batch backend.")
    ] = None,
    trace_hz: Annotated[float, typer.Option(help="Rate of stored signals; inf for all of them.")] = 100.0,
    report: Annotated[bool, typer.Option("--report", help="Write report.html, too.")] = False,
) -> None:
    """Compare controllers on the same seeded episodes and print them beside the thesis."""
    if scenario is None:
        env = env or WALK
        scenario = MAIN_SCENARIOS.get(env)
        if scenario is not None and backend == "batch":
            scenario = scenario.split(",")[0]
    kwargs = _json("--env-kwargs", env_kwargs)
    if engine is not None:
        kwargs["engine"] = engine
    folder = out or Path("runs") / datetime.datetime.now().strftime("%Y-%m-%d-%H%M%S")
    console = Console()
    with Display(console) as display:
        result = run_evaluation(
            _names(controllers),
            env,
            scenario=None if scenario is None else _names(scenario),
            episodes=episodes,
            seed=seed,
            workers=workers or os.cpu_count() or 1,
            out=folder,
            disturbances=_json("--disturbances", disturbances) if disturbances is not None else None,
            env_kwargs=kwargs,
            gains=_json("--gains", gains),
            backend=backend,  # pyright: ignore[reportArgumentType]  # checked there
            traced=traced,
            trace_hz=trace_hz,
            on_progress=display,
        )
    print_result(result, console)
    if report:
        _report(folder, console)
    if not result.complete:
        raise typer.Exit(130)


@app.command()
def frontier(
    vary: Annotated[str, typer.Option(help=f"What to vary; with a range of its own: {', '.join(VARIED)}.")],
    controllers: Annotated[str, typer.Option(help="Names, comma-separated; see `list`.")] = "tde,atde,artde",
    env: Annotated[str, typer.Option(help="Environment id.")] = "BipedPush-v0",
    low: Annotated[float | None, typer.Option(help="Smallest value, in the parameter's unit.")] = None,
    high: Annotated[float | None, typer.Option(help="Largest value.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Width of the bracket to be found.")] = None,
    harder: Annotated[str | None, typer.Option(help="larger or smaller: which values are harder.")] = None,
    episodes: Annotated[int, typer.Option(help="Seeded episodes of each controller at each level.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of everything.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes. Default: all cores.")] = None,
    survival: Annotated[float, typer.Option(help="Share of episodes without a fall that counts as survived.")] = 0.9,
    out: Annotated[Path | None, typer.Option(help="Results folder. Default: runs/<date and time>.")] = None,
    engine: Annotated[str | None, typer.Option(help="Physics engine.")] = None,
    disturbances: Annotated[str | None, typer.Option(help="JSON, in place of the standard test's.")] = None,
    env_kwargs: Annotated[str | None, typer.Option(help="JSON, arguments of the environment.")] = None,
    gains: Annotated[str | None, typer.Option(help='JSON, e.g. {"artde": {"gamma_0": 200}}.')] = None,
    backend: Annotated[str, typer.Option(help="single or batch, as for `evaluate`.")] = "single",
    report: Annotated[bool, typer.Option("--report", help="Write report.html, too.")] = False,
) -> None:
    """Find how much of one disturbance each controller survives; the same command continues an interrupted run."""
    kwargs = _json("--env-kwargs", env_kwargs)
    if engine is not None:
        kwargs["engine"] = engine
    console = Console()
    with Display(console) as display:
        found = run_frontier(
            _names(controllers),
            env,
            vary,
            low=low,
            high=high,
            tolerance=tolerance,
            harder=harder,  # pyright: ignore[reportArgumentType]  # checked there
            survival=survival,
            episodes=episodes,
            seed=seed,
            workers=workers or os.cpu_count() or 1,
            out=out or Path("runs") / datetime.datetime.now().strftime("%Y-%m-%d-%H%M%S"),
            disturbances=_json("--disturbances", disturbances) if disturbances is not None else None,
            env_kwargs=kwargs,
            gains=_json("--gains", gains),
            backend=backend,  # pyright: ignore[reportArgumentType]  # checked there
            on_progress=lambda value, update: display(update, f"{vary} {value:g}"),
        )
    print_frontier(found, console)
    if report and found.folder is not None:
        _report(found.folder, console)
    if not found.complete:
        raise typer.Exit(130)


@app.command()
def tune(
    controllers: Annotated[str, typer.Option(help="Names, comma-separated; see `list`.")] = "tde,atde,artde",
    scenario: Annotated[str | None, typer.Option(help="Name; see `list`. Default: none, with --env as it is.")] = None,
    env: Annotated[str | None, typer.Option(help=f"Environment id. Default: the scenario's, or {WALK}.")] = None,
    trials: Annotated[int, typer.Option(help="Sets of gains that each controller may try, its preset included.")] = 50,
    episodes: Annotated[int, typer.Option(help="Seeded training episodes of each trial.")] = 4,
    held_out: Annotated[
        int, typer.Option(help="Seeded episodes of the comparison in the end, none of them seen.")
    ] = 20,
    seed: Annotated[int, typer.Option(help="Seed of everything.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes. Default: all cores.")] = None,
    out: Annotated[Path | None, typer.Option(help="Results folder. Default: runs/<date and time>.")] = None,
    backend: Annotated[str, typer.Option(help="single or batch, as of `evaluate`.")] = "single",
    engine: Annotated[str | None, typer.Option(help="Physics engine.")] = None,
    disturbances: Annotated[str | None, typer.Option(help="JSON, in place of the scenario's own.")] = None,
    env_kwargs: Annotated[str | None, typer.Option(help="JSON, arguments of the environment.")] = None,
) -> None:
    """Tune gains with the same budget for every controller; the same command continues an interrupted run."""
    kwargs = _json("--env-kwargs", env_kwargs)
    if engine is not None:
        kwargs["engine"] = engine
    console = Console()
    with Display(console) as display:
        found = run_tuning(
            _names(controllers),
            env,
            scenario=scenario,
            trials=trials,
            episodes=episodes,
            held_out=held_out,
            seed=seed,
            workers=workers or os.cpu_count() or 1,
            out=out or Path("runs") / datetime.datetime.now().strftime("%Y-%m-%d-%H%M%S"),
            disturbances=_json("--disturbances", disturbances) if disturbances is not None else None,
            env_kwargs=kwargs,
            backend=backend,  # pyright: ignore[reportArgumentType]  # checked there
            on_progress=lambda what, update: display(update, what),
        )
    print_tuning(found, console)
    if not found.complete:
        raise typer.Exit(130)


@app.command()
def reproduce(
    robot: Annotated[str, typer.Option(help=f"{', '.join(ROBOTS)}, or all.")] = "all",
    engine: Annotated[str, typer.Option(help=f"Physics engine: {', '.join(ENGINES)}, or both.")] = "bullet",
    episodes: Annotated[int, typer.Option(help="Seeded episodes of each controller in each scenario.")] = 10,
    scenario: Annotated[str | None, typer.Option(help="Names, comma-separated. Default: all of the robot.")] = None,
    controllers: Annotated[str | None, typer.Option(help="Names, comma-separated. Default: the robot's own.")] = None,
    ablation: Annotated[
        bool, typer.Option(help="Run TDE at ARTDE's mean gain too; on a folder that is there, only what is new.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of the whole run.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes. Default: all cores.")] = None,
    out: Annotated[
        Path, typer.Option(help="Results folder, one inside for each engine and robot; the same call continues it.")
    ] = Path("runs/reproduce"),
    report: Annotated[bool, typer.Option("--report", help="Write report.html, too.")] = False,
) -> None:
    """Run the thesis' scenarios and print its tables beside ours, then each of its claims with a verdict."""
    robots = list(ROBOTS) if robot == "all" else [robot]
    engines = list(ENGINES) if engine == "both" else [engine]
    named = None if scenario is None else _names(scenario)
    console = Console()
    for name in robots:
        chosen = scenarios_of(name, named)
        if not chosen:
            continue
        verdicts: dict[str, pd.DataFrame] = {}
        for one in engines:
            with Display(console) as display:
                found = run_reproduction(
                    name,
                    out / one / name,
                    scenarios=chosen,
                    controllers=None if controllers is None else _names(controllers),
                    ablation=ablation,
                    episodes=episodes,
                    seed=seed,
                    workers=workers or os.cpu_count() or 1,
                    engine=one,
                    on_progress=lambda what, update, display=display: display(update, what),
                )
            if len(engines) > 1:
                console.rule(f"{name} in {one}")
            print_result(found.result, console)
            print_claims(found.claims, console)
            verdicts[one] = found.claims
            if report and found.result.folder is not None:
                _report(found.result.folder, console)
            if not found.result.complete:
                raise typer.Exit(130)
        if len(engines) > 1:
            both = confirm(verdicts)
            both.to_csv(out / f"claims-{name}.csv", index=False)
            print_claims(both, console)


@app.command()
def train(
    env: Annotated[str, typer.Option(help="Environment id.")],
    out: Annotated[Path, typer.Option(help="The run's folder; the same command continues an interrupted run.")],
    base: Annotated[str, typer.Option(help="Controller under the residual; none: the agent gives the force.")] = "tde",
    algo: Annotated[str, typer.Option(help="ppo, sac, or cma-es for the biped's linear balance law.")] = "ppo",
    steps: Annotated[int, typer.Option(help="Decisions of the agent, all environments together.")] = 1_000_000,
    seed: Annotated[int, typer.Option(help="Seed of everything.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes of environments. Default: all cores.")] = None,
    channel: Annotated[str, typer.Option(help="What an action means. Default: the robot's; see the model cards.")] = "",
    limit: Annotated[float, typer.Option(help="Largest residual. Default: the channel's.")] = 0.0,
    gated: Annotated[bool, typer.Option(help="Fade the biped's residual in by tilt and velocity error.")] = True,
    patience: Annotated[int, typer.Option(help="Held-out tests without a better score that end the run.")] = 20,
    test_every: Annotated[int, typer.Option(help="Intervals (or generations) between two held-out tests.")] = 4,
    engine: Annotated[str | None, typer.Option(help="Physics engine.")] = None,
    env_kwargs: Annotated[str | None, typer.Option(help="JSON, arguments of the environment.")] = None,
    options: Annotated[str | None, typer.Option(help="JSON, arguments of the algorithm.")] = None,
) -> None:
    """Train a residual on a controller; killed at any moment, the same command continues from its last checkpoint."""
    from baselines.recipe import Recipe  # torch is heavy, and may not be installed
    from baselines.run import Progress as TrainingProgress
    from baselines.run import Training
    from baselines.tasks import task

    kwargs = _json("--env-kwargs", env_kwargs)
    if engine is not None:
        kwargs["engine"] = engine
    training = Training(
        env,
        Recipe(task(env).robot, base, channel=channel, limit=limit, gated=gated),
        algo=algo,
        steps=steps,
        seed=seed,
        env_kwargs=kwargs,
        options=_json("--options", options),
        workers=1 if task(env).batched else workers or os.cpu_count() or 1,
        patience=patience,
        test_every=test_every,
    )
    try:
        if algo == "cma-es":
            from baselines.tune_balance import tune as go
        else:
            from baselines.train import train as go
    except ModuleNotFoundError as error:
        if error.name not in ("cmaes", "stable_baselines3", "torch", "tensorboard"):
            raise
        raise OptionError("algo", algo, "what is installed; pip install 'artde-gym[rl]'") from error
    columns = (TextColumn("decisions"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, TextColumn("{task.description}")) as bar:
        shown = bar.add_task("", total=steps)

        def on_progress(news: TrainingProgress) -> None:
            bar.update(shown, completed=news.steps, total=news.wanted, description=news.text)

        policy = go(training, out, on_progress)
    print(f"best policy: {policy}")


@app.command("report")
def report_(
    folder: Annotated[Path, typer.Argument(help="Results folder of `evaluate`, `reproduce` or `frontier`.")],
) -> None:
    """Write report.html into a results folder, finished or not: one file that needs no network."""
    _report(folder, Console())


@app.command("list")
def list_() -> None:
    """Show environments, scenarios, controllers and what frontiers vary."""
    console = Console()
    environments = Table("environment", "robot", "backends", title="Environments", title_justify="left")
    for name in ours():
        backends = "single, batch" if gym.spec(name).vector_entry_point else "single"
        environments.add_row(name, robot_of(name), backends)
    scenarios = Table("scenario", "environment", "arguments", "what it is", title="Scenarios", title_justify="left")
    for entry in SCENARIOS.values():
        scenarios.add_row(entry.name, entry.env_id, json.dumps(dict(entry.kwargs)), entry.text)
    known = Table("controller", "what it is", title="Controllers", title_justify="left")
    for name, spec in registered_controllers().items():
        known.add_row(name, spec.text)
    varied = Table("robot", "varied", "from", "to", "step", "harder", title="Frontiers", title_justify="left")
    for robot, standard in STANDARDS.items():
        for path, (low, high, step, harder) in standard.ranges.items():
            varied.add_row(robot, path, f"{low:g}", f"{high:g}", f"{step:g}", harder)
    for table in (environments, scenarios, known, varied):
        console.print(table)


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    """Environments and judges of time-delay control."""
    if show:
        print(f"artde-gym {__version__}")
        raise typer.Exit


class Display:
    """Live progress of an evaluation: a bar of finished episodes, and how far the running ones are."""

    def __init__(self, console: Console) -> None:
        self._running: dict[tuple[str, str, str], float] = {}
        self._what = "episodes"
        self._progress = Progress(
            TextColumn("{task.fields[what]}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.description}"),
            console=console,
        )
        self._bar = self._progress.add_task("", total=None, what="episodes")

    def __enter__(self) -> Display:
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress.live.is_started:
            self._progress.update(self._bar, description="")
            self._progress.stop()

    def __call__(self, update: Update, what: str = "episodes") -> None:
        self._progress.start()  # with the first news; an error before it leaves no empty bar
        if what != self._what:
            self._what = what
            self._progress.reset(self._bar)  # a bar that was full once has stopped its clock
        first, last = update.task.episodes[0], update.task.episodes[-1]
        numbers = f"#{first}" if first == last else f"#{first}..{last}"
        key = (update.task.cell.name, update.task.controller, numbers)
        self._running[key] = update.time_s
        if update.ended:
            del self._running[key]
        text = ", ".join(
            f"{name} {controller} {numbers}: {time:.0f} s"
            for (name, controller, numbers), time in self._running.items()
        )
        self._progress.update(self._bar, completed=update.finished, total=update.total, description=text, what=what)


def _report(folder: Path, console: Console) -> None:
    from artde_gym.evaluation.report import write_report  # only when asked for

    console.print(f"Report: {write_report(folder)}", soft_wrap=True)


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _json(option: str, text: str | None) -> dict[str, Any]:
    if text is None:
        return {}
    try:
        value = json.loads(text)
    except ValueError as error:
        raise OptionError(option, text, f"a JSON object ({error})") from error
    if not isinstance(value, dict):
        raise OptionError(option, text, "a JSON object")
    return value


if __name__ == "__main__":
    main()
