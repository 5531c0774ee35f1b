"""Checks of the installation, with suggested fixes."""

from artde_gym.doctor.check_result import CheckResult
from artde_gym.doctor.checks import CHECKS, Report, run_checks

__all__ = ["CHECKS", "CheckResult", "Report", "run_checks"]
