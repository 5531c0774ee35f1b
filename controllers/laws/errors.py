"""The error of a control law."""

from __future__ import annotations

LONGEST = 100
"""Characters of a value in an error; those of a matrix would hide what is allowed."""


class GainError(ValueError):
    """Gain `field` has a `value` that is not `allowed`."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(field, value, allowed)
        self.field, self.value, self.allowed = field, value, allowed

    def __str__(self) -> str:
        text = repr(self.value)
        shown = text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
        return f"gain {self.field} is {shown}; allowed: {self.allowed}"
