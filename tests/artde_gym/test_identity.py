"""By what a folder knows a policy again, in another process too; and policies and gains of any kind with a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest

import artde_gym
import baselines
import controllers
from artde_gym import registration
from artde_gym.errors import OptionError, StoreError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.identity import digest, identity_of
from artde_gym.studies import frontier, sweep
from artde_gym.video import video
from baselines.saved import SHIPPED

QUADROTOR = "QuadInfinity-Payload-v0"


class Lift:
    """A thrust."""

    def __init__(self, thrust: float, **more: Any) -> None:
        self.action = np.array([thrust, 0.0, 0.0, 0.0])
        self.__dict__ |= more

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> Any:
        return self.action, None


def run(policy: Any, folder: Path | None, **options: Any) -> Any:
    """Its number of episodes that were run."""
    ran: list[int] = []
    result = evaluate(
        {"mine": policy}, QUADROTOR, disturbances={}, env_kwargs={"duration": 0.15}, episodes=1, out=folder,
        on_progress=lambda update: ran.append(1) if update.ended else None, **options,
    )  # fmt: skip
    assert result.complete
    return len(ran)


def identified_by(folder: Path) -> str:
    return json.loads((folder / "summary.json").read_text())["provenance"]["identified_by"]["mine"]


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_a_model_of_stable_baselines_is_known_by_its_parameters(algorithm, tmp_path):
    learning = pytest.importorskip("stable_baselines3")
    kind = getattr(learning, algorithm)
    env = gym.make(QUADROTOR, duration=0.3)
    sizes = {"n_steps": 8, "batch_size": 8} if algorithm == "PPO" else {"learning_starts": 4, "buffer_size": 50}
    model = kind("MlpPolicy", env, seed=0, device="cpu", **sizes)
    model.save(tmp_path / "model.zip")
    assert run(model, tmp_path / "run") == 1
    assert identified_by(tmp_path / "run") == "parameters"
    assert run(kind.load(tmp_path / "model.zip", device="cpu"), tmp_path / "run") == 0  # as another process has it
    model.set_logger(learning.common.logger.Logger(None, []))  # the default one makes a folder
    model.learn(16)
    with pytest.raises(StoreError, match="different: controllers"):
        run(model, tmp_path / "run")
    env.close()


@pytest.mark.parametrize(
    ("policy", "other", "by"),
    [
        (lambda: Lift(14.0, identity="run 3"), lambda: Lift(14.0, identity="run 4"), "identity"),
        (lambda: Lift(14.0), lambda: Lift(15.0), "attributes"),
        (lambda: Lift(14.0, gains={"k": [1, 2.0]}), lambda: Lift(14.0, gains={"k": [1, 2.5]}), "attributes"),
        (lambda: Lift(14.0, hook=lambda: 1, hand=open), None, "class and name"),
        (lambda: Lift(14.0, rng=np.random.default_rng(0)), None, "class and name"),
    ],
)
def test_policies_of_ones_own_are_known_by_what_tells_them_apart(policy, other, by, tmp_path):
    assert run(policy(), tmp_path) == 1
    assert identified_by(tmp_path) == by
    assert run(policy(), tmp_path) == 0
    if other is not None:
        with pytest.raises(StoreError, match="different: controllers"):
            run(other(), tmp_path)


def test_controllers_of_ours_as_objects_are_known_by_their_gains_and_weights():
    with gym.make(QUADROTOR) as env:
        first, again = (controllers.make("artde", env) for _ in range(2))
        other = controllers.make("artde", env, alpha_p=3.0)
        assert identity_of(first) == identity_of(again)
        assert identity_of(first).by == "attributes"
        assert identity_of(first) != identity_of(other)
        loaded, trained = baselines.load(SHIPPED / "quadrotor-gale", env), controllers.make("tde+ppo", env)
        assert identity_of(loaded) == identity_of(trained)
        assert identity_of(loaded).by == "identity"


def test_values_without_an_identity_are_refused():
    looped: list[Any] = []
    looped.append(looped)
    for value in (object(), lambda: 1, np.array([object()]), {"a": {1}}, looped):
        with pytest.raises(TypeError):
            digest(value)


def test_an_identity_is_text():
    with pytest.raises(OptionError, match="identity of a policy is 3"):
        identity_of(Lift(1.0, identity=3))


def test_a_policy_that_cannot_be_pickled_runs_in_one_process_and_is_refused_for_several(tmp_path):
    policy = Lift(14.0, hook=lambda: 1)
    assert run(policy, tmp_path / "run") == 1
    with pytest.raises(OptionError, match=r"controller 'mine'.*picklable.*workers=1"):
        run(policy, None, workers=2)


def test_a_registered_controller_that_cannot_be_pickled_is_refused_for_several_processes(tmp_path, monkeypatch):
    monkeypatch.setattr(registration, "_controllers", registration.registered_controllers())
    artde_gym.register_controller("lift", f"{__name__}:make_lift", hook=lambda: 1)
    given = {"env": QUADROTOR, "controller": "lift", "disturbances": {}, "env_kwargs": {"duration": 0.15}}
    for go in (
        lambda: evaluate(["lift"], QUADROTOR, workers=2, out=tmp_path / "run"),
        lambda: sweep(given, tmp_path / "run", workers=2),
    ):
        with pytest.raises(OptionError, match=r"controller 'lift'.*picklable.*workers=1"):
            go()
    assert not (tmp_path / "run").exists()
    assert evaluate(["lift"], QUADROTOR, episodes=1, env_kwargs={"duration": 0.15}, out=tmp_path / "run").complete


@pytest.mark.parametrize(
    "value", [np.float64(1.25), np.float32(1.25), np.array([1.25, 1.25, 1.5]), np.array(1.25), (1.25, 1.25, 1.5)]
)
def test_numpy_values_are_gains_as_numbers_are(value, tmp_path):
    def episodes(gain: Any, folder: Path | None) -> Any:
        return evaluate(
            ["tde"], QUADROTOR, disturbances={}, env_kwargs={"duration": 0.15}, episodes=1, out=folder,
            gains={"tde": {"k_p_p": gain}},
        ).episodes  # fmt: skip

    plain = [float(part) for part in value] if np.ndim(value) else float(value)
    first = episodes(value, tmp_path)
    pd.testing.assert_frame_equal(episodes(plain, None), first, check_exact=True)
    assert len(episodes(plain, tmp_path)) == 1  # the same folder
    assert json.loads((tmp_path / "summary.json").read_text())["configuration"]["gains"]["tde"]["k_p_p"] == plain


@pytest.mark.parametrize("gains", [[1], 1, {"tde": 3}, {"tde": [1]}, "tde"])
def test_gains_that_are_no_mapping_are_refused(gains):
    for go in (
        lambda: evaluate(["tde"], QUADROTOR, gains=gains),
        lambda: frontier(["tde"], QUADROTOR, "wind.scale", gains=gains),
        lambda: video(["tde"], "film.png", QUADROTOR, gains=gains),
    ):
        with pytest.raises(OptionError, match=r"gains.* is .*mapping"):
            go()


def test_gains_of_a_controller_that_is_not_shown_are_refused():
    with pytest.raises(UnknownNameError, match="gains is 'artde'"):
        video(["tde"], "film.png", QUADROTOR, gains={"artde": {}})


def test_gains_that_json_cannot_write_are_refused_with_a_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(registration, "_controllers", registration.registered_controllers())
    artde_gym.register_controller("lift", f"{__name__}:make_lift")
    given: dict[str, Any] = {"gains": {"lift": {"hook": len}}, "env_kwargs": {"duration": 0.15}, "episodes": 1}
    assert evaluate(["lift"], QUADROTOR, **given).complete
    with pytest.raises(OptionError, match=r"gains is .*JSON can store"):
        evaluate(["lift"], QUADROTOR, out=tmp_path / "run", **given)
    assert not (tmp_path / "run").exists()


def make_lift(env: Any, hook: Any = None) -> Lift:
    return Lift(14.0, hook=hook)
