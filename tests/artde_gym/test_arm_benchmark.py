"""The arm's section of the benchmark: ratios of the same motion, and a bare loop that moves as the engine does."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.benchmark import measure
from artde_gym.sim.engine_loops import joint_loop


def test_the_section_compares_the_environment_with_the_bare_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("artde_gym.benchmark.arm.ENGINES", {"mujoco": "MuJoCo"})
    figures = {figure.what: figure for figure in measure(["arm"], quick=True)["arm"].figures}
    assert 0 < figures["MuJoCo, env.step: rate against bare"].value <= 1.2
    assert figures["MuJoCo, bare: write torques, step, read joints"].value > 0


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
