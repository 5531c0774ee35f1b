"""Which tests this machine can run, and how many must have passed: nothing is left out by accident.

A test with a marker of `NEEDS` is deselected where its packages cannot be imported. `bullet` is given to every test
with a parameter "bullet", `pinocchio` to every one with the fixture `judge`. With `--at-least N`, a run in which fewer
tests pass fails.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from typing import Any

import pytest

NEEDS = {"bullet": ("pybullet",), "torch": ("torch", "stable_baselines3"), "pinocchio": ("pinocchio",), "linux": ()}
"""Marker -> what must be importable; Linux needs nothing but Linux."""

passed = pytest.StashKey[int]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--at-least", type=int, default=0, help="Fail unless so many tests pass.")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[passed] = 0


def _least(config: pytest.Config) -> int:
    return int(str(config.getoption("--at-least")))


def can_run(marker: str) -> bool:
    if marker == "linux":
        return sys.platform == "linux"
    try:
        for name in NEEDS[marker]:
            importlib.import_module("artde_gym.sim.pybullet_module" if name == "pybullet" else name)
    except ImportError:
        return False
    return True


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    missing = [marker for marker in NEEDS if not can_run(marker)]
    for item in items:
        parameters: Sequence[Any] = [*getattr(getattr(item, "callspec", None), "params", {}).values()]
        if any(isinstance(value, str) and value == "bullet" for value in parameters):
            item.add_marker("bullet")
        if "judge" in getattr(item, "fixturenames", ()):
            item.add_marker("pinocchio")
    left_out = [item for item in items if any(item.get_closest_marker(marker) for marker in missing)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        gone = set(map(id, left_out))
        items[:] = [item for item in items if id(item) not in gone]


class _Counter:
    """Counts where reports arrive: in the process that the user started, whatever workers there are."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._config.stash[passed] += report.when == "call" and report.passed


def pytest_sessionstart(session: pytest.Session) -> None:
    session.config.pluginmanager.register(_Counter(session.config))


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    wanted = 0 if hasattr(session.config, "workerinput") else _least(session.config)
    if exitstatus == 0 and session.config.stash[passed] < wanted:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    count, wanted = config.stash[passed], _least(config)
    missing = [marker for marker in NEEDS if not can_run(marker)]
    if missing:
        terminalreporter.write_line(f"deselected, since they need what is not here: {', '.join(missing)}")
    if count < wanted:
        terminalreporter.write_line(f"FAILED: {count} tests passed; at least {wanted} must (--at-least)", red=True)
