"""The disturbances of environments, single and vector."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.numeric import Words
from artde_gym.envs.options import warn_of_idle
from artde_gym.envs.step_limit import StepLimitMixin


class DisturbedMixin(StepLimitMixin):
    """A mixin of environments: parsing of disturbances, with a warning of those that can never happen."""

    robot_name: ClassVar[str]
    default_disturbances: ClassVar[Mapping[str, Any]] = {}
    words: Words
    control_period: float
    _disturbances: Disturbances

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        """Parse disturbances of this robot."""
        return Disturbances.parse(disturbances, self.words["site"], self.words["joint"], self.robot_name)

    def _disturb(self, disturbances: Mapping[str, Any] | None) -> None:
        """Set the disturbances of this and the following episodes; None for the default ones."""
        self._disturbances = self._parse(self.default_disturbances if disturbances is None else disturbances)
        self._warn_of_idle(self._disturbances)

    def _warn_of_idle(self, disturbances: Disturbances) -> None:
        warn_of_idle(disturbances, self._last * self.control_period)
