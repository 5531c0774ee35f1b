"""The errors that a user of artde-gym can cause and mend: each names the field, the value and what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Collection


class ArtdeGymError(ValueError):
    """`field` has a `value` that is not `allowed`."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(field, value, allowed)  # exactly the arguments, so that workers can pickle it
        self.field, self.value, self.allowed = field, value, allowed

    def __str__(self) -> str:
        return f"{self.field} is {self.value!r}; allowed: {self.allowed}"


class RobotError(ArtdeGymError):
    """A robot description that no engine could build."""


class OptionError(ArtdeGymError):
    """An argument of an environment, of `reset(options=...)` or of an evaluation."""


class UnknownArgumentError(OptionError, TypeError):
    """A keyword argument that an environment does not take.

    Also a `TypeError`, as Python raises it, since clients try arguments of other libraries' and look out for that.
    `gymnasium.make` raises it again with a text of its own, which is then the `field`.
    """

    def __init__(self, field: str, value: object = None, allowed: str = "") -> None:
        super().__init__(field, value, allowed)

    def __str__(self) -> str:
        if not self.allowed:
            return self.field
        return f"{self.field} got an unexpected keyword argument {self.value!r}; allowed: {self.allowed}"


class MissingDependencyError(OptionError):
    """An argument that needs a package which this Python does not have; `allowed` says what to do."""

    def __str__(self) -> str:
        return f"{self.field} {self.value!r} is not available: {self.allowed}"


class ActionError(ArtdeGymError):
    """An action of the wrong shape, or with a value that is not finite."""


class DisturbanceError(ArtdeGymError):
    """A disturbance outside the grammar of `artde_gym.disturbances`."""


class UnknownNameError(ArtdeGymError):
    """A name that no registry knows: a scenario, a controller, an environment."""


class StoreError(ArtdeGymError):
    """A results folder that cannot be written or read."""


class WorkerError(ArtdeGymError):
    """Worker processes that end before their work is done."""


def suggest_names(name: object, known: Collection[str]) -> str:
    """The known names as a sentence, the likely meant one pointed out."""
    close = difflib.get_close_matches(str(name), known, n=1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    return ", ".join(sorted(known)) + hint
