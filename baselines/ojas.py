"""An agent on the biped: it shifts feet, body and ankles, and sees and acts as if it always stood on the left leg.

While the right leg carries the robot, observation and action go through a mirror, so that one network serves both.

Channels "synergies" and "wide-synergies": the action moves, within `RANGES`, the swinging foot, the body over both
feet, the ankles and the lean. Through the inverse kinematics of the legs this is an offset r of the reference joints,
which a critically damped filter of `FILTER_RATE` turns into a smooth one; an offset of the reference is an acceleration
in the slot of du,

    du = r.. + Kd r. + Kp r,    r.. = (r._k+1 - r._k) / L

The offset of the swinging foot is latched when it is planned to land, and lasts until that foot swings again: a foot on
the ground cannot be moved, only the body would be. Channel "joints": du = limit x action, held.

With `gated`, ranges are multiplied by a gate in [0, 1] that opens by the base's tilt or by its velocity error and
closes slowly: nominal walking is the base controller's own.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from artde_gym.layout import Field, Layout
from artde_gym.robots.ojas import task
from artde_gym.robots.ojas.model import ActuatorInertia, ojas
from baselines.agent import JOINTS as ON_JOINTS
from baselines.agent import Agent
from baselines.legs import JOINTS, LEG, Mirror, ankle, joint_offsets, level, mirrored_joints
from baselines.ojas_tasks import TASKS
from baselines.residual_config import NO_BASE, ResidualConfig
from controllers.laws.second_order import FilterState, second_order
from controllers.laws.tracking import Array, sliding_variable
from controllers.policies import ControlInterface

RANGES: dict[str, dict[str, float]] = {
    "swing_x": {"synergies": 0.10, "wide-synergies": 0.15},  # m, of the swinging foot, forward
    "swing_out": {"synergies": 0.06, "wide-synergies": 0.10},  # m, away from the standing leg
    "swing_z": {"synergies": 0.03, "wide-synergies": 0.03},  # m, up
    "body_x": {"synergies": 0.04, "wide-synergies": 0.06},  # m, of the body over both feet, forward
    "body_y": {"synergies": 0.03, "wide-synergies": 0.06},  # m, to the left
    "stance_pitch": {"synergies": 0.2, "wide-synergies": 0.2},  # rad, of the standing leg's ankle
    "stance_roll": {"synergies": 0.15, "wide-synergies": 0.2},  # rad
    "swing_pitch": {"synergies": 0.15, "wide-synergies": 0.15},  # rad, of the swinging leg's ankle
    "swing_roll": {"synergies": 0.15, "wide-synergies": 0.15},  # rad
    "lean_pitch": {"synergies": 0.15, "wide-synergies": 0.4},  # rad, of both hips
    "lean_roll": {"synergies": 0.1, "wide-synergies": 0.3},  # rad
}
"""What a component of the action is, in the mirror, and its largest size by channel."""
FILTER_RATE = 25.0  # rad/s
K_P, K_D = 25.0, 10.0  # of the error dynamics that the thesis asks for
OPENS_TILT = (0.03, 0.08)  # rad, where the gate begins to open, and where it is open; a walk without pushes: 0.016
OPENS_SPEED = (0.08, 0.16)  # m/s, as above; a walk without pushes: 0.055
CLOSING = 0.5  # s, time constant of the closing gate
DIFFERENCE = 1e-4  # s, of the reference velocity's difference quotient


class OjasAdapterState(NamedTuple):
    """State of the adapter between decisions.

    Attributes:
        right: whether the right leg carries (...).
        single: whether one leg alone is planned to (...).
        gate: (...).
        drift: squared horizontal velocity error (...) (m^2/s^2).
        ankles: of the reference, standing and swinging leg, in the mirror (..., 2, 3) (m).
        offsets: of feet on the ground or in the air: standing x, y, swinging x, y, in the mirror (..., 4) (m).
        action: in the mirror (..., n).
        target: of the joints, not in the mirror (..., 12): an offset (rad), or du itself with channel "joints".
        filter: of it.
    """

    right: NDArray[np.bool_]
    single: NDArray[np.bool_]
    gate: Array
    drift: Array
    ankles: Array
    offsets: Array
    action: Array
    target: Array
    filter: FilterState


class OjasAdapter:
    """The adapter at the top.

    Args:
        interface: of the environment.
        config: of the residual.
        gains: of the base, for s; None without one.
    """

    reward_scales: Mapping[str, float] = {
        "alive": 1.0,
        "upright": 0.5,
        "velocity": 0.5,
        "tracking": 0.5,
        "residual": -0.01,
        "fall": -20.0,
    }

    def __init__(self, interface: ControlInterface, config: ResidualConfig, gains: Any) -> None:
        torque = config.base == NO_BASE
        self._synergies = config.action_mode != "joints" and not torque
        self._sizes = (
            np.array([sizes[config.action_mode] for sizes in RANGES.values()]) if self._synergies else np.ones(1)
        )
        self._limit = float(interface.action.box().high[0]) if torque else config.action_scale
        self._gated = config.gated and not torque
        self._period = interface.control_period
        self._hold = config.decision_period
        self._gains = (gains.k_p, gains.k_d) if hasattr(gains, "k_p") else None
        self._mirror = Mirror(interface.observation)
        self._at = interface.observation.slices
        self.actions: tuple[str, ...] = tuple(RANGES) if self._synergies else tuple(f"q{i + 1}" for i in range(JOINTS))
        self.features = Layout(
            (
                Field("tilt", 2, "rad", -1.0, 1.0, "roll and pitch of the base"),
                Field("angular_velocity", 3, "rad/s", -20.0, 20.0, "of the base"),
                Field("velocity_error", 3, "m/s", -5.0, 5.0, "of the base, actual minus reference"),
                Field("displacement", 3, "m", -1.0, 1.0, "of the base over the standing foot, in the same axes"),
                Field("contact", 2, "1", 0.0, 1.0, "of the standing and the swinging foot"),
                Field("load_ref", 1, "1", 0.0, 1.0, "share of the weight meant for the standing foot"),
                Field("progress", 1, "1", 0.0, 1.0, "within the step"),
                Field("offsets", 4, "m", -0.2, 0.2, "x, y of the standing and the swinging foot that are latched"),
                Field("gate", 1, "1", 0.0, 1.0, "of the residual"),
                Field("e", JOINTS, "rad", -3.2, 3.2, "q_ref - q"),
                Field("ed", JOINTS, "rad/s", -50.0, 50.0, "qd_ref - qd"),
                Field("s", JOINTS, "rad", -5.0, 5.0, "the base's sliding variable"),
                Field("sigma", JOINTS, "rad/s^2", -1e4, 1e4, "TDE error, a sample ago"),
                Field("c", 1, "rad/s^2", 0.0, 1e3, "gain of the robust term"),
                Field("action", len(self.actions), "1", -1.0, 1.0, "of the agent, a decision ago"),
            )
        )

    def start(self, observation: Array) -> OjasAdapterState:
        lead, kind = observation.shape[:-1], observation.dtype
        no, nothing = np.zeros(lead, np.bool_), np.zeros((*lead, JOINTS), kind)
        return OjasAdapterState(
            no,
            no,
            np.zeros(lead, kind),
            np.zeros(lead, kind),
            np.zeros((*lead, 2, 3), kind),
            np.zeros((*lead, 4), kind),
            np.zeros((*lead, len(self.actions)), kind),
            nothing,
            FilterState(nothing, nothing),
        )

    def observe(
        self, observation: Array, inside: Mapping[str, Array], state: OjasAdapterState
    ) -> tuple[Array, OjasAdapterState]:
        at = self._at
        right = observation[..., at["load_left_ref"].start] < 0.5
        seen = np.where(right[..., None], self._mirror(observation), observation)
        q, q_ref, qd_ref = seen[..., at["q"]], seen[..., at["q_ref"]], seen[..., at["qd_ref"]]
        e, ed = q_ref - q, qd_ref - seen[..., at["qd"]]
        ahead = DIFFERENCE * qd_ref[..., :LEG]
        standing = q_ref[..., :LEG]
        legs = np.stack([standing, q_ref[..., LEG:], q[..., :LEG], standing + ahead, standing - ahead], axis=-2)
        ankles = ankle(legs)
        tilt = seen[..., at["tilt"]]
        velocity_ref = (ankles[..., 4, :] - ankles[..., 3, :]) / (2 * DIFFERENCE)
        velocity_error = seen[..., at["base_velocity"]] - velocity_ref
        displacement = ankles[..., 0, :] - level(tilt, ankles[..., 2, :])
        sideways = velocity_error[..., :2]
        drift = np.vecdot(sideways, sideways)
        gate = self._gate(tilt, drift, state.gate)
        load = seen[..., at["load_left_ref"]]
        changed = right != state.right
        offsets, action = state.offsets, state.action
        if changed.any():
            offsets = np.where(changed[..., None], _swapped(offsets), offsets)
        s = np.zeros_like(e) if self._gains is None else sliding_variable(e, ed, *self._gains)
        sigma = inside.get("sigma")
        if sigma is None:
            sigma = np.zeros_like(e)
        elif right.any():
            sigma = np.where(right[..., None], mirrored_joints(sigma), sigma)
        c = inside.get("c")
        parts = [
            tilt,
            seen[..., at["base_angular_velocity"]],
            velocity_error,
            displacement,
            seen[..., at["contact"]],
            load,
            np.remainder(2.0 * seen[..., at["phase"]], 1.0),
            offsets,
            gate[..., None],
            e,
            ed,
            s,
            sigma,
            np.zeros_like(load) if c is None else c[..., None],
            action,
        ]
        kept = state._replace(
            right=right,
            single=load[..., 0] > _SINGLE,
            gate=gate,
            drift=drift,
            ankles=ankles[..., :2, :],
            offsets=offsets,
        )
        return np.concatenate(parts, axis=-1, dtype=observation.dtype), kept

    def set_action(self, state: OjasAdapterState, action: Array) -> OjasAdapterState:
        action = np.minimum(np.maximum(action, -1.0), 1.0).astype(state.action.dtype)
        scaled = state.gate[..., None] * action
        if not self._synergies:
            target = self._limit * scaled
            return state._replace(action=action, target=_unmirrored(state.right, target))
        wanted = scaled * self._sizes
        offsets = state.offsets
        in_air = np.stack([wanted[..., 0], -wanted[..., 1]], axis=-1)
        flying = np.where(state.single[..., None], in_air, offsets[..., 2:])
        offsets = np.concatenate([offsets[..., :2], flying], axis=-1)
        feet = np.zeros((*state.ankles.shape[:-1], 3), action.dtype)
        feet[..., 0, :2], feet[..., 1, :2] = offsets[..., :2], offsets[..., 2:]
        feet[..., :2] -= wanted[..., None, 3:5]
        feet[..., 1, 2] = wanted[..., 2]
        joints = joint_offsets(state.ankles, feet)
        joints[..., 4:] += wanted[..., 5:9].reshape(*wanted.shape[:-1], 2, 2)
        joints[..., 2] += wanted[..., None, 9]
        joints[..., 1] += wanted[..., None, 10]
        target = joints.reshape(*wanted.shape[:-1], JOINTS)
        return state._replace(offsets=offsets, action=action, target=_unmirrored(state.right, target))

    def next_residual(self, state: OjasAdapterState) -> tuple[Array, OjasAdapterState]:
        if not self._synergies:
            return state.target, state
        before = state.filter
        after = second_order(before, state.target, FILTER_RATE, 1.0, self._period)
        du = (after.rate - before.rate) / self._period + K_D * before.rate + K_P * before.value
        return np.minimum(np.maximum(du, -self._limit), self._limit), state._replace(filter=after)

    def reward_terms(self, observation: Array, state: OjasAdapterState, fell: Any) -> dict[str, Array]:
        at, action = self._at, state.action
        tilt = observation[..., at["tilt"]]
        e = observation[..., at["q_ref"]] - observation[..., at["q"]]
        return {
            "alive": np.ones(observation.shape[:-1]),
            "upright": np.exp(-np.vecdot(tilt, tilt) / 0.02),
            "velocity": np.exp(-state.drift / 0.1),
            "tracking": np.exp(-np.vecdot(e, e) / 0.02),
            "residual": state.gate * np.vecdot(action, action),
            "fall": np.asarray(fell, dtype=np.float64),
        }

    def _gate(self, tilt: Array, drift: Array, before: Array) -> Array:
        if not self._gated:
            return np.ones_like(before)
        by_tilt = _smooth(np.sqrt(np.vecdot(tilt, tilt)), *OPENS_TILT)
        by_speed = _smooth(np.sqrt(drift), *OPENS_SPEED)
        kept = before * np.exp(-self._hold / CLOSING)
        kept = np.where(kept > _CLOSED, kept, 0.0)
        return np.maximum(np.maximum(by_tilt, by_speed), kept).astype(before.dtype, copy=False)


_SINGLE = 1.0 - 1e-6
_CLOSED = 0.01


def _smooth(value: Array, low: float, high: float) -> Array:
    """From 0 at `low` to 1 at `high`, with zero slope at both."""
    u = np.minimum(np.maximum((value - low) / (high - low), 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)


def _swapped(offsets: Array) -> Array:
    """Offsets in the other mirror image: the legs change their roles, y its sign."""
    return offsets[..., [2, 3, 0, 1]] * np.array([1.0, -1.0, 1.0, -1.0])


def _unmirrored(right: NDArray[np.bool_], joints: Array) -> Array:
    return np.where(right[..., None], mirrored_joints(joints), joints) if right.any() else joints


def _nominal_name(kwargs: Mapping[str, Any]) -> str:
    return f"ojas {kwargs.get('actuator_inertia', 'rotor')}"


AGENT = Agent(
    robot="ojas",
    adapter=OjasAdapter,
    action_modes={"synergies": 250.0, "wide-synergies": 250.0, ON_JOINTS: 25.0},  # ranges bound synergies long before
    decision_period=0.02,
    tasks=TASKS,
    balanced=frozenset({"synergies", "wide-synergies"}),
    observation=task.OBSERVATION,
    action=task.ACTION,
    nominal={f"ojas {kind}": functools.partial(ojas, kind) for kind in get_args(ActuatorInertia)},
    nominal_name=_nominal_name,
)
