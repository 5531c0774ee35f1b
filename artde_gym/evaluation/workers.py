"""Jobs in this process, or on several of this machine that have one core each and end with it; in any order."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from artde_gym.errors import WorkerError

AHEAD = 2
"""Jobs a worker that are handed out at once: no worker waits for its next one, and a million of them do not pile up."""
PATIENCE = 0.2  # s between two looks at the progress
DEATHS = 3
"""How often in a row a worker may end, without a finished job in between, before the jobs are believed to kill it."""

Job = Any
Work = Callable[[Job, Callable[[float], None]], Any]
"""What is done with a job: a function of a module, called with it and with what takes simulated times (s)."""
OnTime = Callable[[Job, float], None]
Runs = Generator[tuple[Job, Any], None, None]
"""Jobs with their results."""


def run_here(work: Work, jobs: Iterable[Job], on_time: OnTime) -> Runs:
    """Do the jobs in this process, one after another."""
    for job in jobs:
        yield job, work(job, functools.partial(on_time, job))


def run_parallel(work: Work, jobs: Iterable[Job], workers: int, on_time: OnTime) -> Runs:
    """Do the jobs on so many processes; what a worker was at when it was killed is done again.

    Raises:
        WorkerError: if workers keep ending before any job is done.
    """
    numbered, held = enumerate(jobs), dict[int, Job]()
    deaths = 0
    while deaths < DEATHS:
        with contextlib.closing(_run_until_a_death(work, numbered, held, workers, on_time)) as runs:
            try:
                for done in runs:
                    deaths = 0
                    yield done
                return
            except BrokenProcessPool:
                deaths += 1
    allowed = "workers that live; if memory is short, take fewer of them"
    raise WorkerError("worker processes", f"ended {DEATHS} times before a job was done", allowed)


def _run_until_a_death(
    work: Work, numbered: Iterator[tuple[int, Job]], held: dict[int, Job], workers: int, on_time: OnTime
) -> Runs:
    """As `run_parallel`; `held` are the jobs by number that have been handed out and are not done.

    Raises:
        BrokenProcessPool: when a worker was killed.
    """
    context = multiprocessing.get_context("spawn")  # a fork would copy physics clients and locks
    channel, stop = context.Queue(), context.RawValue(ctypes.c_bool, False)  # no lock that could die with its holder
    pool = ProcessPoolExecutor(workers, context, _start_worker, (channel, stop))
    running: dict[Future[Any], int] = {}

    def hand_out(numbers: Iterable[int]) -> None:
        running.update((pool.submit(_run_in_worker, work, number, held[number]), number) for number in numbers)

    def more() -> Iterator[int]:
        for number, job in itertools.islice(numbered, max(AHEAD * workers - len(held), 0)):
            held[number] = job
            yield number

    with _one_thread_each():
        try:
            with (
                _ignored_interrupt()
            ):  # what a new process inherits: Ctrl-C goes to the whole group, the parent decides
                hand_out([*held, *more()])
            while running:
                finished, _ = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED)
                while not channel.empty():
                    number, time = channel.get()
                    if number in held:
                        on_time(held[number], time)
                for future in finished:
                    result, number = future.result(), running.pop(future)
                    yield held.pop(number), result
                hand_out(more())
        finally:
            stop.value = True
            pool.shutdown(wait=True, cancel_futures=True)
            channel.close()


@contextlib.contextmanager
def _one_thread_each() -> Generator[None, None, None]:
    """Workers started meanwhile have one core each."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
        else:
            os.environ["OMP_NUM_THREADS"] = before


@contextlib.contextmanager
def _ignored_interrupt() -> Generator[None, None, None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers, and only it is interrupted
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_worker: dict[str, Any] = {}
"""A worker process's own: the channel for its progress and the flag that asks it to stop."""


class _StoppedError(Exception):
    """Raised in a worker in the middle of a job that nobody waits for."""


def _start_worker(channel: Any, stop: Any) -> None:
    channel.cancel_join_thread()  # one that was killed in the middle of a message must not hold the others up
    _worker.update(channel=channel, stop=stop)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Workers hold each other's pipes open, so that none would notice a parent that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_in_worker(work: Work, number: int, job: Job) -> Any:
    def on_time(time: float) -> None:
        if _worker["stop"].value:
            raise _StoppedError
        _worker["channel"].put((number, time))

    return work(job, on_time)
