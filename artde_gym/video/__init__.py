"""Episodes to look at: pictures and videos of exactly what `evaluate` runs."""

from artde_gym.video.recording import video

__all__ = ["video"]
