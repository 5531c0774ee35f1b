"""A report that people look at: one HTML file that needs no network, from a results folder alone."""

from artde_gym.report.report import write_report

__all__ = ["write_report"]
