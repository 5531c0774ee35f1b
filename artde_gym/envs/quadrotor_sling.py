"""`QuadSling-Payload-v0`, one vehicle in a physics engine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from artde_gym.arrays import Array
from artde_gym.envs.documentation import filled
from artde_gym.envs.quadrotor import QuadInfinityPayloadEnv
from artde_gym.robots.q450 import sling
from artde_gym.sim.cable import dot


@filled(shared=sling.DOCUMENTATION)
class QuadSlingPayloadEnv(QuadInfinityPayloadEnv):
    """A quadrotor flies an infinity-shaped path with a payload on a cable, releases it half-way, and flies on.

    ## Description
    Future work of the thesis (Dantu 2023, chapter 7): the payload hangs on a cable, and its swing has no
    actuator of its own. The cable is massless, does not stretch and goes slack; see `artde_gym.sim.cable`. The law that
    damps the swing is `controllers.laws.swing`. `gym.make_vec` with `vectorization_mode="vector_entry_point"` gives
    thousands of them in NumPy (`artde_gym.envs.quadrotor_sling_vector`).

    {shared}
    | `engine` | None | "bullet", "mujoco", None | physics engine; None: Bullet where it can be imported, else MuJoCo |
    | `width`, `height` | 640, 480 | 16 to 4096 | pixels of a picture |

    Pictures, reset options and the beginning of `info` are those of `QuadInfinity-Payload-v0`.

    The cable is observed as it is; `sensor_noise` disturbs it by `position` and its rate by `velocity`, and
    `cable_delay` makes both late.

    ## Info
    As in `QuadInfinity-Payload-v0`, with `reward_load` and `reward_swing`, `fell_load`, and what is true of the load:
    `load_hangs` (true or false), `load_error` (m, its distance from where it is meant to be), `swing` (rad, the cable's
    angle from the vertical) and `cable_impulse` (N s, over the last control period); zeros while nothing hangs.

    ## Versions
    * v0: first version.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    observation_layout = sling.OBSERVATION
    metrics_spec = sling.METRICS_SPEC
    fall_reasons: ClassVar[Sequence[str]] = sling.FALL_REASONS
    reward_scales = sling.REWARD_SCALES
    default_disturbances = sling.DEFAULT_DISTURBANCES
    lift = sling.LIFT

    def _look(self, observation: Array) -> None:
        observation[sling.CABLE], observation[sling.RATE] = self._sling.cable(self._state)
        observation[sling.HELD] = self._sling.held

    def _info(self, terms: dict[str, float], falls: Sequence[bool], events: Sequence[str]) -> dict[str, Any]:
        told = super()._info(terms, falls, events)
        r, _ = self._sling.cable(self._state)
        x, y, z = self._load_error()
        told["load_hangs"], told["load_error"] = self._sling.held, math.hypot(x, y, z)
        told["swing"] = math.atan2(math.hypot(r[0], r[1]), -r[2]) if self._sling.held else 0.0
        told["cable_impulse"] = self._pulled
        return told

    def _reward_terms(self) -> dict[str, float]:
        r, _ = self._sling.cable(self._state)
        error = self._load_error()
        steepness = -r[2] / max(math.hypot(*r), 1e-12) if self._sling.held else 1.0
        return super()._reward_terms() | sling.load_terms(dot(error, error), steepness, math.exp)

    def _falls(self) -> tuple[bool, ...]:
        load = self._sling.payload_position() if self._sling.held else None
        return *super()._falls(), load is not None and sling.low(load[2])

    def _load_error(self) -> tuple[float, float, float]:
        x, y, z = self._plan[self._k, :3].tolist()
        return self._sling.load_error((x, y, z))
