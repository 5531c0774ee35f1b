"""Bisection for several controllers in lockstep, on numbered levels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

Outcomes = Mapping[int, bool]
"""Grid index -> whether the level was survived."""


def search(
    size: int, names: Sequence[str], run: Callable[[int, list[str]], Mapping[str, bool]]
) -> dict[str, dict[int, bool]]:
    """Bisect for each name on the levels 0 (easiest) to size - 1 (hardest), size >= 2.

    All searches advance in lockstep. A level can come up at only one depth of a bisection, so all searches that need it
    ask for it at the same time: `run(level, names)`, which returns the survivors, is called at most once per level.
    """
    outcomes: dict[str, dict[int, bool]] = {name: {} for name in names}
    while True:
        wanted: dict[int, list[str]] = {}
        for name in names:
            level = _next(outcomes[name], size)
            if level is not None:
                wanted.setdefault(level, []).append(name)
        if not wanted:
            return outcomes
        for level in sorted(wanted):
            for name, survived in run(level, wanted[level]).items():
                outcomes[name][level] = survived


def bracket(outcomes: Outcomes) -> tuple[int | None, int | None]:
    """Return the hardest level survived and the easiest failed, or None; bisection keeps the first lower."""
    return (
        max((level for level, survived in outcomes.items() if survived), default=None),
        min((level for level, survived in outcomes.items() if not survived), default=None),
    )


def _next(outcomes: Outcomes, size: int) -> int | None:
    survived, failed = bracket(outcomes)
    if failed is None:
        return 0 if survived is None else size - 1 if survived < size - 1 else None
    if survived is None or failed - survived == 1:
        return None
    return (survived + failed) // 2
