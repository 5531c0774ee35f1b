"""Images and videos of the episodes that `evaluate` runs."""

from artde_gym.video.recording import video

__all__ = ["video"]
