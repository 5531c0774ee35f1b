"""What a residual is, as data: everything but its network that an agent needs to be run again."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from artde_gym.arguments import flag, number
from artde_gym.errors import OptionError, among
from artde_gym.kit import ROBOTS
from baselines.agent import agent_of

NO_BASE = "none"
DECISION = 0.02  # s, about which a robot decides that has no default of its own
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
            loop or both, the "cascade" (quadrotor), "joints" of any other robot; see the robots' modules.
        hold: time between two decisions (s), a whole number of control periods; 0 for as many as come nearest to
            `DECISION`, where the robot has no default.
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
        if not (isinstance(self.robot, str) and self.robot in ROBOTS):
            raise OptionError("robot", self.robot, among(self.robot, ROBOTS))
        agent = agent_of(self.robot)
        known = list(agent.channels)
        if self.channel not in ("", *known):
            raise OptionError("channel", self.channel, among(self.channel, known))
        if not isinstance(self.base, str):
            raise OptionError("base", self.base, "a name")
        if not (isinstance(self.gains, Mapping) and all(isinstance(name, str) for name in self.gains)):
            raise OptionError("gains", self.gains, "a mapping of names to values")
        channel = self.channel or known[0]
        object.__setattr__(self, "channel", channel)
        for field, default, most in (("hold", agent.hold, LONGEST), ("limit", agent.channels[channel], LARGEST)):
            value = number(field, getattr(self, field), 0.0, most, f"a number > 0, up to {most:g}; 0 for the default")
            object.__setattr__(self, field, value or default)
        object.__setattr__(self, "gated", flag("gated", self.gated))

    def periods(self, control_period: float) -> int:
        """Control periods (of so many s) between two decisions.

        Raises:
            OptionError: unless it is a whole number.
        """
        if not self.hold:
            return max(1, round(DECISION / control_period))
        periods = round(self.hold / control_period)
        if periods < 1 or not math.isclose(periods * control_period, self.hold, rel_tol=1e-9):
            raise OptionError("hold", self.hold, f"whole multiples of the control period {control_period:g} s")
        return periods
