"""Errors of learned policies that a user can cause and mend."""

from __future__ import annotations

from artde_gym.errors import ArtdeGymError


class PolicyFileError(ArtdeGymError):
    """A saved policy that cannot be read, or that does not fit where it is to be used."""


class TrainingError(ArtdeGymError):
    """An argument of a training, or a run's folder that belongs to another one."""
