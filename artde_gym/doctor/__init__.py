"""Whether this machine can run everything: checks that tell what to do where something is wrong."""

from artde_gym.doctor.examination import CHECKS, Report, examine
from artde_gym.doctor.outcome import Outcome

__all__ = ["CHECKS", "Outcome", "Report", "examine"]
