"""Keeps workers at work until every log, or report, has its final row: on Dask, or in this process.

Only counts go through the scheduler: a task is 'work off some logs', and what it finds goes to the database. So a
few tasks for each worker are enough at any time, and neither scheduler nor client grows with the fleet.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from typing import Any, Optional

from . import store
from .worker import Job, work_off

_LOGS_A_TASK = 64
_TASKS_A_WORKER = 2  # one that runs and one that waits
_LOOK_EACH_S = 0.5
_CONNECT_S = 10

Watch = Callable[[dict[str, int]], None]  # is told the number of logs by their state


def _unfinished(counts: dict[str, int]) -> int:
    return counts.get("waiting", 0) + counts.get("leased", 0)


def work_here(job: Job, database: store.Store, watch: Watch) -> dict[str, int]:
    """In this process, without Dask."""
    while True:
        counts = store.progress(database, job.request, job.table)
        watch(counts)
        if not _unfinished(counts):
            return counts
        if not work_off(job, _LOGS_A_TASK, 1.0):
            time.sleep(_LOOK_EACH_S)  # the rest is under leases of others


def _one_round(client: Any, job: Job, database: store.Store, watch: Watch, tasks: set[Any]) -> dict[str, int]:
    counts = store.progress(database, job.request, job.table)
    watch(counts)
    done = {task for task in tasks if task.done()}
    tasks -= done
    for task in done:
        if task.status == "error":
            task.result()  # raises what the worker did
    workers = len(client.scheduler_info()["workers"])
    wanted = min(_TASKS_A_WORKER * workers, _unfinished(counts))
    for _ in range(wanted - len(tasks)):
        tasks.add(client.submit(work_off, job, _LOGS_A_TASK, pure=False, retries=3))
    return counts


def _with_client(client: Any, job: Job, database: store.Store, watch: Watch) -> dict[str, int]:
    tasks: set[Any] = set()
    try:
        while _unfinished(counts := _one_round(client, job, database, watch, tasks)):
            if client.status not in ("running", "newly-created"):
                raise OSError("the scheduler is gone")
            time.sleep(_LOOK_EACH_S)
        return counts
    finally:
        for task in tasks:
            task.release()


def _require_certificates(address: str) -> None:
    """A client that has none where they are needed takes 20 s to end."""
    import dask
    from distributed.security import Security

    needed = address.startswith(("tls:", "wss:")) and not dask.config.get("distributed.client.security-loader", None)
    if needed and Security().get_connection_args("client").get("ssl_context") is None:
        raise ValueError(f"{address}: no certificates; expected distributed.comm.tls in Dask's configuration")


def work_on_scheduler(job: Job, database: store.Store, watch: Watch, address: str) -> dict[str, int]:
    """On workers of a scheduler that somebody else keeps; comes back to it while it is away, up to the patience. One that
    has never answered is given up at once."""
    from concurrent.futures import CancelledError

    from distributed import Client

    _require_certificates(address)
    for name in ("distributed.client", "distributed.utils", "distributed", "asyncio", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # a scheduler that goes away is expected here
    last = -math.inf

    def noting(counts: dict[str, int]) -> None:
        nonlocal last
        last = time.monotonic()
        watch(counts)

    while True:
        try:
            with Client(address, timeout=_CONNECT_S, set_as_default=False) as client:
                return _with_client(client, job, database, noting)
        except (OSError, TimeoutError, CancelledError) as error:  # CommClosedError is an OSError
            counts = store.progress(database, job.request, job.table)
            if not _unfinished(counts):
                return counts
            if time.monotonic() - last > job.patience_s:
                raise ValueError(f"{address}: {error}; expected a Dask scheduler that answers") from None
            time.sleep(1.0)


def work_on_cluster(job: Job, database: store.Store, watch: Watch, workers: int) -> dict[str, int]:
    """On a Dask cluster of this machine's processes, which ends with the work."""
    import dask
    from distributed import Client, LocalCluster

    dask.config.set({"distributed.worker.profile.enabled": False})  # it looks 100 times a second, and keeps an hour of it
    with LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0",
                      silence_logs=50, memory_limit=0) as cluster:
        with Client(cluster, set_as_default=False) as client:
            return _with_client(client, job, database, watch)


def work_on(job: Job, watch: Watch, *, workers: int, scheduler: Optional[str] = None) -> dict[str, int]:
    """Returns the number of logs, or reports, by their state: all of them done or failed."""
    database = store.Store(job.database, job.patience_s)
    if scheduler:
        return work_on_scheduler(job, database, watch, scheduler)
    if workers:
        return work_on_cluster(job, database, watch, workers)
    return work_here(job, database, watch)
