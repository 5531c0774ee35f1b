"""Figures that a robot adds to the report of its episodes."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any, Protocol, cast

from artde_gym.kit import ROBOTS
from artde_gym.report.run import Episode


class RobotFigures(Protocol):
    """The module that `RobotKit.report` names."""

    def reference(self, kwargs: Mapping[str, Any]) -> Mapping[str, list[str]]:
        """Return parts of the page, each under a key by which it is shown once, from an environment's arguments."""
        ...

    def figures(self, episode: Episode) -> list[str]:
        """Return figures of one episode under all its controllers."""
        ...


def figures_of(robot: str) -> RobotFigures | None:
    """Return what a robot adds; None if it adds nothing."""
    module = ROBOTS[robot].report
    return None if module is None else cast(RobotFigures, importlib.import_module(module))
