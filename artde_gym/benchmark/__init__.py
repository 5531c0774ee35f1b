"""Speed and memory on this machine with this release, as ratios measured in one run."""

from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.run import SECTIONS, measure

__all__ = ["SECTIONS", "Figure", "Section", "measure"]
