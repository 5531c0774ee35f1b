"""One entry of the tables of gains."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeAlias


@dataclasses.dataclass(frozen=True)
class Preset:
    """Gains (a frozen dataclass of `controllers.laws`) and where they come from."""

    gains: Any
    source: str


Ranges: TypeAlias = dict[str, tuple[float, float]]
"""Gain, named as an override names it -> lowest and highest value for tuning."""
