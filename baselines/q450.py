"""An agent on the quadrotor: it adds to the accelerations that the two loops of a cascade ask for.

Channel "cascade": du_p = limit x [x, y, z] (m/s^2, world axes) in the position loop, and
du_q = TURNING limit x [roll, pitch, yaw] (rad/s^2, body axes) in the attitude loop. Channel "position": du_p alone. At
the thesis' gains the attitude loop is the slow one, and a residual that cannot quicken it has little to gain.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from artde_gym.layout import Field, Layout
from baselines.recipe import NO_BASE, Recipe
from controllers.laws.tracking import Array, sliding_variable
from controllers.policies import Plant

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
)
"""Fields of the observation that the agent sees as they are."""
NEAR = 0.02  # m, an error that costs one unit of reward


class Q450Memory(NamedTuple):
    """The action that acts (..., n)."""

    action: Array


class Q450Coupling:
    """The coupling at the top; without a base, the action is the wrench.

    Args:
        plant: of the environment.
        recipe: of the residual.
        gains: of the base's position loop, for s; None without one.
    """

    reward_scales: ClassVar[Mapping[str, float]] = {"alive": 1.0, "position": -1.0, "residual": -0.01, "fall": -200.0}

    def __init__(self, plant: Plant, recipe: Recipe, gains: Any) -> None:
        torque = recipe.base == NO_BASE
        if torque:
            self.actions = ("u1", "u2", "u3", "u4")
            box = plant.action.box()
            self._limit = (box.high - box.low) / 2
        elif recipe.channel == "position":
            self.actions = AXES
            self._limit = np.full(3, recipe.limit)
        else:
            self.actions = AXES + TURNS
            self._limit = recipe.limit * np.repeat([1.0, TURNING], 3)
        loop = getattr(gains, "position", None)
        self._gains = (loop.k_p, loop.k_d) if hasattr(loop, "k_p") else None
        self._at = plant.observation.slices
        own = [field for field in plant.observation.fields if field.name in PASSED_ON]
        self.features = Layout(
            (
                Field("e", 3, "m", -1.0, 1.0, "position_ref - position"),
                Field("ed", 3, "m/s", -10.0, 10.0, "velocity_ref - velocity"),
                Field("s", 3, "m", -10.0, 10.0, "the base's sliding variable"),
                Field("sigma_p", 3, "m/s^2", -100.0, 100.0, "TDE error of the position loop, a sample ago"),
                Field("sigma_q", 3, "rad/s^2", -1e3, 1e3, "TDE error of the attitude loop, a sample ago"),
                Field("attitude_error", 3, "rad", -4.0, 4.0, "desired minus actual roll, pitch, yaw, a sample ago"),
                Field("force_command", 3, "N", -100.0, 100.0, "of the position loop, a sample ago, world axes"),
                Field("c", 1, "m/s^2", 0.0, 100.0, "gain of the position loop's robust term"),
                *own,
                Field("action", len(self.actions), "1", -1.0, 1.0, "of the agent, a decision ago"),
            )
        )
        self._own = [self._at[field.name] for field in own]

    def start(self, observation: Array) -> Q450Memory:
        return Q450Memory(np.zeros((*observation.shape[:-1], len(self.actions)), observation.dtype))

    def observe(
        self, observation: Array, inside: Mapping[str, Array], memory: Q450Memory
    ) -> tuple[Array, Q450Memory]:
        at = self._at
        e, ed = self._errors(observation)
        nothing = np.zeros_like(e)
        s = nothing if self._gains is None else sliding_variable(e, ed, *self._gains)
        c = inside.get("c_p")
        parts = [
            e,
            ed,
            s,
            inside.get("sigma_p", nothing),
            inside.get("sigma_q", nothing),
            inside.get("attitude_error", nothing),
            inside.get("force_command", nothing),
            nothing[..., :1] if c is None else c[..., None],
            *(observation[..., part] for part in self._own),
            memory.action,
        ]
        return np.concatenate(parts, axis=-1, dtype=observation.dtype), memory

    def decide(self, memory: Q450Memory, action: Array) -> Q450Memory:
        return Q450Memory(np.minimum(np.maximum(action, -1.0), 1.0).astype(memory.action.dtype))

    def advance(self, memory: Q450Memory) -> tuple[Array, Q450Memory]:
        return (self._limit * memory.action).astype(memory.action.dtype, copy=False), memory

    def reward_terms(self, observation: Array, action: Array, fell: Any) -> dict[str, Array]:
        e, _ = self._errors(observation)
        return {
            "alive": np.ones(observation.shape[:-1]),
            "position": np.minimum(np.vecdot(e, e) / NEAR**2, 4.0),
            "residual": np.vecdot(action, action),
            "fall": np.asarray(fell, dtype=np.float64),
        }

    def _errors(self, observation: Array) -> tuple[Array, Array]:
        at = self._at
        return (
            observation[..., at["position_ref"]] - observation[..., at["position"]],
            observation[..., at["velocity_ref"]] - observation[..., at["velocity"]],
        )
