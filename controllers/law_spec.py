"""A law that drives joints or the loops of a cascade, as a controller of its name."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from artde_gym.errors import OptionError
from controllers.laws.tracking import Law


def _same(gains: Any, _period: float) -> Any:
    return gains


@dataclasses.dataclass(frozen=True)
class LawSpec:
    """A law with all that makes it a controller.

    Attributes:
        law: its two functions.
        gains: dataclass of its presets' gains, if it is a controller of its own.
        text: description of that controller.
        like: name of the law whose presets and tuning ranges it takes on each robot that has none for it. They are
            built with `gains`, whose further fields keep their defaults.
        ranges: further gain -> lowest and highest value for tuning; of a cascade, for both loops.
        convert: turns a preset's gains and the sampling period into the law's own gains.
        reads: fields of the observation that it takes after the sampling period.
        delayed: whether it estimates by time delay, so that `artde-gym design` judges its m_bar; None for what the law
            that it is like does.

    Raises:
        OptionError: for a range of a gain without a default, or that does not hold the default above zero.
    """

    law: Law
    gains: type[Any] | None = None
    text: str = ""
    like: str | None = None
    ranges: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict[str, tuple[float, float]])
    convert: Callable[[Any, float], Any] = _same
    reads: tuple[str, ...] = ()
    delayed: bool | None = None

    def __post_init__(self) -> None:
        defaults = {} if self.gains is None else {one.name: one.default for one in dataclasses.fields(self.gains)}
        for gain, (low, high) in self.ranges.items():
            default = defaults.get(gain)
            if not isinstance(default, (int, float)):
                further = [name for name, value in defaults.items() if isinstance(value, (int, float))]
                todo = f"only gains whose default is a number have one here: {', '.join(further) or 'none has'}"
                raise OptionError(f"range of {gain!r}", (low, high), todo, "is of a gain without a default")
            if not 0 < low <= default <= high:
                raise OptionError(f"range of {gain!r}", (low, high), f"above 0, about the gain's default, {default:g}")
