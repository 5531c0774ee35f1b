"""The arm's section of the benchmark: ratios of the same motion, and bare loops that move as the engine does."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.benchmark import measure
from artde_gym.benchmark.arm import PlainArm
from artde_gym.benchmark.environments import arm
from artde_gym.benchmark.timing import ClosedLoop
from artde_gym.sim.engine_loops import joint_loop, joint_loops


def test_the_section_compares_the_environment_with_the_bare_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("artde_gym.benchmark.arm.ENGINES", {"mujoco": "MuJoCo"})
    monkeypatch.setattr("artde_gym.benchmark.arm.SIZES", (2,))
    monkeypatch.setattr("artde_gym.benchmark.arm.MANY", 1000)
    figures = {figure.what: figure for figure in measure(["arm"], quick=True)["arm"].figures}
    assert 0 < figures["MuJoCo, env.step: rate against bare"].value <= 1.2
    assert figures["MuJoCo, bare: write torques, step, read joints"].value > 0
    assert figures["MuJoCo, 2 arms, env.step: rate against bare"].value > 0


def test_the_plain_step_is_the_environments() -> None:
    loop = ClosedLoop("tde", arm(engine="mujoco", disturbances={}))
    loop._advance()
    plain = PlainArm(loop, "mujoco")
    env = arm(engine="mujoco", disturbances={})
    plain.env.reset(seed=0)
    env.reset(seed=0)
    plain._tau = env._tau
    for action in loop.actions:
        observation, reward, *_ = env.step(action)
        plain.step(action)
        np.testing.assert_array_equal(plain.observation, observation)
        assert plain.reward == pytest.approx(reward, rel=1e-12)


def test_bare_arms_move_as_bare_arms_one_by_one() -> None:
    one = arm(engine="mujoco")
    one.reset(seed=0)
    torques = np.random.default_rng(0).normal(size=(20, 3, 7))
    many = joint_loops(one._engine, 3)
    together = [many(tau) for tau in torques][-1]
    for number in range(3):
        one.reset(seed=0)
        step = joint_loop(one._engine)
        alone = [step(tau[number]) for tau in torques][-1]
        np.testing.assert_array_equal(together[number], alone)


@pytest.mark.parametrize("torque", [0.0, 5.0])
def test_the_bare_loop_moves_a_fixed_arm_as_the_engine_does(engine_name: str, torque: float) -> None:
    places = []
    for bare in (False, True):
        env: Any = gym.make("ArmTrack-Payload-v0", engine=engine_name, disturbances={}).unwrapped
        env.reset(seed=0)
        engine = env._engine
        step = joint_loop(engine) if bare else engine.step
        for _ in range(20):
            step(np.full(7, torque))
        places.append(engine.state().q)
        env.close()
    np.testing.assert_array_equal(*places)
