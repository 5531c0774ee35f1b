"""An agent on the quadrotor: it adds to the accelerations that the two loops of a cascade ask for.

Channel "attitude": du_q = TURNING limit x [roll, pitch, yaw] (rad/s^2, body axes) in the attitude loop, which at the
thesis' gains is the slow one. Channel "position": du_p = limit x [x, y, z] (m/s^2, world axes) in the position loop,
which alone has little to gain without a cable. Channel "cascade": both.

In an environment with a cable the agent sees it and the load's errors, and is rewarded for these in place of the
vehicle's. In the channel "position" the attitude's cost nothing there: what moves a load is the vehicle's lean.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from artde_gym.layout import Field, Layout
from artde_gym.robots.q450 import sling, task
from artde_gym.robots.q450.model import q450
from baselines.agent import Agent
from baselines.q450_tasks import TASKS
from baselines.residual_config import NO_BASE, ResidualConfig
from controllers.laws.tracking import Array, sliding_variable
from controllers.policies import ControlInterface

AXES = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")
TURNING = 5.0  # limit of the attitude's du over the position's (rad/m)
PASSED_ON = (
    "rot_body_to_world",
    "body_rates",
    "acceleration_ref",
    "jerk_ref",
    "wrench_applied",
    "rotor_thrust",
    "cable",
    "cable_rate",
    "cable_held",
)
"""Fields of the observation that the agent sees as they are."""
SCALES = {"position": 0.02, "velocity": 0.05, "attitude": 0.01, "turning": 0.1}  # m, m/s, rad, rad/s
"""Errors that cost a unit of reward. What answers soonest to an action weighs most: most of the position's error is the
wind's doing, and in that noise an action of 15 ms is not to be found."""
WORST = 10.0  # units
REWARD_SCALES = {
    "alive": 1.0,
    "position": -0.25,
    "velocity": -0.25,
    "attitude": -1.0,
    "turning": -0.5,
    "residual": -0.01,
    "fall": -100.0,
}
LOAD_REWARD_SCALES = REWARD_SCALES | {"position": -0.5, "velocity": -0.1, "attitude": 0.0, "turning": 0.0}


class Q450AdapterState(NamedTuple):
    """The action that acts (..., n), and the attitude's errors e_q and e_w (..., 3)."""

    action: Array
    e_q: Array
    e_w: Array


