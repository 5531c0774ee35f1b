"""Gains found for each controller with the same budget of trials, judged on held-out seeds."""

from artde_gym.studies.tune.tuning import Tuning, tune

__all__ = ["Tuning", "tune"]
