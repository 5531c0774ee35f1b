"""All checks by name, each in a process of its own, so that nothing that one of them does ends the others."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from artde_gym.doctor.outcome import Outcome
from artde_gym.errors import UnknownNameError, among
from artde_gym.registration import resolved

CHECKS: dict[str, tuple[str, str]] = {
    "python": ("Python and packages", "artde_gym.doctor.machine:python"),
    "extras": ("Optional packages", "artde_gym.doctor.machine:extras"),
    "files": ("Files", "artde_gym.doctor.machine:files"),
    "bullet": ("Environments in PyBullet", "artde_gym.doctor.environments:bullet"),
    "mujoco": ("Environments in MuJoCo", "artde_gym.doctor.environments:mujoco"),
    "batch": ("Environments in NumPy", "artde_gym.doctor.environments:batch"),
    "sb3": ("Stable-Baselines3", "artde_gym.doctor.environments:stable_baselines3"),
    "determinism": ("Determinism", "artde_gym.doctor.determinism:determinism"),
    "validity": (
        "Time-delay estimation converges: eigenvalues of M^-1 m_bar in (0, 2)",
        "controllers.checkup:validity",
    ),
    "speed": ("Speed", "artde_gym.doctor.speed:speed"),
    "pictures": ("Pictures and videos", "artde_gym.doctor.pictures:pictures"),
}
"""Name -> (title, "module:function"), called as function() and giving a list of `Outcome`s."""

PATIENCE = 180.0
"""Seconds after which a check is given up."""
REPORT_IT = "report it, with this line and the output of `artde-gym doctor --json`"


class Report(NamedTuple):
    """What one check found, under its title."""

    title: str
    outcomes: list[Outcome]


def examine(names: Sequence[str] | None = None, *, workers: int | None = None) -> Iterator[tuple[str, Report]]:
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
            raise UnknownNameError("check", name, among(name, CHECKS))
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        running = {name: pool.submit(_isolated, *CHECKS[name]) for name in chosen}
        for name, future in running.items():
            yield name, Report(CHECKS[name][0], future.result())


def _isolated(title: str, entry_point: str) -> list[Outcome]:
    """What a check in a process of its own finds; its crash is a finding."""
    context = multiprocessing.get_context("spawn")  # a fork would copy threads and locks
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(entry_point, theirs))
    process.start()
    theirs.close()
    found: list[Outcome] | None = None
    late = not ours.poll(PATIENCE)
    if late:
        process.kill()
    else:
        with contextlib.suppress(EOFError):  # it died without a word
            found = [Outcome(*values) for values in ours.recv()]
    process.join()
    if found is not None:
        return found
    if late:
        return [Outcome(title, "failed", f"no answer in {PATIENCE:g} s", "end other programs and try again")]
    return [Outcome(title, "failed", f"the process died with exit code {process.exitcode}", REPORT_IT)]


def _run(entry_point: str, channel: Any) -> None:
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)  # whatever libraries have to say
    os.dup2(sink, 2)
    channel.send([tuple(outcome) for outcome in _attempted(entry_point)])
    channel.close()


def _attempted(entry_point: str) -> list[Outcome]:
    """What a check finds, an exception being a finding."""
    try:
        return resolved(entry_point)()
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        found = f"{type(error).__name__}: {error} ({os.path.basename(place.filename)}:{place.lineno})"
        return [Outcome("the check itself", "failed", found, REPORT_IT)]
