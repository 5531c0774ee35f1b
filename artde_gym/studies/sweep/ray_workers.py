"""Jobs on a Ray cluster, as `artde_gym.evaluation.workers` does them on one machine."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable
from typing import Any

from artde_gym.errors import OptionError, WorkerError
from artde_gym.evaluation.provenance import software
from artde_gym.evaluation.workers import AHEAD, PATIENCE, Job, Runs, Work

RETRIES = 3  # of a job whose worker or node is lost
STORE = 80 * 2**20  # bytes of shared memory for a cluster on this machine: results are a few kB


def run_on_ray(work: Work, jobs: Iterable[Job], workers: int, address: str | None, on_wait: Callable[[], None]) -> Runs:
    """Do the jobs on a Ray cluster, one core each; what a lost worker or node was at is done again.

    Args:
        work: a function of a module that all nodes have; what it tells of simulated times goes nowhere.
        jobs: what it is called with.
        workers: processes of a cluster that is started here.
        address: of a running cluster, "auto" for this machine's; None starts one here, which ends with this process.
        on_wait: called several times a second.

    Raises:
        OptionError: without Ray, if no cluster answers at the address, or for a node with other software.
        WorkerError: if workers are lost again and again.
    """
    ray = _ray()
    ours = not ray.is_initialized()
    if ours:
        _connect(ray, address, workers)
    do = ray.remote(_on_node).options(num_cpus=1, max_retries=RETRIES)
    wanted, left, running = software(), iter(jobs), dict[Any, Job]()
    cores = _cores(ray)
    try:
        while True:
            for job in itertools.islice(left, max(AHEAD * cores - len(running), 0)):
                running[do.remote(work, job, wanted)] = job
            if not running:
                return
            finished, _ = ray.wait(list(running), timeout=PATIENCE)
            on_wait()
            for reference in finished:
                result = _result(ray, reference)
                yield running.pop(reference), result
            if not finished:
                cores = _cores(ray)  # clusters grow
    finally:
        for reference in running:
            ray.cancel(reference, force=True)
        if ours:
            ray.shutdown()


def _ray() -> Any:
    try:
        import ray
    except ImportError as error:
        raise OptionError("ray", "not installed", "pip install 'artde-gym[scale]'") from error
    return ray


def _connect(ray: Any, address: str | None, workers: int) -> None:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nobody is told what runs here, unless the user wants it
    own = {"num_cpus": workers, "object_store_memory": STORE, "include_dashboard": False} if address is None else {}
    try:
        ray.init(address or "local", log_to_driver=False, logging_level="ERROR", **own)
    except Exception as error:  # it raises these, too
        reason = " ".join(str(error).split())
        if address is None:
            raise WorkerError("Ray", reason, "a machine on which it starts, within 30 s") from error
        raise OptionError("address", address, f"that of a running Ray cluster ({reason})") from error


def _cores(ray: Any) -> int:
    return max(int(ray.cluster_resources().get("CPU", 1)), 1)


def _result(ray: Any, reference: Any) -> Any:
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
    except ray.exceptions.RayError as error:
        reason = str(error).strip().splitlines()[0]
        raise WorkerError("Ray", reason, "workers that live; if memory is short, take fewer of them") from error


def _on_node(work: Work, job: Job, wanted: dict[str, str]) -> Any:
    """Do a job in a worker, whose results would differ in their last bits with other software."""
    here = software()
    if here != wanted:
        raise OptionError("software of a Ray node", here, repr(wanted))
    return work(job, lambda *_: None)
