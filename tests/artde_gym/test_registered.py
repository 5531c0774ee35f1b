"""Scenarios, metrics and kinds of disturbances of one's own, in scripts and with several workers."""

import os
import subprocess
import sys
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest

from artde_gym.disturbances import DISTURBANCES
from artde_gym.disturbances.kinds import DisturbanceSpec, Parameter
from artde_gym.errors import OptionError, StoreError
from artde_gym.evaluation import Result, evaluate, register_metric
from artde_gym.evaluation.registered import METRICS
from artde_gym.kit import ROBOTS
from artde_gym.registry import Registry
from artde_gym.report.report import write_report
from artde_gym.scenarios import CUSTOM, SCENARIOS, Scenario, register_scenario
from artde_gym.sim.factory import ENGINES
from artde_gym.studies.reproduce.claims import CLAIMS

WALK = "BipedWalk-Payload-v0"

REGISTERED = """
import sys

import numpy as np

from artde_gym.disturbances import Kind, Load, Parameter, register_disturbance
from artde_gym.evaluation import evaluate, register_metric
from artde_gym.scenarios import Scenario, register_scenario


def friction(values, states):
    return Load(tau=-values["torque"][:, None] * np.tanh(states.qd / 0.1))


def register():
    torque = Parameter("torque", "Nm", 0.0, 20.0, None, "largest torque of friction")
    register_disturbance(Kind("rust", "Friction.", (torque,), requires="joints", shorthand="torque"), friction)
    disturbances = {"rust": {"uniform": [0.1, 0.3]}}
    register_scenario(Scenario("rusty", "BipedWalk-Payload-v0", {"duration": 0.2}, disturbances, "rust"))
    register_metric("knee_speed", lambda fields, _: np.abs(fields["qd"][..., 3]), "max")


def run(workers, out):
    return evaluate(["tde", "artde"], scenario="rusty", episodes=2, workers=workers, out=out)

"""
ABOVE = "register()\nif __name__ == '__main__':\n    run(1, sys.argv[1])\n    run(2, sys.argv[2])\n"
BELOW = "if __name__ == '__main__':\n    register()\n    run(2, sys.argv[1])\n"


PLUG_IN = """
import numpy as np

from artde_gym.disturbances import Kind, Load, Parameter
from artde_gym.evaluation import Metric
from artde_gym.sim.factory import EngineSpec

TORQUE = Parameter("torque", "Nm", 0.0, 20.0, None, "largest torque of friction")
KIND = Kind("rust", "Friction.", (TORQUE,), "joints", "torque", effect=lambda values, states: Load(
    tau=-values["torque"][:, None] * np.tanh(states.qd)))
METRIC = Metric("knee_speed", lambda fields, _: np.abs(fields["qd"][..., 3]), "max")
ENGINE = EngineSpec("mine", "Mine", "no_such_module:Engine", "mine")
CLAIMS = ()
"""
ENTRY_POINTS = """
[artde_gym.disturbances]
rust = plug_in:KIND
[artde_gym.metrics]
knee_speed = plug_in:METRIC
[artde_gym.engines]
mine = plug_in:ENGINE
[artde_gym.claims]
plug-in = plug_in:CLAIMS
[artde_gym.checks]
broken = plug_in:no_such_check
[artde_gym.benchmarks]
more = plug_in:more
"""
SEEN = """
from artde_gym.benchmark import SECTIONS
from artde_gym.cli import app
from artde_gym.doctor import CHECKS
from artde_gym.sim.factory import ENGINES
from artde_gym.studies.reproduce.claims import CLAIMS
import sys

assert {"inference", "training", "more"} <= set(SECTIONS)
assert {"stability", "broken", "mine"} <= set(CHECKS)
assert [*ENGINES] == ["bullet", "mujoco", "mine"]
assert [*CLAIMS] == ["ojas", "q450", "plug-in"]
if __name__ == "__main__":
    app(sys.argv[1:])
"""


@pytest.fixture(autouse=True)
def clean(monkeypatch):
    for registry in (DISTURBANCES, METRICS, SCENARIOS):
        len(registry)
        monkeypatch.setattr(registry, "_entries", dict(registry))


def run_script(folder, text, *arguments):
    script = folder / "script.py"
    script.write_text(REGISTERED + text)
    return subprocess.run([sys.executable, str(script), *map(str, arguments)], capture_output=True, text=True)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("registered")
    ended = run_script(folder, ABOVE, folder / "one", folder / "two")
    assert ended.returncode == 0, ended.stderr
    return folder


def test_workers_know_what_their_script_has_registered(runs):
    one, two = ((runs / name / "episodes.csv").read_bytes() for name in ("one", "two"))
    assert one == two
    episodes = pd.read_csv(runs / "two" / "episodes.csv")
    assert set(episodes["scenario"]) == {"rusty"}
    assert min(episodes["knee_speed"]) > 0
    assert all(0.1 <= torque <= 0.3 for torque in episodes["disturbance.rust.torque"])


def test_a_metric_is_in_summary_comparison_and_report(runs):
    result = Result(pd.read_csv(runs / "two" / "episodes.csv"))
    assert result.summary().loc["rusty", "artde", "knee_speed"]["n"] == 2
    assert result.compare("artde", "tde").loc["rusty", "knee_speed"]["pairs"] == 2
    assert "rusty: knee_speed" in write_report(runs / "two").read_text()


def test_a_worker_that_lacks_a_metric_says_so(tmp_path):
    ended = run_script(tmp_path, BELOW, tmp_path / "out")
    assert "register it at import" in ended.stderr


