"""The policy that knows the robot: computed torque with the nominal model of the biped, or of an arm."""

from __future__ import annotations

from typing import Any

from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.support import Supported
from artde_gym.registration import GainRange
from controllers.drive import DRIVES
from controllers.law_table import Nothing
from controllers.laws.computed_torque import ComputedTorqueGains, computed_torque
from controllers.laws.tracking import Array, JointInput, LawState
from controllers.policies import ControlInterface, TrackingPolicy
from controllers.presets import preset_gains
from controllers.robots import tuning_space as ranges_for_robot


class ComputedTorquePolicy(TrackingPolicy):
    """Computed torque on the inverse dynamics of an arm, or of a robot that stands on its feet as planned.

    The model is the robot without payload, pushes and friction; the pattern says how feet share the load.
    """

    any_library = False  # the model is NumPy's

    def __init__(self, interface: ControlInterface, gains: ComputedTorqueGains) -> None:
        super().__init__("computed-torque", interface, gains)
        spec = interface.nominal_robot
        self._arm = RigidBodyTree(spec) if spec.fixed else None
        if self._arm is None:
            self._model = Supported(spec)
            self._load = interface.observation["load_left_ref"].start

    def start(self, signals: JointInput) -> LawState:
        return Nothing()

    def step(self, state: Any, signals: JointInput, observation: Array) -> tuple[Array, LawState]:
        if (arm := self._arm) is not None:
            return computed_torque(self.gains, signals, arm.joint_torques), state
        load_left = observation[..., self._load]

        def inverse_dynamics(q: Array, qd: Array, qdd: Array) -> Array:
            return self._model.torque(load_left, q, qd, qdd).astype(q.dtype, copy=False)

        return computed_torque(self.gains, signals, inverse_dynamics), state


def make_computed_torque(env: Any, *, preset: str | None = None, **gains: Any) -> ComputedTorquePolicy:
    """Make the policy for a biped's or an arm's environment, at preset gains with some replaced.

    Raises:
        UnknownNameError, GainError: as `controllers.joint_space.make_joint_space`.
    """
    interface = ControlInterface.of(env)
    make = DRIVES[interface.robot].feedback if interface.robot in DRIVES else None
    gains = gains if make is None else {**make(env), **gains}
    return ComputedTorquePolicy(
        interface, preset_gains(interface.robot, "computed-torque", preset, interface.action.size, gains)
    )


def tuning_space(env: Any) -> dict[str, GainRange]:
    """Return the ranges in which tuning searches the gains."""
    return ranges_for_robot(env, law="computed-torque")
