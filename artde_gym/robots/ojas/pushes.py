"""The two pushes of scenario S3; the thesis gives neither a duration (0.2 s here) nor the arm push's azimuth."""

from __future__ import annotations

from typing import Any

CHEST_PUSH: dict[str, Any] = {
    "body": "chest",
    "magnitude": 10.0,
    "direction": [1.0, 0.0, 0.0],  # forward
    "start": 28.0,
    "duration": 0.2,
}
ARM_PUSH: dict[str, Any] = {
    "body": "left_arm",
    "magnitude": 10.0,
    "direction": [0.0, -1.0, -1.0],  # inward and down, at 45 degrees to the vertical
    "start": 37.0,
    "duration": 0.2,
}
