"""Result of a check."""

from __future__ import annotations

from typing import Literal, NamedTuple

Status = Literal["ok", "missing", "failed"]


class CheckResult(NamedTuple):
    """One line of a report.

    Attributes:
        what: subject of the check.
        status: "missing": something optional is missing or slow; "failed": something required does not work.
        found: short finding.
        remedy: suggested fix, unless the status is "ok".
    """

    what: str
    status: Status
    found: str = ""
    remedy: str = ""
