"""The sites of many robots in one call are those of one robot at a time, to the bit."""

from __future__ import annotations

import numpy as np
import pytest

from artde_gym.errors import RobotError
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.ojas.model import ojas
from artde_gym.sim.mujoco_batch import MujocoBatch
from artde_gym.sim.mujoco_kinematics import COPIES

pytestmark = pytest.mark.once


@pytest.mark.parametrize("spec", [panda(), ojas()], ids=["fixed", "floating"])
@pytest.mark.parametrize("n", [1, COPIES, COPIES + 3])
def test_sites_of_a_batch_are_those_of_its_worlds(spec: RobotSpec, n: int) -> None:
    batch, rng = MujocoBatch(spec, n, 0.001, threads=1), np.random.default_rng(n)
    for world in range(n):
        batch.reset(world, (0.1 * world, 0.2, 0.9), rng.uniform(-1.5, 1.5, len(spec.actuated)))
        batch.worlds[world].attach_payload(0.1 * world, (0.0, 0.01 * world, 0.1))
    batch.step(rng.normal(size=(n, len(spec.actuated))), steps=20)
    for name, _, _ in spec.sites:
        np.testing.assert_array_equal(batch.site(name), [world.site(name) for world in batch.worlds])


def test_a_diverged_robot_leaves_the_others_as_they_are() -> None:
    batch = MujocoBatch(panda(), 3, 0.001, threads=1)
    for world in range(3):
        batch.reset(world, (0.0, 0.0, 0.0), np.full(7, 0.3))
    sound = batch.site("tool")
    batch.reset(1, (0.0, 0.0, 0.0), np.full(7, np.nan))
    found = batch.site("tool")
    np.testing.assert_array_equal(found[[0, 2]], sound[[0, 2]])
    assert np.isnan(found[1]).any()


def test_an_unknown_site_is_refused() -> None:
    with pytest.raises(RobotError, match="site is 'elbow'"):
        MujocoBatch(panda(), 1, 0.001, threads=1).site("elbow")
