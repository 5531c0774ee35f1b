"""Figures that a robot adds to the report of its episodes."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Mapping
from typing import Any, Protocol, cast

from artde_gym.kit import ROBOTS
from artde_gym.report.run import Episode


class RobotFigures(Protocol):
    """Interface of the module that `RobotKit.report` names."""

    def reference(self, kwargs: Mapping[str, Any]) -> Mapping[str, list[str]]:
        """Return parts of the page for an environment's arguments; parts with equal keys are shown once."""
        ...

    def figures(self, episode: Episode) -> list[str]:
        """Return figures of one episode with all its controllers."""
        ...

    # a module may also have `strip(episode) -> Strip`: what all charts of an episode show below their time


def with_strip(robot: str, episode: Episode) -> Episode:
    """Return an episode with the strip that a robot shows below the charts, if it has one."""
    strip = getattr(figures_of(robot), "strip", None)
    return episode if strip is None else dataclasses.replace(episode, strip=strip(episode))


def figures_of(robot: str) -> RobotFigures | None:
    """Return a robot's figures; None without any."""
    module = ROBOTS[robot].report
    return None if module is None else cast(RobotFigures, importlib.import_module(module))
