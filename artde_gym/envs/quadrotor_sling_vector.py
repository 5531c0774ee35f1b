"""`QuadSling-Payload-v0`, many vehicles at once in NumPy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.envs.documentation import filled
from artde_gym.envs.quadrotor_batch_sim import QuadrotorBatchSim
from artde_gym.envs.quadrotor_vector import QuadInfinityPayloadVectorEnv, square
from artde_gym.envs.vector import Mask
from artde_gym.info import Columns
from artde_gym.robots.q450 import sling, task


@filled(shared=sling.DOCUMENTATION)
class QuadSlingPayloadVectorEnv(QuadInfinityPayloadVectorEnv):
    """Many quadrotors at once fly an infinity-shaped path with a payload on a cable, and release it half-way.

    ## Description
    The task of `artde_gym.envs.quadrotor_sling`, for `gym.make_vec(..., vectorization_mode="vector_entry_point")`: same
    layouts, disturbances, seeds and winds, with rigid bodies in NumPy in place of an engine, and the same cable.

    Ends of flights, memory layout and bits are those of the vector of `QuadInfinity-Payload-v0`.

    {shared}
    | `num_envs` | 1 | from 1 | number of vehicles |
    | `dtype` | "float64" | "float64", "float32" | of all numbers, observations and actions included |
    | `engine` | None | None, "numpy" | where it runs; None warns that it is not the engine of `gym.make` |
    | `autoreset_mode` | "NextStep" | "NextStep", "SameStep", "Disabled" | Gymnasium's `AutoresetMode` |
    | `max_episode_steps` | None | from 1 | after which a flight is truncated, if its duration is longer |
    | `render_mode` | None | None | `vectorization_mode="sync"` draws pictures |

    ## Info
    That of the single environment, each entry `x` with a mask `_x` (n,), in nested dictionaries too: numbers and
    booleans (n,), arrays (n, ...). `env.unwrapped.sampled_disturbances` is a list.

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

    def _look(self, block: Array, fleet: QuadrotorBatchSim) -> None:
        block[sling.CABLE.start :] = 0.0
        if fleet.cables is not None:
            held = fleet.cables.held
            r, rate = fleet.cables.relative(fleet.bodies)
            np.copyto(block[sling.CABLE], r, where=held)
            np.copyto(block[sling.RATE], rate, where=held)
            block[sling.HELD] = held

    def _tell(self) -> Columns:
        told = {name: np.zeros(self.num_envs, self.dtype) for name in sling.TOLD[1:]}
        hangs = np.zeros(self.num_envs, np.bool_)
        for part, fleet in self._fleets:
            if fleet.cables is not None:
                (x, y, z), _ = fleet.cables.relative(fleet.bodies)
                hangs[part] = held = fleet.cables.held
                told["load_error"][part] = np.sqrt(square(self._load_error(part, fleet)))
                told["swing"][part] = np.where(held, np.arctan2(np.sqrt(x * x + y * y), -z), 0.0)
                told["cable_impulse"][part] = fleet.pulled
        return {"load_hangs": hangs, **told}

    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        terms, falls = super()._score(truth)
        terms |= {name: np.empty(self.num_envs, self.dtype) for name in ("load", "swing")}
        touches = np.zeros(self.num_envs, np.bool_)
        for part, fleet in self._fleets:
            steepness, error = np.ones_like(fleet.pulled), np.zeros_like(fleet.pulled)
            if fleet.cables is not None:
                held, r = fleet.cables.held, truth.T[sling.CABLE, part]
                np.divide(-r[2], np.sqrt(square(r)), out=steepness, where=held & r.any(axis=0))
                error = square(self._load_error(part, fleet))
                touches[part] = held & sling.low(fleet.cables.position[2])
            for name, values in sling.load_terms(error, steepness, np.exp).items():
                terms[name][part] = values
        return terms, [*falls, touches]

    def _load_error(self, part: slice, fleet: QuadrotorBatchSim) -> Array:
        assert fleet.cables is not None
        reference = self._plan[: task.POSITION.stop - task.POSITION.start].take(self._k[part], axis=1)
        return fleet.cables.load_error(reference)
