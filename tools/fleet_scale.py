#!/usr/bin/env python3
"""What the engine of trundle.fleet costs: ROBOTS simulated robots with three logs of a minute each, on PostgreSQL, a
scheduler and two workers of this machine. Prints time of the processor against that of the work alone, time in all,
and the memory of each process while it goes. The work alone is measured in between, while the engine is stopped: a machine
that others share is not as fast at the end as it was at the beginning. With a FOLDER, logs, database and sums are kept:
what was ended, by Ctrl-C too, is gone on with, and the last line counts all sittings.

PYTHONPATH=build/python /usr/bin/python3 tools/fleet_scale.py [ROBOTS [FOLDER]]"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import multiprocessing.pool
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Iterable, Iterator, NamedTuple

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


class Sums(NamedTuple):
    logs: int
    wall_s: float
    cpu_s: dict[str, float]
    work_s: float  # of the processor, in a plain loop
    work_sigma_s: float
    samples: int

    def print(self) -> None:
        whole = sum(self.cpu_s.values())
        if self.logs == 0:
            return
        print("seconds of the processor: " + ", ".join(f"{name} {seconds:.1f}" for name, seconds in self.cpu_s.items()))
        print(f"work alone {1e3 * self.work_s / self.logs:.1f} ± {1e3 * self.work_sigma_s / self.logs:.1f} ms a log, by {self.samples} samples in between, "
              f"{self.work_s:.0f} s in all; with the engine {whole:.0f} s: {100 * (whole / self.work_s - 1):.1f} ± {100 * whole / self.work_s * self.work_sigma_s / self.work_s:.1f} % more")
        rate = self.logs / self.wall_s
        print(f"{self.wall_s:.0f} s in all, {rate:.1f} logs/s; 10 000 robots at this rate: {1e4 * LOGS / rate / 3600:.2f} h")


class Sitting:
    """What the processes took, from its making on; without what the work alone took in between."""

    def __init__(self, named: dict[str, int], database: store.Store, alone: WorkAlone) -> None:
        self.named, self.database, self.alone = named, database, alone
        self.cpu: dict[str, float] = {}
        self._started, self._paused = time.monotonic(), 0.0
        self._before = self._final()

    def _final(self) -> int:
        return sum(number for state, number in self.database.rows(
            sqlalchemy.select(store.logs.c.state, sqlalchemy.func.count()).group_by(store.logs.c.state)) if state in ("done", "failed"))

    @property
    def wall_s(self) -> float:
        return time.monotonic() - self._started - self._paused

    def _measure_alone(self) -> None:
        start = time.monotonic()
        self.alone.measure()
        self._paused += time.monotonic() - start

    def watch(self, client: subprocess.Popen[bytes]) -> None:
        """Till the client ends, or this process is asked to. Prints memory now and then."""
        next_line, next_sample = 0.0, 0.5 * _BETWEEN_S
        print(f"{'time s':>7} {'logs':>7} " + " ".join(f"{name:>12}" for name in [*self.named, "host 1", "host 2"]) + "   (MB)")
        while client.poll() is None:
            hosts = [child for name in ("worker 1", "worker 2") for child in children_of(self.named[name])]
            processes = {**self.named, **{f"host {i + 1}": pid for i, pid in enumerate(hosts)}}
            self.cpu.update({name: cpu_s(pid) for name, pid in processes.items() if cpu_s(pid)})
            if self.wall_s >= next_sample:
                with stopped([*processes.values(), *(child for pid in hosts for child in children_of(pid))]):
                    self._measure_alone()
                next_sample += _BETWEEN_S
            if self.wall_s >= next_line:
                print(f"{self.wall_s:7.0f} {self._final():7d} " + " ".join(f"{memory_mb(pid):12.1f}" for pid in processes.values()), flush=True)
                next_line = max(self.wall_s + _PRINT_S, 1.25 * self.wall_s)
            time.sleep(0.5)

    def sums(self) -> Sums:
        """Of the work alone there are two samples at least."""
        self._measure_alone()
        each, logs = self.alone.each_s, self._final() - self._before
        scatter = statistics.stdev(each) / len(each) ** 0.5
        return Sums(logs, self.wall_s, self.cpu, statistics.mean(each) * logs, scatter * logs, len(each))


def sum_of(sittings: list[Sums]) -> Sums:
    cpu: dict[str, float] = {}
    for sitting in sittings:
        for name, seconds in sitting.cpu_s.items():
            cpu[name] = cpu.get(name, 0.0) + seconds
    return Sums(sum(s.logs for s in sittings), sum(s.wall_s for s in sittings), cpu, sum(s.work_s for s in sittings),
                sum(s.work_sigma_s**2 for s in sittings) ** 0.5, sum(s.samples for s in sittings))


def main() -> None:
    end_as_asked()
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    kept = Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else None
    folder = Path(tempfile.mkdtemp(prefix="fleet_scale_"))
    place = kept or folder  # of logs and sums
    place.mkdir(exist_ok=True)
    server, processes = postgres.Postgres(kept and kept / "database"), []
    pool = multiprocessing.get_context("spawn").Pool(_WORKERS, signal.signal, (signal.SIGINT, signal.SIG_IGN))  # Ctrl-C is for this process
    try:
        server.start()
        start, there = time.process_time(), len(list(place.glob("logs/robot_*")))
        make_logs(place / "logs", range(max(1, there), robots + 1), LOGS, ROBOT)
        print(f"{robots} robots, {robots * LOGS} logs of a minute; simulated in {time.process_time() - start:.0f} s of the processor", flush=True)
        alone = WorkAlone(place / "logs", pool)
        database = store.Store(server.url)
        database.create_tables()
        port = free_port()
        processes = [start_scheduler(port, folder), start_worker(port, folder), start_worker(port, folder)]
        client = start_client(port, folder, place / "logs", server.url)
        processes.append(client)
        sitting = Sitting({"client": client.pid, "scheduler": processes[0].pid, "worker 1": processes[1].pid, "worker 2": processes[2].pid}, database, alone)
        with contextlib.suppress(SystemExit):  # ended as asked: what there is is counted
            sitting.watch(client)
        sitting.cpu["PostgreSQL"] = cpu_s(server.pid) + sum(cpu_s(child) for child in children_of(server.pid))
        counts = dict(database.rows(sqlalchemy.select(store.runs.c.status, sqlalchemy.func.count()).group_by(store.runs.c.status)))
        print(f"rows: {counts}; exit {client.poll()}")
        sums = place / "sittings.json"
        sittings = [Sums(**one) for one in json.loads(sums.read_text())] if sums.exists() else []
        sittings.append(sitting.sums())
        sums.write_text(json.dumps([one._asdict() for one in sittings]))
        sittings[-1].print()
        if len(sittings) > 1:
            print(f"in {len(sittings)} sittings, {sum_of(sittings).logs} logs:")
            sum_of(sittings).print()
    finally:
        pool.terminate()
        for process in processes:
            process.kill()
            process.wait()
        server.close()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
