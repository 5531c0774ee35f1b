"""All checks by name, each in a process of its own, so that nothing that one of them does ends the others."""

from __future__ import annotations

import contextlib
import inspect
import multiprocessing
import os
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from artde_gym.doctor.check_result import CheckResult
from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.registration import resolved
from artde_gym.registry import pointed
from artde_gym.sim.factory import ENGINES


class Check(NamedTuple):
    """A check: `entry_point` is "module:function", called with `arguments` and giving a list of `CheckResult`s.

    Without a title, it is the first line of the function's docstring.
    """

    title: str
    entry_point: str
    arguments: tuple[str, ...] = ()


CHECKS: dict[str, Check] = {
    "python": Check("Python and packages", "artde_gym.doctor.machine:python"),
    "extras": Check("Optional packages", "artde_gym.doctor.machine:extras"),
    "files": Check("Files", "artde_gym.doctor.machine:files"),
    **{
        name: Check(f"Environments in {engine.title}", "artde_gym.doctor.environments:in_engine", (name,))
        for name, engine in ENGINES.items()
    },
    "batch": Check("Many environments at once", "artde_gym.doctor.environments:batch"),
    "sb3": Check("Stable-Baselines3", "artde_gym.doctor.environments:stable_baselines3"),
    "determinism": Check("Determinism", "artde_gym.doctor.determinism:determinism"),
    "speed": Check("Speed", "artde_gym.doctor.speed:speed"),
    "pictures": Check("Pictures and videos", "artde_gym.doctor.pictures:pictures"),
    **{name: Check("", point) for name, point in pointed("artde_gym.checks").items()},
}
"""All checks by name: our own, then those of the entry points "artde_gym.checks", which no other process imports."""

PATIENCE = 180.0
"""Seconds after which a check is given up."""
REPORT_IT = "report it, with this line and the output of `artde-gym doctor --json`"


class Report(NamedTuple):
    """What one check found, under its title."""

    title: str
    outcomes: list[CheckResult]


def run_checks(names: Sequence[str] | None = None, *, workers: int | None = None) -> Iterator[tuple[str, Report]]:
    """Run some checks, or all; yields each report in the order of `CHECKS` as soon as it and those before it are done.

    Args:
        names: of `CHECKS`.
        workers: checks that run at once; None for one a core.

    Raises:
        UnknownNameError: for a check that there is not.
    """
    chosen = list(CHECKS if names is None else names)
    for name in chosen:
        if name not in CHECKS:
            raise UnknownNameError("check", name, suggest_names(name, CHECKS))
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        running = {name: pool.submit(_isolated, name, CHECKS[name]) for name in chosen}
        for name, future in running.items():
            yield name, future.result()


def _isolated(name: str, check: Check) -> Report:
    """What a check in a process of its own finds; its crash is a finding."""
    context = multiprocessing.get_context("spawn")  # a fork would copy threads and locks
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(check, theirs))
    process.start()
    theirs.close()
    found: Report | None = None
    late = not ours.poll(PATIENCE)
    if late:
        process.kill()
    else:
        with contextlib.suppress(EOFError):  # it died without a word
            title, outcomes = ours.recv()
            found = Report(title or name, [CheckResult(*values) for values in outcomes])
    process.join()
    if found is not None:
        return found
    said, remedy = f"the process died with exit code {process.exitcode}", REPORT_IT
    if late:
        said, remedy = f"no answer in {PATIENCE:g} s", "end other programs and try again"
    title = check.title or name
    return Report(title, [CheckResult(title, "failed", said, remedy)])


def _run(check: Check, channel: Any) -> None:
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)  # whatever libraries have to say
    os.dup2(sink, 2)
    outcomes = [tuple(outcome) for outcome in _attempted(check)]
    channel.send((check.title or _title_of(check), outcomes))
    channel.close()


def _title_of(check: Check) -> str:
    """Return the first line of a function's docstring; "" without one."""
    with contextlib.suppress(Exception):  # what was wrong with it has been found
        return (inspect.getdoc(resolved(check.entry_point)) or "").split("\n")[0].rstrip(".")
    return ""


def _attempted(check: Check) -> list[CheckResult]:
    """What a check finds, an exception being a finding."""
    try:
        return resolved(check.entry_point)(*check.arguments)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        found = f"{type(error).__name__}: {error} ({os.path.basename(place.filename)}:{place.lineno})"
        return [CheckResult("the check itself", "failed", found, REPORT_IT)]
