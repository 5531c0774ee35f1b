"""The error of a control law."""

from __future__ import annotations


class GainError(ValueError):
    """Gain `field` has a `value` that is not `allowed`."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(field, value, allowed)
        self.field, self.value, self.allowed = field, value, allowed

    def __str__(self) -> str:
        return f"gain {self.field} is {self.value!r}; allowed: {self.allowed}"
