"""HTML report of a results folder: one file that needs neither a network nor the environment."""

from artde_gym.report.report import write_report

__all__ = ["write_report"]
