"""Parallel jobs on a Ray cluster, the counterpart of `artde_gym.evaluation.workers`."""

from __future__ import annotations

import itertools
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterable
from typing import Any

from artde_gym.errors import OptionError, WorkerError
from artde_gym.evaluation.provenance import software
from artde_gym.evaluation.workers import AHEAD, FEWER, PATIENCE, Job, Runs, Work
from artde_gym.extras import needs

ANSWER_TIMEOUT_S = 4.0  # until a cluster has answered
JOIN_TIMEOUT_S = 14.0  # until a process has joined it
JOIN_SCRIPT = "import ray, sys; ray.init(sys.argv[1], log_to_driver=False, logging_level='ERROR')"
SETTINGS = b"\x04"  # type of the first frame of any HTTP/2 server, gRPC servers included
HTTP2_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0" + SETTINGS + b"\0" * 5
MAX_RETRIES = 3  # of a job whose worker or node is lost
OBJECT_STORE_BYTES = 80 * 2**20  # bytes of shared memory for a cluster on this machine: results are a few kB


def run_on_ray(work: Work, jobs: Iterable[Job], workers: int, address: str | None, on_wait: Callable[[], None]) -> Runs:
    """Run the jobs on a Ray cluster, one core each; jobs of a lost worker or node are run again.

    Args:
        work: a function of a module that all nodes have; simulated times that it reports are discarded.
        jobs: its arguments.
        workers: number of processes of a cluster that is started here.
        address: of a running cluster, "auto" for this machine's; None starts one here, which ends with this process.
        on_wait: called several times a second.

    Raises:
        OptionError: without Ray, if no cluster answers at the address, or for a node with other software.
        WorkerError: if workers are lost repeatedly.
    """
    ray = _ray()
    ours = not ray.is_initialized()
    if ours:
        _connect(ray, address, workers)
    do = ray.remote(_on_node).options(num_cpus=1, max_retries=MAX_RETRIES)
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
    with needs("scale"):
        import ray
    return ray


def _connect(ray: Any, address: str | None, workers: int) -> None:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # Ray's usage reports are off unless the user enables them
    own = (
        {"num_cpus": workers, "object_store_memory": OBJECT_STORE_BYTES, "include_dashboard": False}
        if address is None
        else {}
    )
    try:
        ray.init(address or "local", log_to_driver=False, logging_level="ERROR", **own)
    except Exception as error:  # it raises these, too
        reason = " ".join(str(error).split())
        if address is None:
            raise WorkerError("Ray", f"did not start ({reason})", "use executor='local'") from error
        raise OptionError(
            "address", address, "give that of a running Ray cluster", f"does not answer ({reason})"
        ) from error


def check_address(address: str) -> None:
    """Check that there is a cluster at an address; Ray itself takes minutes to find that there is none.

    Raises:
        OptionError: without Ray, or if a process cannot join one within 20 s.
    """
    ray = _ray()
    if ray.is_initialized():
        return
    where = os.environ.get("RAY_ADDRESS", address) if address == "auto" else address
    host, _, port = where.removeprefix("ray://").rpartition(":")
    if not (host and port.isdigit()):
        return  # Ray looks for it itself
    hosts = [host.strip("[]")]
    if host in ("localhost", "127.0.0.1"):
        hosts.append(ray.util.get_node_ip_address())  # Ray listens there, and takes the other name for it
    reasons = [_silence(one, int(port)) for one in hosts]
    reason = _refusal(address) if "" in reasons else reasons[-1]
    if reason:
        problem = f"is not that of a running Ray cluster that answers within 20 s ({reason})"
        raise OptionError("address", address, "start one, or give another address", problem)


def _refusal(address: str) -> str:
    """Return the reason why a process cannot join a cluster in time; empty if it can."""
    command = [sys.executable, "-c", JOIN_SCRIPT, address]
    try:
        outcome = subprocess.run(command, capture_output=True, text=True, timeout=JOIN_TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        return "it does not let a process join"
    return "" if outcome.returncode == 0 else (outcome.stderr.strip().splitlines() or ["no reason given"])[-1]


def _silence(host: str, port: int) -> str:
    """Return the reason why there is no gRPC server; empty if there is one."""
    try:
        with socket.create_connection((host, port), timeout=ANSWER_TIMEOUT_S) as connection:
            connection.sendall(HTTP2_PREFACE)
            answer = connection.recv(64)
    except (OSError, OverflowError, UnicodeError) as error:
        return str(error)
    encrypted = os.environ.get("RAY_USE_TLS", "0") not in ("", "0")
    return "" if encrypted or answer[3:4] == SETTINGS else "it is something else"


def _cores(ray: Any) -> int:
    return max(int(ray.cluster_resources().get("CPU", 1)), 1)


def _result(ray: Any, reference: Any) -> Any:
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
    except ray.exceptions.RayError as error:
        reason = str(error).strip().splitlines()[0]
        raise WorkerError("Ray", f"lost a worker ({reason})", FEWER) from error


def _on_node(work: Work, job: Job, wanted: dict[str, str]) -> Any:
    """Run a job in a worker with the same software; other software could change the last bits of its results."""
    here = software()
    if here != wanted:
        raise OptionError("software of a Ray node", here, "install the same", f"differs from {wanted!r} here")
    return work(job, lambda *_: None)
