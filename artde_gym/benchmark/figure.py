"""What a benchmark finds."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        what: as a reader will see it.
        value: in `unit`.
        unit: "1" for a ratio, which holds on any machine.
        least: what it should be at least, if anything.
        most: what it should be at most, if anything.
    """

    what: str
    value: float
    unit: str = "1"
    least: float | None = None
    most: float | None = None

    @property
    def met(self) -> bool | None:
        """Whether it is what it should be; None if nothing was asked."""
        if self.least is None and self.most is None:
            return None
        return (self.least is None or self.value >= self.least) and (self.most is None or self.value <= self.most)

    @property
    def target(self) -> str:
        """What it should be, in words."""
        bounds = ((">=", self.least), ("<=", self.most))
        return ", ".join(f"{sign} {bound:g}" for sign, bound in bounds if bound is not None)


@dataclasses.dataclass(frozen=True)
class Section:
    """Figures that belong together.

    Attributes:
        title: of the section.
        text: what was measured, and how.
        figures: what was found.
        skipped: why there are none, or not all of them; empty if there are.
    """

    title: str
    text: str
    figures: tuple[Figure, ...] = ()
    skipped: str = ""
