"""The kinds of disturbances and their parameters: the one schema that checks, documents and draws them."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One value of a disturbance.

    Attributes:
        low, high: allowed range of each component.
        default: used where the parameter is left out; None if it must be given.
        size: number of components; 0 for a word.
        nonzero: whether a vector of zeros is refused.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float | tuple[float, ...] | str | None
    text: str
    size: int = 1
    nonzero: bool = False


@dataclasses.dataclass(frozen=True)
class Kind:
    """A disturbance by name. `scalar` names the parameter that a bare number stands for.

    A `repeated` kind takes a list of entries.
    """

    name: str
    text: str
    parameters: tuple[Parameter, ...]
    scalar: str | None = None
    repeated: bool = False


KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            "payload",
            "A ball fixed to the base from the start of the episode.",
            (
                Parameter("mass", "kg", 1e-3, 5.0, None, "mass of the ball"),
                Parameter("position", "m", -0.5, 0.5, (0.0, 0.0, 0.16), "its centre in the base frame", size=3),
            ),
            scalar="mass",
        ),
        Kind(
            "push",
            "A constant force for a while, in world axes.",
            (
                Parameter("body", "", 0, 0, "torso", "named site of the robot at which it acts", size=0),
                Parameter("magnitude", "N", 0.0, 500.0, None, "size of the force"),
                Parameter(
                    "direction",
                    "1",
                    -1e3,
                    1e3,
                    (1.0, 0.0, 0.0),
                    "along which it acts; any length. Two components {'normal': [0, 1]} and a zero make a uniform "
                    "random direction in the ground plane",
                    size=3,
                    nonzero=True,
                ),
                Parameter("start", "s", 0.0, 1e5, None, "first instant"),
                Parameter("duration", "s", 1e-3, 60.0, 0.2, "how long"),
            ),
            repeated=True,
        ),
        Kind(
            "friction",
            "Friction coefficient of the pair foot and ground.",
            (Parameter("coefficient", "1", 0.01, 2.0, None, "instead of the nominal 0.8"),),
            scalar="coefficient",
        ),
    )
}