def test_metrics_are_those_of_the_whole_signal_in_single_and_batch(tmp_path):
    for reduction in ("mean", "rms", "max", "min"):
        register_metric(f"height_{reduction}", lambda fields, _: fields["base_height"][..., 0], reduction)
    register_metric("gain_mean", lambda _, inside: inside.get("c"))
    options = {"episodes": 2, "env_kwargs": {"duration": 0.15, "engine": "mujoco"}, "record_hz": np.inf}
    single = evaluate(["tde", "artde"], WALK, out=tmp_path, record_episodes=2, **options)
    batch = evaluate(["tde", "artde"], WALK, vectorized=True, **options)
    pd.testing.assert_frame_equal(single.episodes.filter(like="height_"), batch.episodes.filter(like="height_"))
    assert single.episodes.groupby("controller")["gain_mean"].count().to_dict() == {"artde": 2, "tde": 0}
    heights = np.load(tmp_path / "traces" / "custom" / "artde-1.npz")["base_height"][:, 0].astype(float)
    expected = [heights.mean(), np.sqrt((heights**2).mean()), heights.max(), heights.min()]
    np.testing.assert_allclose(single.rows("custom", "artde").loc[1].filter(like="height_").tolist(), expected, 1e-6)


def test_a_folder_keeps_its_metrics(tmp_path):
    options = {"episodes": 1, "env_kwargs": {"duration": 0.1}, "out": tmp_path}
    evaluate(["tde"], WALK, **options)
    register_metric("speed", lambda fields, _: fields["base_velocity"][..., 0])
    with pytest.raises(StoreError, match="metrics"):
        evaluate(["tde"], WALK, **options)


UNFIT = ["", 3, "a/b", "a\\b", "a,b", " a", "a\n", ".a", "é" * 101, "a" * 101]
REGISTRIES: dict[str, tuple[Registry[Any], list[str]]] = {
    "scenario": (SCENARIOS, [CUSTOM]),
    "robot": (ROBOTS, ["all"]),
    "engine": (ENGINES, ["both", "fastest"]),
    "disturbance": (DISTURBANCES, []),
    "metric": (METRICS, []),
    "claims": (CLAIMS, []),
}


@pytest.mark.parametrize("noun", REGISTRIES)
def test_what_cannot_be_a_name_is_refused_at_registration(noun):
    registry, reserved = REGISTRIES[noun]
    before = dict(registry)
    for name in [*UNFIT, *reserved]:
        with pytest.raises(OptionError, match=f"name of {noun}"):
            registry.register(name, next(iter(before.values()), None), replace=True)
    assert dict(registry) == before


@pytest.mark.parametrize(("name", "parameter"), [("a.b", "c"), ("a", "b.c"), ("a,b", "c")])
def test_a_kind_and_its_parameters_have_names_that_paths_can_hold(name, parameter):
    with pytest.raises(OptionError, match="name of a disturbance or parameter"):
        DisturbanceSpec(name, "", (Parameter(parameter, "", 0.0, 1.0, None, ""),), "joints")


AFTER_AN_EVENT = ["recovery_time_s_mine", "recovered_mine", "peak_error_deg_mine"]
OF_STUDIES = ["world", "disturbances"]


@pytest.mark.parametrize("name", ["fell", "Speed", "", 3, "seed", *AFTER_AN_EVENT, *OF_STUDIES])
def test_a_name_is_one_of_a_new_column(name):
    with pytest.raises(OptionError, match="name of a metric"):
        register_metric(name, lambda fields, _: fields["qd"][..., 0])


def test_a_metric_does_not_take_the_place_of_another_column():
    register_metric("saturation", lambda fields, _: fields["qd"][..., 0])
    with pytest.raises(OptionError, match="saturation"):
        evaluate(["tde"], WALK, episodes=1, env_kwargs={"duration": 0.1})


def test_a_signal_has_one_value_a_sample_and_episode():
    register_metric("speeds", lambda fields, _: fields["qd"])
    with pytest.raises(OptionError, match="shape of metric 'speeds'"):
        evaluate(["tde"], WALK, episodes=1, env_kwargs={"duration": 0.1})


def test_a_scenario_of_ones_own_is_one_to_reset_to():
    register_scenario(Scenario("icy", WALK, {}, {"friction": 0.2}, "ice"))
    env: Any = gym.make(WALK, duration=0.1)
    env.reset(seed=0, options={"scenario": "icy"})
    assert env.unwrapped.sampled_disturbances == {"friction": {"coefficient": 0.2}}


def test_the_command_line_and_its_workers_find_what_a_package_brings(tmp_path, monkeypatch):
    packed = tmp_path / "plug_in-1.0.dist-info"
    packed.mkdir()
    (tmp_path / "plug_in.py").write_text(PLUG_IN)
    (packed / "METADATA").write_text("Metadata-Version: 2.1\nName: plug-in\nVersion: 1.0\n")
    (packed / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    (tmp_path / "script.py").write_text(SEEN)
    words = f"evaluate --env {WALK} --controllers tde,artde --episodes 1 --workers 2 --out {tmp_path / 'out'}".split()
    kwargs = ["--env-kwargs", '{"duration": 0.2}', "--disturbances", '{"rust": 0.2}']
    script = [sys.executable, str(tmp_path / "script.py")]
    ended = subprocess.run([*script, *words, *kwargs], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert "knee_speed" in ended.stdout
    episodes = pd.read_csv(tmp_path / "out" / "episodes.csv")
    assert min(episodes["knee_speed"]) > 0
    assert set(episodes["disturbance.rust.torque"]) == {0.2}
    ended = subprocess.run([*script, "doctor", "--checks", "broken,mine"], capture_output=True, text=True)
    said = " ".join(ended.stdout.split())
    assert "no attribute 'no_such_check'" in said
    assert "Mine cannot be imported (No module named 'no_such_module'): pip install 'mine'" in said
