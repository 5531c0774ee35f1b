"""Tuning with the same number of trials for each controller, judged on held-out seeds."""

from artde_gym.studies.tune.tuning import Tuning, tune

__all__ = ["Tuning", "tune"]
