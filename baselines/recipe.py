"""What a residual is, as data: everything but its network that an agent needs to be run again."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from artde_gym.arguments import flag, number
from artde_gym.errors import OptionError, among

HOLDS = {"ojas": 0.02, "q450": 0.015}
"""Default time between two decisions (s), by robot."""
CHANNELS = {"ojas": ("synergies", "wide-synergies", "joints"), "q450": ("attitude", "position", "cascade")}
"""What an action may mean, by robot; the first one is the default."""
NO_BASE = "none"
LONGEST = 10.0  # s, of a hold
LARGEST = 1e6  # of a limit


@dataclasses.dataclass(frozen=True)
class Recipe:
    """A base controller, and what an agent's action in [-1, 1]^n does on top of it.

    Attributes:
        robot: by the environment's `robot_name`.
        base: registered name of the base controller; "none", and the action is the force itself.
        gains: in place of the base's preset's.
        channel: "synergies" of the legs, "wide-synergies" or raw "joints" (biped), the "attitude" loop, the "position"
            loop or both, the "cascade" (quadrotor); see the robots' modules.
        hold: time between two decisions (s), a whole number of control periods.
        limit: largest size of each component of du (rad/s^2, m/s^2); that of the attitude loop is `TURNING` times it.
        gated: whether the residual fades in by tilt and velocity error (biped), or is there all the time.

    Raises:
        OptionError: for a value that is not allowed.
    """

    robot: str
    base: str = "tde"
    gains: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    channel: str = ""
    hold: float = 0.0
    limit: float = 0.0
    gated: bool = True

    def __post_init__(self) -> None:
        if not (isinstance(self.robot, str) and self.robot in CHANNELS):
            raise OptionError("robot", self.robot, among(self.robot, CHANNELS))
        known = CHANNELS[self.robot]
        if self.channel not in ("", *known):
            raise OptionError("channel", self.channel, among(self.channel, known))
        if not isinstance(self.base, str):
            raise OptionError("base", self.base, "a name")
        if not (isinstance(self.gains, Mapping) and all(isinstance(name, str) for name in self.gains)):
            raise OptionError("gains", self.gains, "a mapping of names to values")
        channel = self.channel or known[0]
        object.__setattr__(self, "channel", channel)
        for field, default, most in (("hold", HOLDS[self.robot], LONGEST), ("limit", LIMITS[channel], LARGEST)):
            value = number(field, getattr(self, field), 0.0, most, f"a number > 0, up to {most:g}; 0 for the default")
            object.__setattr__(self, field, value or default)
        object.__setattr__(self, "gated", flag("gated", self.gated))

    def periods(self, control_period: float) -> int:
        """Control periods (of so many s) between two decisions.

        Raises:
            OptionError: unless it is a whole number.
        """
        periods = round(self.hold / control_period)
        if periods < 1 or not math.isclose(periods * control_period, self.hold, rel_tol=1e-9):
            raise OptionError("hold", self.hold, f"whole multiples of the control period {control_period:g} s")
        return periods


LIMITS = {"synergies": 250.0, "wide-synergies": 250.0, "joints": 25.0, "attitude": 0.5, "cascade": 0.5, "position": 0.5}
"""Default limit of du, by channel (rad/s^2, m/s^2). Synergies are bounded by their ranges long before."""
