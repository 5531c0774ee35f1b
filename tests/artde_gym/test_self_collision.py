import dataclasses

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.robots.ojas.model import ojas
from artde_gym.sim.factory import make_engine

pytestmark = pytest.mark.once


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_feet_stop_each_other_only_if_the_spec_says_so(engine):
    """In the air, hips roll the feet against each other: they meet when the soles' edges, 2 cm apart, do."""
    ends = []
    for collides in (False, True):
        spec = dataclasses.replace(ojas("lumped"), feet_collide=collides)
        world = make_engine(engine, spec, 0.001)
        world.set_friction(0.8)
        world.set_gravity((0.0, 0.0, 0.0))
        world.reset((0.0, 0.0, 2.0), np.zeros(12))
        inward = np.zeros(12)
        inward[1], inward[7] = -1.0, 1.0
        for _ in range(800):
            world.step(inward)
        ends.append(world.state().q)
        world.close()
    apart, together = ends[1][1] - ends[1][7], ends[0][1] - ends[0][7]
    assert together < -1.0  # passed through each other
    assert -0.2 < apart < 0.0


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_a_walk_as_planned_does_not_notice(engine):
    ends = []
    for collides in (False, True):
        env = gym.make(
            "BipedWalk-Payload-v0", disturbances={}, duration=4.0, engine=engine, self_collision=collides
        ).unwrapped
        observation, _ = env.reset(seed=0)
        for _ in range(200):
            observation = env.step(np.zeros(12))[0]
        ends.append(observation)
        env.close()
    np.testing.assert_array_equal(*ends)
