"""What a check finds."""

from __future__ import annotations

from typing import Literal, NamedTuple

Status = Literal["ok", "missing", "failed"]


class CheckResult(NamedTuple):
    """One line of a diagnosis.

    Attributes:
        what: was looked at.
        status: "missing" is something optional that is not there, or slow; "failed" is what nothing works without.
        found: in a few words.
        remedy: what to do, unless all is well.
    """

    what: str
    status: Status
    found: str = ""
    remedy: str = ""
