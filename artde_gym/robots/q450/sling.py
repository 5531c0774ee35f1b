"""Common parts of the single and the vectorized quadrotor with a payload on a cable.

The path is raised by `LIFT`, since it dips to 0.4 m. The load is meant to be where it would hang at rest under the
vehicle's reference: e = (position_ref + hook - (0, 0, length)) - load.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.layout import Field, Layout
from artde_gym.metrics_spec import Fields, WatchedSignal
from artde_gym.robots.q450 import task
from artde_gym.robots.q450.infinity import LIFT, LIFTED_FAN
from artde_gym.sim.engine import PAYLOAD_RADIUS

DEFAULT_DISTURBANCES: dict[str, Any] = {
    "payload": {"mass": 0.35, "cable": 0.5, "detach_time": 35.0},
    "wind": {"scale": 1.0, "fan_position": LIFTED_FAN},
}

OBSERVATION = Layout(
    (
        *task.OBSERVATION.fields,
        Field("cable", 3, "m", -10.0, 10.0, "load minus hook, world axes; zeros while nothing hangs"),
        Field(
            "cable_rate", 3, "m/s", -task.MAX_SPEED, task.MAX_SPEED, "its derivative, world axes; zeros without a cable"
        ),
        Field("cable_held", 1, "1", 0.0, 1.0, "1 while a load hangs on the cable, else 0"),
    )
)
CABLE, RATE, HELD = (OBSERVATION[name] for name in ("cable", "cable_rate", "cable_held"))

REWARD_SCALES: dict[str, float] = {**task.REWARD_SCALES, "load": 2.0, "swing": -1.0}
FALL_REASONS = (*task.FALL_REASONS, "load")
TOLD = ("load_hangs", "load_error", "swing", "cable_impulse")
"""Entries of `info` beyond those of the other environment."""

Number = TypeVar("Number", float, Array)


def _while_hanging(name: str) -> Callable[[Fields], Array]:
    return lambda fields: np.where(fields["load_hangs"] > 0.5, fields[name], np.nan)


METRICS_SPEC = dataclasses.replace(
    task.METRICS_SPEC,
    recorded_info=TOLD,
    watched=(
        WatchedSignal("swing", "deg", 180.0 / math.pi, _while_hanging("swing"), math.radians(3.0)),
        WatchedSignal("load_error", "m", 1.0, _while_hanging("load_error"), 0.05),
        WatchedSignal("cable_impulse", "ns", 1.0, _while_hanging("cable_impulse"), math.inf),
    ),
)
"""As for the other environment, and the load: 3 degrees of swing, or 5 cm, count as settled.

The fan's jet leans a cable by half of that.
"""


def load_terms(error: Number, steepness: Number, exp: Callable[[Number], Number]) -> dict[str, Number]:
    """Return the reward's terms of the load, elementwise.

    Args:
        error: squared norm of the load's error (m^2).
        steepness: cosine of the cable's angle from the vertical.
        exp: the exponential function for this kind of number.
    """
    return {"load": exp(-100.0 * error), "swing": 1.0 - steepness}


def low(height: Number) -> Any:
    """Tell whether a load at a height (m) has hit the ground, elementwise."""
    return height < PAYLOAD_RADIUS


DOCUMENTATION = task.documentation(
    OBSERVATION,
    reference=f"""The infinity-shaped path of `artde_gym.robots.q450.infinity`, {LIFT:g} m higher: loop 1 until 33 s,
rest until 37 s, loop 2 until 70 s; yaw 0. The load is meant to be where it would hang at rest under it.""",
    terms="""
| `load` | 2 | exp(-\\|e\\|^2 / 0.01), e = the load's error in m; 1 while nothing hangs |
| `swing` | -1 | 1 - cosine of the cable's angle from the vertical |""",
    perfect=420,
    end=" `fell_load`: the hanging load touches the ground.",
    disturbances="payload of 0.35 kg on a cable of 0.5 m until 35 s, wind",
)
