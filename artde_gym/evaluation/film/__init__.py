"""Episodes to look at: pictures and videos of exactly what `evaluate` runs."""

from artde_gym.evaluation.film.video import video

__all__ = ["video"]
