#!/usr/bin/env python3
"""Kills processes of trundle.fleet at random moments, RUNS times over LOGS logs: worker, the process in which it works,
scheduler, client, PostgreSQL, each restarted as a supervisor would. Every log must then have exactly one final row,
with the bytes of an undisturbed run; and no process may be left.

PYTHONPATH=build/python /usr/bin/python3 tools/fleet_kill.py [RUNS [LOGS [SEED]]]"""

from __future__ import annotations

import collections
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fleet_processes import ROBOT, children_of, end_as_asked, free_port, processes_with, start_client, start_scheduler, start_worker

import postgres
from fleet_logs import finals, make_logs
from trundle.fleet import store

_SHORT_M = 0.3  # of way: what is tested is the engine
_FIRST_S, _LAST_S = 1.0, 8.0  # between two kills: what was started has to have time to do something
TARGETS = ("worker", "host", "scheduler", "client", "postgresql")


class Fleet:
    """All processes of one run, and how each is started."""

    def __init__(self, folder: Path, logs: Path, server: postgres.Postgres) -> None:
        self.server, port = server, free_port()
        self.starts = {
            "scheduler": lambda: start_scheduler(port, folder),
            "worker 1": lambda: start_worker(port, folder),
            "worker 2": lambda: start_worker(port, folder),
            "client": lambda: start_client(port, folder, logs, server.url, "--lease-s", "2"),
        }
        self.processes: dict[str, subprocess.Popen[bytes]] = {name: begin() for name, begin in self.starts.items()}

    def restart_what_ended(self) -> bool:
        """As systemd would. Whether the client is done."""
        for name, process in self.processes.items():
            if process.poll() is not None:
                if name == "client" and process.returncode == 0:
                    return True
                self.processes[name] = self.starts[name]()
        return False

    def kill(self, target: str, draw: random.Random) -> bool:
        if target == "postgresql":
            self.server.kill()
            time.sleep(draw.uniform(0.0, 0.5))
            self.server.start()
            return True
        worker = self.processes[f"worker {draw.randint(1, 2)}"]
        if target == "host":
            hosts = children_of(worker.pid)
            for host in hosts:
                subprocess.run(["kill", "-9", str(host)], check=False)
            return bool(hosts)
        (worker if target == "worker" else self.processes[target]).kill()
        return True

    def close(self) -> None:
        for process in self.processes.values():
            process.kill()
            process.wait()


def disturbed_run(folder: Path, logs: Path, server: postgres.Postgres, draw: random.Random) -> collections.Counter[str]:
    store.Store(server.url).transact(lambda connection: store._tables.drop_all(connection))
    fleet, kills = Fleet(folder, logs, server), collections.Counter()
    next_kill = time.monotonic() + draw.uniform(2.0, 6.0)
    try:
        while not fleet.restart_what_ended():
            if time.monotonic() >= next_kill:
                target = draw.choice(TARGETS)
                kills[target] += fleet.kill(target, draw)
                next_kill = time.monotonic() + draw.uniform(_FIRST_S, _LAST_S)
            time.sleep(0.05)
    finally:
        fleet.close()
    return kills


def hosts_left(folder: Path) -> int:
    """Processes for work whose worker is gone: they end by themselves, within the log that they are at."""
    end = time.monotonic() + 20.0
    while (left := processes_with(str(folder), "trundle.fleet.host")) and time.monotonic() < end:
        time.sleep(0.2)
    return len(left)


def differences(found: list[list[str]], expected: list[list[str]]) -> list[str]:
    names = ("runs", "parameters", "findings")
    wrong = [(name, sorted(set(a) ^ set(b))) for name, a, b in zip(names, found, expected) if a != b]
    return [f"{name}: {rows[:2]}" for name, rows in wrong]


def main() -> int:
    end_as_asked()
    runs, count, seed = (int(value) for value in (sys.argv[1:] + ["20", "300", "1"][len(sys.argv) - 1 :]))
    folder, server = Path(tempfile.mkdtemp(prefix="fleet_kill_")), postgres.Postgres()
    bad, kills = 0, collections.Counter()
    try:
        server.start()
        make_logs(folder / "logs", range(1, count // 3 + 1), 3, ROBOT, _SHORT_M)
        # One that cannot be read, so that failed rows are compared too.
        (folder / "logs/robot_0001/2026-03-02/wheels.csv").write_text("time_s,left_ticks\n0,1\n")
        url = f"sqlite:///{folder}/undisturbed.db"
        subprocess.run([sys.executable, "-m", "trundle.fleet", str(folder / "logs"), "--database", url, "--quiet", "--workers", "2"], check=True)
        expected = finals(url)
        print(f"{len(expected[0])} logs, {sum('failed' in row for row in expected[0])} of them unreadable", flush=True)
        for run in range(runs):
            started = time.monotonic()
            killed = disturbed_run(folder, folder / "logs", server, random.Random(1000 * seed + run))
            kills += killed
            found = finals(server.url)
            wrong, left = differences(found, expected), hosts_left(folder)
            bad += bool(wrong or left)
            print(f"run {run + 1:2}: {sum(killed.values()):3} kills, {len(found[0])} final rows, "
                  f"{'DIFFERENT ' + str(wrong) if wrong else 'same bytes'}{f', {left} processes left' if left else ''}, {time.monotonic() - started:.0f} s", flush=True)
        print(f"{runs} runs of {len(expected[0])} logs, {sum(kills.values())} kills ({', '.join(f'{k} {v}' for k, v in sorted(kills.items()))}): "
              f"{runs - bad} with one final row for every log and the bytes of an undisturbed run")
    finally:
        server.close()
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
