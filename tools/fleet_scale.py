#!/usr/bin/env python3
"""What the engine of trundle.fleet costs: ROBOTS simulated robots with three logs of a minute each, on PostgreSQL, a
scheduler and two workers of this machine. Prints time of the processor against that of the work alone, time in all,
and the memory of each process while it goes. The work alone is measured in between, while the engine is stopped: a machine
that others share is not as fast at the end as it was at the beginning.

PYTHONPATH=build/python /usr/bin/python3 tools/fleet_scale.py [ROBOTS]"""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.pool
import os
import shutil
import signal
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Iterable, Iterator

from fleet_processes import ROBOT, children_of, cpu_s, end_as_asked, free_port, memory_mb, start_client, start_scheduler, start_worker

import postgres
import sqlalchemy
from fleet_logs import make_logs
from trundle.fleet import store
from trundle.fleet.logs import find_logs
from trundle.fleet.work import analyse

LOGS = 3
_WORKERS = 2
_SAMPLE = 8  # logs of each loop of work alone: seconds, well below a lease
_BETWEEN_S = 40.0
_PRINT_S = 5.0


def analyse_some(logs: list[tuple[str, str]]) -> float:
    """Seconds of the processor for a log, in a plain loop."""
    start = time.process_time()
    for path, robot_file in logs:
        analyse(path, robot_file)
    return (time.process_time() - start) / len(logs)


class WorkAlone:
    """In as many plain loops at once as there are workers: two threads of one core take longer over the same work than one,
    with or without an engine."""

    def __init__(self, folder: Path, pool: multiprocessing.pool.Pool) -> None:
        self.logs = [(log.path, log.robot_file) for log in find_logs([str(folder)])]
        self.pool = pool
        self.each_s: list[float] = []
        pool.map(analyse_some, [self.logs[:1]] * _WORKERS, chunksize=1)  # its first call is longer
        self.measure()

    def measure(self) -> None:
        first = len(self.each_s) * _WORKERS * _SAMPLE
        samples = [[self.logs[(first + k * _SAMPLE + i) % len(self.logs)] for i in range(_SAMPLE)] for k in range(_WORKERS)]
        self.each_s.append(statistics.mean(self.pool.map(analyse_some, samples, chunksize=1)))


@contextlib.contextmanager
def stopped(pids: Iterable[int]) -> Iterator[None]:
    """Processes that do nothing meanwhile."""
    def send(what: signal.Signals) -> None:
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, what)

    send(signal.SIGSTOP)
    try:
        yield
    finally:
        send(signal.SIGCONT)


def watch(client, named: dict[str, int], database: store.Store, alone: WorkAlone) -> tuple[dict[str, float], float]:
    """Prints memory now and then; returns seconds of the processor by process, and in all, without those of the work alone."""
    started, cpu, next_line, next_sample, paused = time.monotonic(), {}, 0.0, 0.5 * _BETWEEN_S, 0.0
    print(f"{'time s':>7} {'logs':>7} " + " ".join(f"{name:>12}" for name in [*named, "host 1", "host 2"]) + "   (MB)")
    while client.poll() is None:
        hosts = [child for name in ("worker 1", "worker 2") for child in children_of(named[name])]
        processes = {**named, **{f"host {i + 1}": pid for i, pid in enumerate(hosts)}}
        cpu.update({name: cpu_s(pid) for name, pid in processes.items() if cpu_s(pid)})
        passed = time.monotonic() - started - paused
        if passed >= next_sample:
            start = time.monotonic()
            with stopped([*processes.values(), *(child for pid in hosts for child in children_of(pid))]):
                alone.measure()
            next_sample += _BETWEEN_S
            paused += time.monotonic() - start
        if passed >= next_line:
            done = sum(number for state, number in database.rows(
                sqlalchemy.select(store.logs.c.state, sqlalchemy.func.count()).group_by(store.logs.c.state)) if state in ("done", "failed"))
            print(f"{passed:7.0f} {done:7d} " + " ".join(f"{memory_mb(pid):12.1f}" for pid in processes.values()), flush=True)
            next_line = max(passed + _PRINT_S, 1.25 * passed)
        time.sleep(0.5)
    return cpu, time.monotonic() - started - paused


def main() -> None:
    end_as_asked()
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    folder, server, processes = Path(tempfile.mkdtemp(prefix="fleet_scale_")), postgres.Postgres(), []
    pool = multiprocessing.get_context("spawn").Pool(_WORKERS)
    try:
        server.start()
        start = time.process_time()
        make_logs(folder / "logs", range(1, robots + 1), LOGS, ROBOT)
        total = robots * LOGS
        print(f"{robots} robots, {total} logs of a minute; simulated in {time.process_time() - start:.0f} s of the processor")
        alone = WorkAlone(folder / "logs", pool)
        store.Store(server.url).create_tables()
        port = free_port()
        processes = [start_scheduler(port, folder), start_worker(port, folder), start_worker(port, folder)]
        client = start_client(port, folder, folder / "logs", server.url)
        processes.append(client)
        named = {"client": client.pid, "scheduler": processes[0].pid, "worker 1": processes[1].pid, "worker 2": processes[2].pid}
        cpu, wall = watch(client, named, store.Store(server.url), alone)
        cpu["PostgreSQL"] = cpu_s(server.pid) + sum(cpu_s(child) for child in children_of(server.pid))
        counts = dict(store.Store(server.url).rows(sqlalchemy.select(store.runs.c.status, sqlalchemy.func.count()).group_by(store.runs.c.status)))
        print(f"rows: {counts}; exit {client.returncode}")
        alone.measure()
        each, scatter = statistics.mean(alone.each_s), statistics.stdev(alone.each_s) / len(alone.each_s) ** 0.5
        done = sum(counts.values())  # all, unless the client was ended before
        work, whole = each * done, sum(cpu.values())
        print("seconds of the processor: " + ", ".join(f"{name} {seconds:.1f}" for name, seconds in cpu.items()))
        print(f"work alone {1e3 * each:.1f} ± {1e3 * scatter:.1f} ms a log, by {len(alone.each_s)} samples in between, {work:.0f} s in all; with the engine {whole:.0f} s: {100 * (whole / work - 1):.1f} ± {100 * whole / work * scatter / each:.1f} % more")
        print(f"{wall:.0f} s in all, {done / wall:.1f} logs/s; 10 000 robots at this rate: {3e4 / (done / wall) / 3600:.2f} h")
    finally:
        pool.terminate()
        for process in processes:
            process.kill()
            process.wait()
        server.close()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
