"""Processes of a fleet on this machine, for fleet_scale.py and fleet_kill.py: scheduler, workers, and what they use."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/python"))
ROBOT = ROOT / "data/demo/robot.toml"
_TICK = os.sysconf("SC_CLK_TCK")


def end_as_asked() -> None:
    """SIGTERM and SIGINT run what stands under `finally`, from a shell's background too, where SIGINT is ignored."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: sys.exit(1))


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def start(*words: str, log: Path) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "FLEET_FOLDER": str(log.parent), "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False"}  # as docs/fleet.md says
    with open(log, "ab") as out:
        return subprocess.Popen([sys.executable, "-m", *words], stdout=out, stderr=out, stdin=subprocess.DEVNULL, env=environment)


def start_scheduler(port: int, folder: Path) -> subprocess.Popen[bytes]:
    return start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", log=folder / "scheduler.log")


def start_worker(port: int, folder: Path) -> subprocess.Popen[bytes]:
    return start("distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-nanny", "--no-dashboard",
                 "--death-timeout", "30", "--memory-limit", "0", "--local-directory", str(folder), log=folder / "worker.log")


def start_client(port: int, folder: Path, logs: Path, url: str, *more: str) -> subprocess.Popen[bytes]:
    return start("trundle.fleet", str(logs), "--database", url, "--scheduler", f"tcp://127.0.0.1:{port}", *more, log=folder / "client.log")


def _fields(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()


def children_of(pid: int) -> list[int]:
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and int(_fields(int(folder.name))[1]) == pid:
                found.append(int(folder.name))
        except (OSError, IndexError):
            continue  # it ended
    return found


def processes_with(mark: str, words: str) -> list[int]:
    """Those whose environment has the mark, and whose command line has the words."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and mark in (folder / "environ").read_bytes().decode(errors="replace"):
                if words in (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace"):
                    found.append(int(folder.name))
        except OSError:
            continue  # it ended, or is another user's
    return found


def cpu_s(pid: int, with_ended_children: bool = True) -> float:
    try:
        own = list(map(int, _fields(pid)[11:15]))
    except OSError:
        return 0.0
    return sum(own if with_ended_children else own[:2]) / _TICK


def memory_mb(pid: int) -> float:
    """Private and its part of what is shared: forks share most of what they have."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024.0 for line in lines if line.startswith("Pss:")), 0.0)
