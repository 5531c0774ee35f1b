"""Measured figures and their sections."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        what: description for readers.
        value: in `unit`.
        unit: "1" for a ratio, which holds on any machine.
        least: lower target, if any.
        most: upper target, if any.
    """

    what: str
    value: float
    unit: str = "1"
    least: float | None = None
    most: float | None = None

    @property
    def met(self) -> bool | None:
        """Result of the comparison with the target; None without one."""
        if self.least is None and self.most is None:
            return None
        return (self.least is None or self.value >= self.least) and (self.most is None or self.value <= self.most)

    @property
    def target(self) -> str:
        """The target in words."""
        bounds = ((">=", self.least), ("<=", self.most))
        return ", ".join(f"{sign} {bound:g}" for sign, bound in bounds if bound is not None)


@dataclasses.dataclass(frozen=True)
class Section:
    """Figures that belong together.

    Attributes:
        title: of the section.
        text: description of the measurement.
        figures: measured figures.
        skipped: reason for missing figures; empty without any.
    """

    title: str
    text: str
    figures: tuple[Figure, ...] = ()
    skipped: str = ""
