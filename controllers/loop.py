"""A part of a robot that one law drives, with the inertia that the law meets, in one phase of support or in all."""

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


class SupportPhase(NamedTuple):
    """A phase of support of a walking robot along its reference.

    Attributes:
        name: "left", "both" or "right".
        joints: names of its coordinates.
        time: of the reference (k,) (s).
        inverse_inertia: acceleration of the joints by a force on them while the feet stand (k, n, n) (1/(kg m^2)).
        share: of the time.
    """

    name: str
    joints: tuple[str, ...]
    time: NDArray[np.floating[Any]]
    inverse_inertia: NDArray[np.floating[Any]]
    share: float
