"""Whether this machine can run everything: checks that tell what to do where something is wrong."""

from artde_gym.doctor.check_result import CheckResult
from artde_gym.doctor.checks import CHECKS, Report, run_checks

__all__ = ["CHECKS", "CheckResult", "Report", "run_checks"]
