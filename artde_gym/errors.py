"""Errors that a user can cause and fix; each names the field, the value and what is allowed, or what to do."""

from __future__ import annotations

import difflib
from collections.abc import Collection
from typing import Self

LONGEST = 300
"""Characters of a value in an error; more, such as a matrix, would hide what is allowed."""


class ArtdeGymError(ValueError):
    """`field` has a `value` that is not `allowed`; or it has a `problem`, and `allowed` says what to do.

    The two sentences are "field is value; allowed: ..." for ranges, and "field value problem; ..." for all else:
    "engine is 'ode'; allowed: ...", "output folder 'runs/1' contains other files; choose a new or empty folder".
    """

    def __init__(self, field: str, value: object, allowed: str, problem: str = "") -> None:
        super().__init__(field, value, allowed, *filter(None, (problem,)))  # so that workers can pickle it
        self.field, self.value, self.allowed, self.problem = field, value, allowed, problem

    def __str__(self) -> str:
        if self.problem:
            return f"{self.field} {self.shown} {self.problem}; {self.allowed}"
        return f"{self.field} is {self.shown}; allowed: {self.allowed}"

    @property
    def shown(self) -> str:
        """The value as text, shortened."""
        text = repr(self.value)
        return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."

    def within(self, place: str) -> Self:
        """Return the same error with a place beside the field."""
        _, *rest = self.args
        return type(self)(f"{self.field} ({place})", *rest)


class RobotError(ArtdeGymError):
    """A robot description that no engine can build."""


class OptionError(ArtdeGymError):
    """An invalid argument of an environment, of `reset(options=...)` or of an evaluation."""


class UnknownArgumentError(OptionError, TypeError):
    """A keyword argument that an environment does not take.

    Also a `TypeError`, as in Python, since libraries try optional arguments and catch that.
    `gymnasium.make` re-raises it with its own message as the only argument, which becomes the `field`.
    """

    def __init__(self, field: str, value: object = None, allowed: str = "") -> None:
        super().__init__(field, value, allowed)

    def __str__(self) -> str:
        if not self.allowed:
            return self.field
        return f"{self.field} got an unexpected keyword argument {self.shown}; allowed: {self.allowed}"


class MissingDependencyError(OptionError, ModuleNotFoundError):
    """Something that needs a package that is not installed; `allowed` says what to do.

    Also a `ModuleNotFoundError`, since modules raise it when they are imported without their package.
    """

    def __str__(self) -> str:
        return f"{self.field} {self.shown} is not available: {self.allowed}"


class ActionError(ArtdeGymError):
    """An action with the wrong shape or a value that is not finite."""

    environment = 0
    """Number of the first environment of a vector that refused it."""


class DisturbanceError(ArtdeGymError):
    """A disturbance that violates the grammar of `artde_gym.disturbances`."""


class UnknownNameError(ArtdeGymError):
    """An unknown name of a scenario, a controller, an environment or another registered entry."""


class StoreError(ArtdeGymError):
    """A results folder that cannot be written or read."""


class WorkerError(ArtdeGymError):
    """Worker processes that ended before their work was done; `value` says in words how, `allowed` what to do."""

    def __str__(self) -> str:
        return f"{self.field} {self.value}; {self.allowed}"


def suggest_names(name: object, known: Collection[str]) -> str:
    """Return the known names as one text, with the closest match as a suggestion."""
    alike = [one for one in known if one.casefold() == str(name).casefold()]
    close = alike or difflib.get_close_matches(str(name), known, n=1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    return ", ".join(sorted(known)) + hint
