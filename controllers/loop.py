"""A part of a robot that one law drives, with the inertia that the law meets."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Loop(NamedTuple):
    """A part of a robot that one law drives, along its reference.

    Attributes:
        name: "joints", "position" or "attitude".
        joints: names of its coordinates.
        unit: of its inertia.
        time: of the reference (k,) (s).
        inertia: that the law meets (k, n, n).
    """

    name: str
    joints: tuple[str, ...]
    unit: str
    time: NDArray[np.floating[Any]]
    inertia: NDArray[np.floating[Any]]
