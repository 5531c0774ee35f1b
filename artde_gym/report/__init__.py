"""HTML report of a results folder: one file that needs neither a network nor the environment."""

from typing import TYPE_CHECKING

from artde_gym.lazy import lazy

if TYPE_CHECKING:
    from artde_gym.report.report import write_report

__all__ = ["write_report"]

__getattr__ = lazy(__name__, {"write_report": "artde_gym.report.report"})
