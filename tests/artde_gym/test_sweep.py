"""Sweeps from outside: the very episodes of `evaluate`, wherever, whenever and after whatever they are run."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import artde_gym
from artde_gym import registration
from artde_gym.cli import app
from artde_gym.errors import ActionError, ArtdeGymError, DisturbanceError, OptionError, StoreError, WorkerError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.workers import run_parallel
from artde_gym.studies import read_sweep, sweep
from controllers import GainError

pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")

ROOT = Path(__file__).parents[2]
QUICK: dict[str, Any] = {"duration": 0.15, "engine": "mujoco"}
GRID: dict[str, Any] = {
    "env_kwargs": QUICK,
    "episodes": 3,
    "grid": {"scenario": ["S2-L4", "Q1"], "controller": ["tde", "artde"]},
}


def same(first: pd.DataFrame, second: pd.DataFrame) -> None:
    """Equal to the last bit."""
    pd.testing.assert_frame_equal(first, second, check_exact=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> pd.DataFrame:
    return sweep(GRID, tmp_path_factory.mktemp("whole")).episodes


@pytest.mark.once
@pytest.mark.parametrize(
    ("given", "arguments"),
    [
        ({"scenario": "S2-L4", "controller": "artde"}, {"scenario": "S2-L4"}),
        (
            {"scenario": "Q1", "gains": {"artde": {"alpha_p": 2.0}}},
            {"scenario": "Q1", "gains": {"artde": {"alpha_p": 2.0}}},
        ),
        ({"env": "BipedPush-v0"}, {"env_id": "BipedPush-v0"}),  # its own disturbances
        ({"scenario": "Q1", "disturbances": {"wind": 2.0}}, {"scenario": "Q1", "disturbances": {"wind": 2.0}}),
        ({"scenario": "Q1", "vectorized": True}, {"scenario": "Q1", "vectorized": True}),
    ],
    ids=["scenario", "gains", "environment", "disturbances", "batch"],
)
def test_its_episodes_are_those_of_evaluate_bit_for_bit(tmp_path, given, arguments):
    kwargs = {"duration": 0.3} if "vectorized" in given else {"duration": 0.3, "engine": "mujoco"}
    mine = sweep({"controller": "artde", "env_kwargs": kwargs, "seed": 5, "episodes": 3, **given}, tmp_path).episodes
    theirs = evaluate(["artde"], env_kwargs=kwargs, seed=5, episodes=3, **arguments).episodes
    assert set(mine) - set(theirs) <= {"cell", "disturbances"} | {name for name in mine if "s." in name}
    for name in theirs:
        ours = mine[name].to_numpy() if name in mine else np.full(3, np.nan)  # a column without any value is not there
        if theirs[name].dtype.kind in "iufb":
            np.testing.assert_array_equal(ours.astype(np.float64), theirs[name].to_numpy(dtype=np.float64))
        else:
            assert ours.tolist() == theirs[name].tolist()


@pytest.mark.once
def test_a_cell_leaves_nothing_behind_for_the_next_one(tmp_path):
    """Cells that share an environment, in any company and order."""
    disturbances = [{"payload": 1.3}, {}, {"friction": 0.5}]
    common = {"env": "BipedPush-v0", "controller": "tde", "env_kwargs": {**QUICK, "control_period": 0.004}}
    for order in (disturbances, disturbances[::-1]):
        found = sweep(
            {**common, "grid": {"disturbances": order}, "episodes": 2}, tmp_path / str(len(order[0]))
        ).episodes
        for one in disturbances:
            alone = evaluate(["tde"], "BipedPush-v0", disturbances=one, episodes=2, env_kwargs=common["env_kwargs"])
            mine = found[found["disturbances"] == json.dumps(one)]
            assert mine["rmse_deg"].tolist() == alone.episodes["rmse_deg"].tolist()
            assert mine["seed"].tolist() == alone.episodes["seed"].tolist()


def test_results_do_not_depend_on_the_number_of_processes(tmp_path, whole):
    same(sweep(GRID, tmp_path / "run", workers=2).episodes, whole)


def test_an_interrupted_sweep_keeps_what_is_finished_and_goes_on(tmp_path, whole):
    def interrupt(what: str, update: Any) -> None:
        if what == "episodes" and update.finished == 5 and update.ended:
            raise KeyboardInterrupt

    first = sweep(GRID, tmp_path, on_progress=interrupt)
    assert not first.complete
    assert len(first.episodes) == 5
    seen: list[Any] = []
    second = sweep(GRID, tmp_path, on_progress=lambda what, update: seen.append((what, update)))
    assert second.complete
    same(second.episodes, whole)
    ended = [update for what, update in seen if what == "episodes" and update.ended]
    assert [update.finished for update in ended] == list(range(6, 13))
    assert not any(what == "cells checked" for what, _ in seen)  # each had been run once
    runs = json.loads((tmp_path / "sweep.json").read_text())["runs"]
    assert [run["complete"] for run in runs] == [False, True]


def test_a_longer_sweep_extends_its_folder_and_a_shorter_one_is_refused(tmp_path, whole):
    shorter = {**GRID, "episodes": 2, "grid": {**GRID["grid"], "controller": ["artde"]}}
    assert len(sweep(shorter, tmp_path).episodes) == 4
    same(sweep(GRID, tmp_path).episodes, whole)
    for other in (shorter, {**GRID, "seed": 1}):
        with pytest.raises(StoreError, match=r"of 12 belong to another.*new folder"):
            sweep(other, tmp_path)
    same(read_sweep(tmp_path), whole)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"grid": {"controller": ["tde"], "gains.tde.k_q": [1.0]}}, GainError, ["k_q"]),
        ({"grid": {"controller": ["tde"], "gains.tde.env": [1.0]}}, OptionError, ["gains of 'tde'", "env"]),
        ({"grid": {"controller": ["tde"], "gains.tde.k_p": [1.0, "x"]}}, StoreError, ["gains.k_p", "number and text"]),
        ({"grid": {"env_kwargs.duration": [1.0, -1.0]}}, OptionError, ["duration", "-1"]),
        ({"grid": {"env_kwargs.durration": [1.0]}}, OptionError, ["durration", "duration"]),
        ({"grid": {"disturbances.wind.scale": [1.0, -1.0]}}, DisturbanceError, ["wind.scale", "-1"]),
        ({"grid": {"controller": ["tde", "computed-torque"]}}, ArtdeGymError, ["computed-torque"]),
    ],
)
def test_every_cell_is_checked_before_the_first_episode(tmp_path, change, error, words):
    given = {"scenario": "Q1", "controller": "tde", "env_kwargs": QUICK, **change}
    with pytest.raises(error) as caught:
        sweep(given, tmp_path / "run", on_progress=lambda what, _: pytest.fail(what) if what == "episodes" else None)
    for word in words:
        assert word in str(caught.value)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"workers": 0}, "workers is 0"),
        ({"executor": "mujoco"}, "executor is 'mujoco'.*env_kwargs"),
        ({"address": "auto"}, "address 'auto' is of no use"),
    ],
)
def test_bad_options_are_refused(tmp_path, options, words):
    with pytest.raises(OptionError, match=words):
        sweep(GRID, tmp_path / "run", **options)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("name", ["yaml", "pyarrow"])
def test_without_its_packages_the_extra_is_named(tmp_path, monkeypatch, name):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(OptionError, match=r"artde-gym\[sweep\]"):
        sweep(tmp_path / "sweep.yaml", tmp_path / "run")


def test_an_error_in_one_of_many_cells_names_the_cell(tmp_path, monkeypatch):
    (tmp_path / "broken.py").write_text(
        "import numpy as np\n"
        "class Broken:\n"
        "    def __init__(self, env, value=0.0):\n"
        "        self.action = np.full(4, value / value - 1.0 if value else np.nan)\n"
        "    def predict(self, observation, state=None, episode_start=None, deterministic=True):\n"
        "        return self.action, None\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", registration.registered_controllers())
    artde_gym.register_controller("broken", "broken:Broken")
    given = {"env": "QuadInfinity-Payload-v0", "controller": "broken", "env_kwargs": QUICK}
    with pytest.raises(ActionError, match=r"broken with \{'value': 0\.0\}.*duration"):
        sweep({**given, "grid": {"gains.broken.value": [1.0, 0.0]}}, tmp_path / "run")
    assert read_sweep(tmp_path / "run")["gains.value"].tolist() == [1.0]  # what was finished before is kept


# ---------------------------------------------------------------- workers that die

WORK = """
import os, signal, time
from pathlib import Path

