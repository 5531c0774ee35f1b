"""The quadrotor's policies: laws of position and attitude in one cascade."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from controllers.law_spec import LawSpec
from controllers.law_table import LAWS, find_law
from controllers.laws.cascade import CascadeGains, CascadeState, QuadrotorInput, attitude_errors, cascade, cascade_init
from controllers.laws.namespaces import namespace
from controllers.laws.tracking import Array, LawState
from controllers.laws.vectors import Axes, joined
from controllers.policies import ControlInterface, Policy, flatten
from controllers.presets import LOOPS, preset_gains

AXES = 3  # of a position, and of an attitude


class QuadrotorPolicy(Policy):
    """A cascade of one of the laws, or of two that belong together.

    Args:
        name: of the law.
        interface: a quadrotor's environment.
        gains: of the cascade.
        laws: of the position and the attitude; None for those that belong to the name.
    """

    def __init__(
        self,
        name: str,
        interface: ControlInterface,
        gains: CascadeGains,
        *,
        laws: tuple[LawSpec, LawSpec] | None = None,
    ) -> None:
        position, attitude = loop_laws(name) if laws is None else laws
        self._position, self._attitude = position.law, attitude.law
        period = interface.control_period
        own = {
            "position": position.convert(gains.position, period),
            "attitude": attitude.convert(gains.attitude, period),
        }
        super().__init__(name, interface, dataclasses.replace(gains, **own))
        self._period = period
        self._at = interface.observation.slices

    def read(self, observation: Array) -> QuadrotorInput:
        last = observation.ndim - 1
        xp = namespace(observation)
        if xp is np:
            columns = np.ascontiguousarray(observation.transpose(last, *range(last)))
            rows = columns.transpose(*range(1, last + 1), 0)
        else:
            columns, rows = xp.moveaxis(observation, -1, 0), observation
        at = self._at
        rotation, wrench = columns[at["rot_body_to_world"]], columns[at["wrench_applied"]]
        x, y, z = ((rotation[i], rotation[3 + i], rotation[6 + i]) for i in range(3))
        return QuadrotorInput(
            position=rows[..., at["position"]],
            velocity=rows[..., at["velocity"]],
            axes=(x, y, z),
            rates=rows[..., at["body_rates"]],
            position_ref=rows[..., at["position_ref"]],
            velocity_ref=rows[..., at["velocity_ref"]],
            acceleration_ref=rows[..., at["acceleration_ref"]],
            jerk_ref=rows[..., at["jerk_ref"]],
            yaw_ref=columns[at["yaw_ref"]][0],
            yaw_rate_ref=columns[at["yaw_rate_ref"]][0],
            thrust_applied=wrench[0],
            torque_applied=rows[..., at["wrench_applied"]][..., 1:],
        )

    def with_residual(self, signals: QuadrotorInput, du: Array) -> QuadrotorInput:
        """Add to the position's acceleration, and to the attitude's if `du` is (..., 6) (rad/s^2, body axes)."""
        position = signals.acceleration_ref + du[..., :AXES]
        return signals._replace(acceleration_ref=position, turning_ref=du[..., AXES:] if du.shape[-1] > AXES else None)

    def preview(self, state: Any, signals: QuadrotorInput) -> dict[str, Array]:
        """`e_q` and `e_w`, the errors of the attitude loop (rad, rad/s, body axes)."""
        e_q, e_w = attitude_errors(self.gains, state, signals)
        return {"e_q": e_q, "e_w": e_w}

    @property
    def code(self) -> tuple[Any, ...]:
        gains = self.gains.position.__class__, self.gains.attitude.__class__
        return self._position.start, self._position.step, self._attitude.start, self._attitude.step, *gains

    def law(self) -> tuple[str, float]:
        return self.name, self._period

    def start(self, signals: QuadrotorInput) -> LawState:
        return cascade_init(self._position, self._attitude, self.gains, signals, self._period)

    def step(self, state: Any, signals: QuadrotorInput, observation: Array) -> tuple[Array, LawState]:
        return cascade(self._position, self._attitude, self.gains, state, signals, self._period)

    def internals(self, state: Any) -> dict[str, Array]:
        """Return the internal signals of both loops.

        Signals of each loop's law (sigma, s, beta, c, ...) carry the suffix `_p` (position) or `_q`
        (attitude); `force_command` (..., 3), tau_p (N, world axes).
        """
        memory: CascadeState = state
        named = {
            f"{name}_{suffix}": value
            for loop, suffix in LOOPS.items()
            for name, value in flatten(getattr(memory, loop)).items()
        }
        named["force_command"] = memory.force
        return named

    def diagnostics(self, state: Any) -> dict[str, Array]:
        """Return the internals and `attitude_error` (..., 3): desired minus actual roll, pitch, yaw (rad)."""
        memory: CascadeState = state
        error = _roll_pitch_yaw(memory.axes_ref) - _roll_pitch_yaw(memory.axes)
        wrapped = np.asarray(np.remainder(error + np.pi, 2 * np.pi) - np.pi)
        return {**self.internals(state), "attitude_error": wrapped}


def _roll_pitch_yaw(axes: Axes) -> Array:
    """ZYX Euler angles (..., 3) (rad) of a body's axes."""
    x, y, z = axes
    pitch = -np.arcsin(np.minimum(np.maximum(x[2], -1.0), 1.0))
    return joined((np.arctan2(y[2], z[2]), pitch, np.arctan2(x[1], x[0])))


LOOP_LAWS: dict[str, tuple[LawSpec, LawSpec]] = {
    "pid": (LAWS["positional-pid"], LAWS["positional-pid"]),
    "geometric": (LAWS["positional-pid"], LAWS["rigid-attitude"]),
}
"""Name -> the law of the position and the law of the attitude, where these are not the one law of that name."""


def loop_laws(name: str) -> tuple[LawSpec, LawSpec]:
    """Return the laws of position and attitude that belong to a name.

    Raises:
        UnknownNameError: if there are none.
    """
    return LOOP_LAWS[name] if name in LOOP_LAWS else (find_law(name), find_law(name))


def make_quadrotor(env: Any, *, law: str, preset: str | None = None, **gains: Any) -> QuadrotorPolicy:
    """Make the policy of a law for a quadrotor's environment, at preset gains with some replaced.

    Args:
        env: the environment that it will drive.
        law: name of the law.
        preset: name of its gains; None for the law's default.
        gains: in place of the preset's; `k_p_p` is the position loop's k_p, `k_p_q` the attitude loop's.

    Raises:
        UnknownNameError: for a law that the quadrotor does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
    """
    interface = ControlInterface.of(env)
    return QuadrotorPolicy(law, interface, preset_gains(interface.robot, law, preset, AXES, gains))
