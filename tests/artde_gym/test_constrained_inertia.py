"""The inverse inertia under contact: against Pinocchio, and by what it means."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from artde_gym.multibody.dynamics import RigidBodyTree, constrained_inverse_inertia
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.ojas.model import ojas
from artde_gym.robots.ojas.walking import walking_pattern

pytestmark = pytest.mark.once

POSES = walking_pattern(0.1, 1.0, 8.0, 0.001).q[2500:4500:400] + np.random.default_rng(4).normal(
    scale=0.05, size=(5, 12)
)
STANDING = {"left": slice(0, 1), "right": slice(1, 2), "both": slice(0, 2)}
ours = pytest.mark.parametrize("standing", STANDING)


def jacobian(tree: RigidBodyTree, spec: RobotSpec, standing: str, q: np.ndarray) -> np.ndarray:
    return np.concatenate([tree.jacobian(foot, q) for foot in spec.feet[STANDING[standing]]], axis=-2)


@ours
@pytest.mark.parametrize("kind", ["rotor", "lumped"])
def test_it_agrees_with_pinocchio(standing: str, kind: Any, judge: Callable[[RobotSpec], Any]) -> None:
    """Pinocchio's dynamics with contacts: the acceleration of each joint by a unit torque on each."""
    pin: Any = pytest.importorskip("pinocchio")
    spec = ojas(kind)
    tree, other = RigidBodyTree(spec), judge(spec)
    for q in POSES:
        configuration = other.configuration(q)
        pin.computeJointJacobians(other.model, other.data, configuration)
        pin.updateFramePlacements(other.model, other.data)
        frames = [other.model.getFrameId(foot, pin.BODY) for foot in spec.feet[STANDING[standing]]]
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        rows = np.concatenate([pin.getFrameJacobian(other.model, other.data, frame, world) for frame in frames])
        matrix = pin.computeKKTContactDynamicMatrixInverse(other.model, other.data, configuration, rows, 0.0)
        to_model = other.map()
        size = other.model.nv
        expected = to_model.T @ matrix[:size, :size] @ to_model  # the map is orthogonal without rotor links
        found = constrained_inverse_inertia(tree.mass_matrix(q), jacobian(tree, spec, standing, q))
        np.testing.assert_allclose(found, expected[6:, 6:], rtol=1e-6, atol=1e-8)


@ours
def test_the_feet_stand(standing: str) -> None:
    """With the ground's forces, torques move the joints by A tau, and the feet not at all."""
    spec = ojas("rotor")
    tree = RigidBodyTree(spec)
    q, tau = POSES[0], np.random.default_rng(5).normal(size=12)
    mass, rows = tree.mass_matrix(q), jacobian(tree, spec, standing, q)
    acceleration = constrained_inverse_inertia(mass, rows) @ tau
    # the base's acceleration is what the first foot's constraint says; the others then hold by themselves
    base = -np.linalg.solve(rows[:6, :6], rows[:6, 6:] @ acceleration)
    whole = np.concatenate([base, acceleration])
    np.testing.assert_allclose(rows @ whole, 0.0, atol=1e-9)
    missing = mass @ whole - np.concatenate([np.zeros(6), tau])  # is a force of the ground on the feet
    wrench = np.linalg.lstsq(rows.T, missing, rcond=None)[0]
    np.testing.assert_allclose(rows.T @ wrench, missing, atol=1e-9)


def test_the_rank_is_that_of_the_joints_that_the_feet_leave_free() -> None:
    spec = ojas("rotor")
    tree = RigidBodyTree(spec)
    for standing, free in (("left", 12), ("right", 12), ("both", 6)):
        found = constrained_inverse_inertia(tree.mass_matrix(POSES), jacobian(tree, spec, standing, POSES))
        assert (np.linalg.matrix_rank(found, tol=1e-6, hermitian=True) == free).all()
        doubled = np.concatenate([jacobian(tree, spec, standing, POSES)] * 2, axis=-2)
        np.testing.assert_allclose(constrained_inverse_inertia(tree.mass_matrix(POSES), doubled), found, atol=1e-6)
