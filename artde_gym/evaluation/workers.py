"""Parallel jobs, in any order: in this process, or in several local ones with one core each that end with it."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from artde_gym.arguments import check_integer
from artde_gym.errors import OptionError, WorkerError

AHEAD = 2
"""Jobs per worker that are submitted at once: no worker waits for its next one, and a million jobs do not pile up."""
PATIENCE = 0.2  # s between two checks of the progress
GRACE = 5.0
"""Time (s) for workers to stop by themselves after an interruption; a second interruption ends them at once."""
UNGUARDED = 79
"""Exit code of a worker that would start workers itself, because its script starts them at import."""
MOST_WORKERS = 1024
DEATHS = 3
"""Number of deaths in a row, without a finished job in between, after which the jobs are believed to kill workers."""
FEWER = "if memory is short, use fewer workers"
GUARD = "a script that starts nothing at import; put the call below `if __name__ == '__main__':`"

Job = Any
Work = Callable[[Job, Callable[[float], None]], Any]
"""The work on a job: a module-level function that takes the job and a callback for simulated times (s)."""
OnTime = Callable[[Job, float], None]
Runs = Generator[tuple[Job, Any], None, None]
"""Jobs with their results."""


def run_jobs(work: Work, jobs: Iterable[Job], workers: int, on_time: OnTime) -> Runs:
    """Run the jobs in this process for one worker, else in that many processes.

    Raises:
        WorkerError: as for `run_parallel`.
    """
    return run_here(work, jobs, on_time) if workers == 1 else run_parallel(work, jobs, workers, on_time)


def run_here(work: Work, jobs: Iterable[Job], on_time: OnTime) -> Runs:
    """Run the jobs in this process, one after another."""
    for job in jobs:
        yield job, work(job, functools.partial(on_time, job))


def run_parallel(work: Work, jobs: Iterable[Job], workers: int, on_time: OnTime) -> Runs:
    """Run the jobs in `workers` processes; jobs of a killed worker are run again.

    Raises:
        WorkerError: if workers keep ending before a job is done, or if the calling script has no main guard.
    """
    check_workers(workers)
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
    raise WorkerError("worker processes", f"ended {DEATHS} times before a job was done", FEWER)


def _run_until_a_death(
    work: Work, numbered: Iterator[tuple[int, Job]], held: dict[int, Job], workers: int, on_time: OnTime
) -> Runs:
    """Run jobs as `run_parallel` does; `held` contains the submitted, unfinished jobs by number.

    Raises:
        BrokenProcessPool: when a worker was killed.
    """
    crew = _Crew()
    context = crew.context
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
            with ignored_interrupt():
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
        except BrokenProcessPool:
            pool.shutdown(wait=True, cancel_futures=True)
            if any(worker.exitcode == UNGUARDED for worker in crew.workers):
                raise WorkerError("worker processes", "each started the script again", f"use {GUARD}") from None
            raise
        finally:
            try:
                with contextlib.suppress(KeyboardInterrupt):  # a second one, wherever it strikes
                    stop.value = True
                    pool.shutdown(wait=False, cancel_futures=True)
                    crew.wait(GRACE)
            finally:
                crew.kill()
                channel.close()


class _Crew:
    """Processes that `context` starts with `spawn`, since a fork would copy physics clients and locks."""

    def __init__(self) -> None:
        self.context: Any = SpawnContext()
        self.context.Process = self._process
        self.workers: list[SpawnProcess] = []

    def _process(self, *args: Any, **kwargs: Any) -> SpawnProcess:
        self.workers.append(SpawnProcess(*args, **kwargs))
        return self.workers[-1]

    def wait(self, patience: float) -> None:
        """Wait until all workers have ended, at most for a time (s)."""
        deadline = time.monotonic() + patience
        while (running := self._running()) and (left := deadline - time.monotonic()) > 0:
            connection.wait(list(running), left)

    def kill(self) -> None:
        """Kill the workers that still run."""
        with ignored_interrupt():  # nothing is left to wait for
            for worker in self._running().values():
                worker.kill()
                worker.join()

    def _running(self) -> dict[Any, SpawnProcess]:
        """Workers by sentinel: the pool's own thread waits for them too, and may reap one first."""
        started = {worker.sentinel: worker for worker in self.workers if worker.pid is not None}
        ended = connection.wait(list(started), 0)
        return {sentinel: worker for sentinel, worker in started.items() if sentinel not in ended}


def check_workers(workers: Any) -> None:
    """Check a number of workers before anything is written.

    A worker that gets here while it imports its parent's script, which then has no main guard, ends at once.

    Raises:
        OptionError: unless it is a whole number from 1 to `MOST_WORKERS`.
    """
    end_unguarded()
    check_integer("workers", workers, 1, MOST_WORKERS)


def end_unguarded() -> None:
    """End a worker that would start workers itself, because its script starts them at import."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # the check that multiprocessing itself uses
        sys.exit(UNGUARDED)


def check_picklable(named: Mapping[str, Any], gains: Mapping[str, dict[str, Any]]) -> None:
    """Check that controllers can be sent to other processes.

    Raises:
        OptionError: if one cannot be pickled.
    """
    for name, item in named.items():
        try:
            pickle.dumps((item, gains.get(name)))
        except Exception as error:  # pickling runs code of the policy's class
            problem = f"is not picklable, as it must be for several workers ({error})"
            raise OptionError(f"controller {name!r}", item, "choose workers=1", problem) from error


@contextlib.contextmanager
def _one_thread_each() -> Generator[None, None, None]:
    """Limit workers started meanwhile to one core each."""
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
def ignored_interrupt() -> Generator[None, None, None]:
    """Ignore Ctrl-C here and in processes started meanwhile: it reaches all, and the parent decides."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers, and only it is interrupted
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_worker: dict[str, Any] = {}
"""State of a worker process: the channel for its progress and the flag that asks it to stop."""


class _StoppedError(Exception):
    """Stop of a worker in the middle of a job whose result is no longer needed."""


def _start_worker(channel: Any, stop: Any) -> None:
    channel.cancel_join_thread()  # a worker killed in the middle of a message must not block the others
    _worker.update(channel=channel, stop=stop)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker when its parent dies; the workers keep each other's pipes open and would not notice."""
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