class Q450Adapter:
    """The adapter at the top; without a base, the action is the wrench.

    Args:
        interface: of the environment.
        config: of the residual.
        gains: of the base's position loop, for s; None without one.
    """

    def __init__(self, interface: ControlInterface, config: ResidualConfig, gains: Any) -> None:
        torque = config.base == NO_BASE
        self.actions: tuple[str, ...]
        if torque:
            self.actions = ("u1", "u2", "u3", "u4")
            box = interface.action.box()
            self._limit = (box.high - box.low) / 2
        elif config.action_mode == "position":
            self.actions = AXES
            self._limit = np.full(3, config.action_scale)
        else:
            whole = config.action_mode == "cascade"
            self.actions = AXES + TURNS if whole else TURNS
            self._limit = config.action_scale * np.repeat([1.0, TURNING] if whole else [TURNING], 3)
        self._attitude_alone = config.action_mode == "attitude" and not torque
        loop: Any = getattr(gains, "position", None)
        self._gains = (loop.k_p, loop.k_d) if hasattr(loop, "k_p") else None
        self._at = interface.observation.slices
        self._slung = "cable" in self._at
        lean = self._slung and self.actions == AXES
        self.reward_scales: Mapping[str, float] = LOAD_REWARD_SCALES if lean else REWARD_SCALES
        load = (
            Field("load_e", 3, "m", -1.0, 1.0, "of the load, or of the vehicle once it is gone"),
            Field("load_ed", 3, "m/s", -10.0, 10.0, "of the same"),
        )
        own = [field for field in interface.observation.fields if field.name in PASSED_ON]
        self.features = Layout(
            (
                Field("e", 3, "m", -1.0, 1.0, "position_ref - position"),
                Field("ed", 3, "m/s", -10.0, 10.0, "velocity_ref - velocity"),
                Field("s", 3, "m", -10.0, 10.0, "the base's sliding variable"),
                Field("sigma_p", 3, "m/s^2", -100.0, 100.0, "TDE error of the position loop, a sample ago"),
                Field("sigma_q", 3, "rad/s^2", -1e3, 1e3, "TDE error of the attitude loop, a sample ago"),
                Field("e_q", 3, "rad", -1.0, 1.0, "attitude error of the cascade, body axes"),
                Field("e_w", 3, "rad/s", -30.0, 30.0, "its rate"),
                Field("force_command", 3, "N", -100.0, 100.0, "of the position loop, a sample ago, world axes"),
                Field("c", 1, "m/s^2", 0.0, 100.0, "gain of the position loop's robust term"),
                *own,
                *(load if self._slung else ()),
                Field("action", len(self.actions), "1", -1.0, 1.0, "of the agent, a decision ago"),
            )
        )
        self._own = [self._at[field.name] for field in own]

    def start(self, observation: Array) -> Q450AdapterState:
        nothing = np.zeros((*observation.shape[:-1], 3), observation.dtype)
        return Q450AdapterState(np.zeros((*nothing.shape[:-1], len(self.actions)), observation.dtype), nothing, nothing)

    def observe(
        self, observation: Array, inside: Mapping[str, Array], state: Q450AdapterState
    ) -> tuple[Array, Q450AdapterState]:
        e, ed = self._errors(observation)
        nothing = np.zeros(e.shape, e.dtype)
        s = nothing if self._gains is None else sliding_variable(e, ed, *self._gains)
        e_q, e_w, c = inside.get("e_q", nothing), inside.get("e_w", nothing), inside.get("c_p")
        parts = [
            e,
            ed,
            s,
            inside.get("sigma_p", nothing),
            inside.get("sigma_q", nothing),
            e_q,
            e_w,
            inside.get("force_command", nothing),
            nothing[..., :1] if c is None else c[..., None],
            *(observation[..., part] for part in self._own),
            *(self._goal_errors(observation) if self._slung else ()),
            state.action,
        ]
        return np.concatenate(parts, axis=-1, dtype=observation.dtype), state._replace(e_q=e_q, e_w=e_w)

    def set_action(self, state: Q450AdapterState, action: Array) -> Q450AdapterState:
        return state._replace(action=np.minimum(np.maximum(action, -1.0), 1.0).astype(state.action.dtype))

    def next_residual(self, state: Q450AdapterState) -> tuple[Array, Q450AdapterState]:
        du = (self._limit * state.action).astype(state.action.dtype, copy=False)
        return (np.concatenate([np.zeros(du.shape, du.dtype), du], axis=-1) if self._attitude_alone else du), state

    def reward_terms(self, observation: Array, state: Q450AdapterState, fell: Any) -> dict[str, Array]:
        e, ed = self._goal_errors(observation)
        action = state.action
        errors = dict(zip(SCALES, (e, ed, state.e_q, state.e_w), strict=True))
        return {
            "alive": np.ones(observation.shape[:-1]),
            **{name: np.minimum(np.sqrt(np.vecdot(v, v)) / SCALES[name], WORST) for name, v in errors.items()},
            "residual": np.vecdot(action, action),
            "fall": np.asarray(fell, dtype=np.float64),
        }

    def _errors(self, observation: Array) -> tuple[Array, Array]:
        at = self._at
        return (
            observation[..., at["position_ref"]] - observation[..., at["position"]],
            observation[..., at["velocity_ref"]] - observation[..., at["velocity"]],
        )

    def _goal_errors(self, observation: Array) -> tuple[Array, Array]:
        """Return e and ed of the load where one hangs, but for the hook's place, else of the vehicle."""
        e, ed = self._errors(observation)
        if not self._slung:
            return e, ed
        r, rate = observation[..., self._at["cable"]], observation[..., self._at["cable_rate"]]
        length = np.sqrt(np.vecdot(r, r))[..., None]
        return e - r - length * np.array([0.0, 0.0, 1.0], e.dtype), ed - rate


AGENT = Agent(
    robot="q450",
    adapter=Q450Adapter,
    action_modes={"attitude": 0.5, "position": 0.5, "cascade": 0.5},
    decision_period=0.015,
    tasks=TASKS,
    observation=task.OBSERVATION,
    observations={"QuadSling-Payload-v0": sling.OBSERVATION},
    action=task.ACTION,
    nominal={"q450": q450},
)
