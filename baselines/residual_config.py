"""What a residual is, as data: everything but its network that an agent needs to be run again."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from artde_gym.arguments import check_bool, check_number
from artde_gym.deprecation import RESIDUAL, renamed_arguments
from artde_gym.errors import OptionError, suggest_names
from artde_gym.kit import ROBOTS
from baselines.agent import agent_of

NO_BASE = "none"
DECISION = 0.02  # s, about which a robot decides that has no default of its own
LONGEST = 10.0  # s, of a hold
LARGEST = 1e6  # of a limit


@renamed_arguments(RESIDUAL)
@dataclasses.dataclass(frozen=True)
class ResidualConfig:
    """A base controller, and what an agent's action in [-1, 1]^n does on top of it.

    Attributes:
        robot: by the environment's `robot_name`.
        base: registered name of the base controller; "none", and the action is the force itself.
        gains: in place of the base's preset's.
        action_mode: "synergies" of the legs, "wide-synergies" or raw "joints" (biped), the "attitude" loop, the
            "position" loop or both, the "cascade" (quadrotor), "joints" of any other robot; see the robots' modules.
        decision_period: time between two decisions (s), a whole number of control periods; 0 for as many as come
            nearest to `DECISION`, where the robot has no default.
        action_scale: largest size of each component of du (rad/s^2, m/s^2); `TURNING` times that in the attitude
            loop.
        gated: whether the residual fades in by tilt and velocity error (biped), or is there all the time.

    Raises:
        OptionError: for a value that is not allowed.
    """

    robot: str
    base: str = "tde"
    gains: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    action_mode: str = ""
    decision_period: float = 0.0
    action_scale: float = 0.0
    gated: bool = True

    def __post_init__(self) -> None:
        if not (isinstance(self.robot, str) and self.robot in ROBOTS):
            raise OptionError("robot", self.robot, suggest_names(self.robot, ROBOTS))
        agent = agent_of(self.robot)
        known = list(agent.action_modes)
        if self.action_mode not in ("", *known):
            raise OptionError("action_mode", self.action_mode, suggest_names(self.action_mode, known))
        if not isinstance(self.base, str):
            raise OptionError("base", self.base, "a name")
        if not (isinstance(self.gains, Mapping) and all(isinstance(name, str) for name in self.gains)):
            raise OptionError("gains", self.gains, "a mapping of names to values")
        channel = self.action_mode or known[0]
        object.__setattr__(self, "action_mode", channel)
        for field, default, most in (
            ("decision_period", agent.decision_period, LONGEST),
            ("action_scale", agent.action_modes[channel], LARGEST),
        ):
            value = check_number(
                field, getattr(self, field), 0.0, most, f"a number > 0, up to {most:g}; 0 for the default"
            )
            object.__setattr__(self, field, value or default)
        object.__setattr__(self, "gated", check_bool("gated", self.gated))

    def periods(self, control_period: float) -> int:
        """Control periods (of so many s) between two decisions.

        Raises:
            OptionError: unless it is a whole number.
        """
        if not self.decision_period:
            return max(1, round(DECISION / control_period))
        periods = round(self.decision_period / control_period)
        if periods < 1 or not math.isclose(periods * control_period, self.decision_period, rel_tol=1e-9):
            raise OptionError(
                "decision_period", self.decision_period, f"whole multiples of the control period {control_period:g} s"
            )
        return periods
