"""`artde-gym train`: training of a residual on a controller."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from artde_gym.cli.arguments import (
    Engine,
    EnvKwargs,
    Report,
    Seed,
    environment_kwargs,
    json_object,
    processes,
    renamed_option,
)
from artde_gym.cli.display import terminal, words
from artde_gym.cli.report import show_report
from artde_gym.errors import OptionError


def train(
    env: Annotated[str, typer.Option(help="Environment id.")],
    out: Annotated[Path, typer.Option(help="The run's folder; re-run the command to resume.")],
    base: Annotated[
        str, typer.Option(help="Controller below the residual; none: the agent commands the force.")
    ] = "tde",
    gains: Annotated[
        str | None, typer.Option(help="JSON; gains of the base, or its preset, in place of the default's.")
    ] = None,
    algo: Annotated[str, typer.Option(help="ppo, sac, or cma-es for the biped's linear balance law.")] = "ppo",
    steps: Annotated[int, typer.Option(help="Decisions of the agent, summed over environments.")] = 1_000_000,
    seed: Seed = 0,
    workers: Annotated[int | None, typer.Option(help="Number of environment processes. Default: all cores.")] = None,
    action_mode: Annotated[
        str, typer.Option(help="Meaning of an action. Default: the robot's; see the model cards.")
    ] = "",
    action_scale: Annotated[float | None, typer.Option(help="Largest residual. Default: the action mode's.")] = None,
    decision_period: Annotated[
        float | None, typer.Option(help="Time between two decisions, in s. Default: the robot's.")
    ] = None,
    channel: Annotated[str | None, typer.Option(hidden=True)] = None,
    limit: Annotated[float | None, typer.Option(hidden=True)] = None,
    gated: Annotated[bool, typer.Option(help="Fade the biped's residual in by tilt and velocity error.")] = True,
    patience: Annotated[int, typer.Option(help="Stop after this many held-out tests without a better score.")] = 20,
    test_every: Annotated[int, typer.Option(help="Intervals (or generations) between held-out tests.")] = 4,
    engine: Engine = None,
    env_kwargs: EnvKwargs = None,
    options: Annotated[str | None, typer.Option(help="JSON; arguments of the algorithm.")] = None,
    report: Report = False,
) -> None:
    """Train a residual on a controller. Re-run the command to resume from the last checkpoint."""
    from baselines.residual_config import ResidualConfig  # torch is heavy, and may not be installed
    from baselines.run import Progress as TrainingProgress
    from baselines.run import Training
    from baselines.tasks import task

    action_mode = renamed_option("--channel", channel, "--action-mode", action_mode, "")
    action_scale = renamed_option("--limit", limit, "--action-scale", action_scale, None)
    for option, value in (("--action-scale", action_scale), ("--decision-period", decision_period)):
        if value == 0:
            raise OptionError(option, value, "above 0; leave it out for the default")
    kwargs = environment_kwargs(env_kwargs, engine)
    config = ResidualConfig(
        task(env).robot,
        base,
        json_object("--gains", gains) or {},
        action_mode=action_mode,
        decision_period=decision_period or 0.0,
        action_scale=action_scale or 0.0,
        gated=gated,
    )
    training = Training(
        env,
        config,
        algo=algo,
        steps=steps,
        seed=seed,
        env_kwargs=kwargs,
        options=json_object("--options", options),
        workers=processes(workers),
        patience=patience,
        test_every=test_every,
    )
    go = _trainer(algo)
    columns = (TextColumn("decisions"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    bar = Progress(*columns, words("description"))
    shown = bar.add_task("", total=steps)

    def on_progress(news: TrainingProgress) -> None:
        bar.start()  # with the first update, so that an earlier error leaves no empty bar
        bar.update(shown, completed=news.steps, total=news.wanted, description=news.text)

    try:
        policy = go(training, out, on_progress)
    finally:
        if bar.live.is_started:
            bar.stop()
    print(f"best policy: {policy}")
    if report:
        show_report(out, terminal())


def _trainer(algo: str) -> Callable[..., Path]:
    """Return the training function of an algorithm; torch is heavy and may not be installed."""
    if algo == "cma-es":
        from baselines.tune_balance import tune as go
    else:
        from baselines.train import train as go
    return go
