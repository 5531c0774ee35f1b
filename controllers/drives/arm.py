"""Drive of arms: one law on all joints, at gains designed from the arm's model."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from artde_gym.doctor.check_result import CheckResult
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reference import PICK, TIMES, reference
from controllers.arm_design import design_arm
from controllers.design import preset_designs
from controllers.drive import Drive, Preset, Ranges
from controllers.joint_space import make_joint_space
from controllers.laws.artde import ArtdeGains
from controllers.laws.atde import AtdeGains
from controllers.laws.computed_torque import ComputedTorqueGains
from controllers.laws.tde import ConstantGains, TdeGains
from controllers.loop import Loop
from controllers.policies import ControlInterface, TrackingPolicy
from controllers.stability_check import REMEDY, judged
from controllers.workspace_design import workspace_design

PERIOD = 0.001  # s
_SAMPLES = 200  # of the reference
_ALPHA, _EPS, _FLOOR, _GAMMA = 4.0, 5e-5, 0.01, 500.0  # as for the biped: the thesis', gamma as there
_SOURCE = "designed from the arm's model and the control period (`controllers.arm_design`)"
_ROBUST = f"{_SOURCE}; the robust term's as for the biped"


def make_arm(env: Any, *, law: str, **options: Any) -> TrackingPolicy:
    """Build the policy of a law at gains designed for the environment's arm and control period.

    Args:
        env: the environment that it will drive.
        law: name of the law.
        options: of `controllers.joint_space.make_joint_space`; gains among them replace the designed ones.
    """
    interface = ControlInterface.of(env)
    gains = design_arm(interface.nominal_robot, interface.control_period)._asdict()
    return make_joint_space(env, law=law, **{**gains, **options})


def feedback(env: Any) -> dict[str, Any]:
    """Return the designed gains of computed torque."""
    interface = ControlInterface.of(env)
    gains = design_arm(interface.nominal_robot, interface.control_period)
    return {"k_p": gains.k_p, "k_d": gains.k_d}


def loops() -> list[Loop]:
    """Return the joints of the built-in arm along pick and place."""
    spec, time = panda(), np.linspace(0.0, TIMES[-1], _SAMPLES)
    inertia = RigidBodyTree(spec).joint_mass_matrix(reference(spec, PICK, time).q)
    return [Loop("joints", spec.actuated, "kg m^2", time, inertia)]


def stability() -> list[CheckResult]:
    """Judge the presets along pick and place, and the design in all poses."""
    (loop,) = loops()
    valid, found = judged(preset_designs(loop, DRIVE))
    whole = workspace_design(panda(), PERIOD, {})
    low, high = whole.eigenvalues.min(), whole.eigenvalues.max()
    return [
        _result("arm, joints", valid, found),
        _result("arm, workspace", whole.valid, f"{low:.3f} to {high:.3f}"),
    ]


def _result(what: str, valid: bool, found: str) -> CheckResult:
    return CheckResult(what, "ok", found) if valid else CheckResult(what, "failed", found, REMEDY)


def _presets() -> dict[tuple[str, str], Preset]:
    """Return the gains of the built-in arm at 1 ms; `make_arm` designs those of others."""
    feedback = design_arm(panda(), PERIOD)
    artde = ArtdeGains(
        *feedback, alpha=_ALPHA, gamma_0=_GAMMA, gamma_1=_GAMMA, beta_floor=_FLOOR, beta_start=_FLOOR, eps=_EPS
    )
    robust = dataclasses.replace(artde, growth="midpoint", clamp=True, leakage=0.1, cap=1.0)
    constant = ConstantGains(*feedback, alpha=_ALPHA, c=_FLOOR, eps=_EPS)
    return {
        ("tde", "designed"): Preset(TdeGains(*feedback), _SOURCE),
        ("atde", "designed"): Preset(
            AtdeGains(*feedback, alpha=_ALPHA, gamma_0=_GAMMA, c_floor=_FLOOR, c_start=_FLOOR, eps=_EPS), _ROBUST
        ),
        ("artde", "designed"): Preset(artde, _ROBUST),
        ("artde", "robust"): Preset(robust, f"{_ROBUST} with bounded gains"),
        ("tde+c", "designed"): Preset(constant, f"{_SOURCE}; c is the floor of ARTDE's"),
        ("computed-torque", "designed"): Preset(
            ComputedTorqueGains(feedback.k_p, feedback.k_d), f"{_SOURCE}, Kp and Kd"
        ),
    }


_FEEDBACK: Ranges = {"k_p": (25.0, 50_000.0), "k_d": (10.0, 1000.0)}
_ROBUST_TERM: Ranges = {**_FEEDBACK, "alpha": (0.5, 20.0), "gamma_0": (10.0, 5000.0)}
RANGES: dict[str, Ranges] = {
    "tde": _FEEDBACK,
    "atde": _ROBUST_TERM,
    "artde": {**_ROBUST_TERM, "gamma_1": (10.0, 5000.0)},
    "computed-torque": _FEEDBACK,
}
DRIVE = Drive(
    "arm",
    _presets(),
    RANGES,
    make=make_arm,
    period=PERIOD,
    loops=loops,
    workspace=workspace_design,
    stability=stability,
    feedback=feedback,
)