def work(job, on_time):
    folder, number, dies = job
    on_time(0.0)
    mark = Path(folder) / str(number)
    if dies == "always" or (dies == "once" and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
"""


@pytest.fixture
def work(tmp_path, monkeypatch) -> Any:
    (tmp_path / "dying.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    import dying  # pyright: ignore[reportMissingImports]

    yield dying.work
    del sys.modules["dying"]


def test_what_a_killed_worker_was_at_is_done_again(tmp_path, work):
    jobs = [(str(tmp_path), number, "once" if number in (3, 9) else "never") for number in range(12)]
    done = list(run_parallel(work, iter(jobs), 2, lambda *_: None))
    assert sorted((job[1], result) for job, result in done) == [(number, number**2) for number in range(12)]


def test_a_job_that_kills_every_worker_is_an_error_of_ours(tmp_path, work):
    with pytest.raises(WorkerError, match="3 times"):
        list(run_parallel(work, [(str(tmp_path), 0, "always")], 1, lambda *_: None))


# ---------------------------------------------------------------- command line

FILE = """\
env_kwargs: {duration: 0.15, engine: mujoco}
episodes: 3
grid:
  scenario: [S2-L4, Q1]
  controller: [tde, artde]
"""


@pytest.fixture
def file(tmp_path) -> Path:
    path = tmp_path / "sweep.yaml"
    path.write_text(FILE)
    return path


def test_command_prints_a_line_for_each_cell(tmp_path, file, whole):
    arguments = ["sweep", str(file), "--out", str(tmp_path / "run"), "--workers", "1"]
    outcome = CliRunner().invoke(app, arguments)
    assert outcome.exit_code == 0, outcome.output
    for words in ("scenario", "controller", "S2-L4", "Q1", "artde", "0/3", " deg", " m ", "Written to"):
        assert words in outcome.output
    same(read_sweep(tmp_path / "run"), whole)
    part = next((tmp_path / "run" / "episodes").iterdir())
    part.write_bytes(part.read_bytes()[:-1])
    outcome = CliRunner().invoke(app, arguments)
    assert f"set aside and run again: {part.name}" in outcome.output
    same(read_sweep(tmp_path / "run"), whole)


def command(file: Path, out: Path, *arguments: str) -> list[str]:
    return [sys.executable, "-m", "artde_gym.cli", "sweep", str(file), "--out", str(out), *arguments]


def test_a_mistake_is_one_line_and_exit_code_2(tmp_path, file):
    file.write_text("controler: tde\n")
    outcome = subprocess.run(
        command(file, tmp_path / "run", "--engine", "mujoco"), capture_output=True, text=True, timeout=60, check=False
    )
    assert outcome.returncode == 2
    assert len(outcome.stderr.strip().splitlines()) == 1
    assert "executor is 'mujoco'" in outcome.stderr


def test_ctrl_c_keeps_every_finished_episode(tmp_path, file):
    """A real interrupt to a real process group, workers included."""
    file.write_text(FILE.replace("episodes: 3", "episodes: 1000"))
    with subprocess.Popen(
        command(file, tmp_path / "run", "--workers", "2"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # background jobs are born ignoring it
    ) as process:
        try:
            while process.poll() is None and not list((tmp_path / "run" / "episodes").glob("*.parquet")):
                time.sleep(0.05)
            os.killpg(process.pid, signal.SIGINT)
            output, errors = process.communicate(timeout=300)
        finally:
            process.kill()
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "Interrupted" in output
    assert 0 < len(read_sweep(tmp_path / "run")) < 4000


# ---------------------------------------------------------------- long ones


@pytest.mark.slow
def test_killed_three_times_it_ends_with_the_same_bits(tmp_path):
    """The short version of the campaign in `make soak`: with this seed a worker, the sweep, and all of them."""
    script = [sys.executable, str(ROOT / "scripts" / "sweep_faults.py")]
    arguments = ["--episodes", "20", "--kills", "3", "--seed", "29", "--out", str(tmp_path / "faults")]
    outcome = subprocess.run([*script, *arguments], capture_output=True, text=True, timeout=600, check=False)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    assert "equal to the last bit" in outcome.stdout


def ray_environment(home: Path) -> dict[str, str]:
    """Ray keeps the token that its clusters ask for in the home folder."""
    return {**os.environ, "HOME": str(home), "RAY_AUTH_MODE": "token", "RAY_USAGE_STATS_ENABLED": "0"}


@pytest.mark.slow
def test_ray_gives_the_same_bits(tmp_path, file, whole):
    pytest.importorskip("ray", reason="Ray is not installed (extra scale)")
    arguments = command(file, tmp_path / "run", "--engine", "ray", "--workers", "2")
    env = ray_environment(tmp_path)
    outcome = subprocess.run(arguments, capture_output=True, text=True, timeout=300, check=False, env=env)
    assert outcome.returncode == 0, outcome.stderr
    same(read_sweep(tmp_path / "run"), whole)


CLUSTER = """
import sys
import ray

ray.init("local", num_cpus=2, include_dashboard=False, object_store_memory=80 * 2**20, log_to_driver=False)
print(ray.get_runtime_context().gcs_address, flush=True)
sys.stdin.read()
"""


def busy_worker_of(address: str) -> int | None:
    """A process of the cluster that is at an episode."""
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if (path / "cmdline").read_bytes().startswith(b"ray::_on_node"):
                parent = (path / "stat").read_text().rpartition(")")[2].split()[1]
                if address.encode() in (path.parent / parent / "cmdline").read_bytes():
                    return int(path.name)
        except OSError:
            continue
    return None


@pytest.mark.slow
def test_a_running_cluster_that_loses_a_worker_gives_the_same_bits(tmp_path, file, whole):
    pytest.importorskip("ray", reason="Ray is not installed (extra scale)")
    env = ray_environment(tmp_path)
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-c", CLUSTER], env=env, text=True, **pipes) as cluster:
        assert cluster.stdout
        address = cluster.stdout.readline().strip()
        arguments = command(file, tmp_path / "run", "--engine", "ray", "--address", address)
        assert address, "Ray did not start"
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        with subprocess.Popen(arguments, env=env, text=True, **pipes) as process:
            worker = None
            while process.poll() is None and (worker := busy_worker_of(address)) is None:
                time.sleep(0.02)
            if worker is not None:
                os.kill(worker, signal.SIGKILL)
            _, errors = process.communicate(timeout=300)
        cluster.communicate()
    assert worker is not None, errors
    assert process.returncode == 0, errors
    same(read_sweep(tmp_path / "run"), whole)
