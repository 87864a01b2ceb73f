"""A PostgreSQL server of Debian in a folder of its own, run by a user without privileges; for tests and tools."""

from __future__ import annotations

import glob
import os
import pwd
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from guard import Guard

PROGRAMS = sorted(glob.glob("/usr/lib/postgresql/*/bin/postgres"))


class Postgres:
    """Listens on a socket in its folder alone, and outlives this process no more than its folder does. fsync is off: what is tested is the death of processes, not of the machine.
    A database that is to be kept has a place of its own, and is used again if there is one."""

    def __init__(self, kept: Path | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="fleet_pg_"))
        self._data = kept or self.folder / "data"
        self._guard = Guard(self.folder)
        self._programs = Path(PROGRAMS[-1]).parent
        self._as: dict[str, Any] = {"env": {**os.environ, "FLEET_SERVER": f"{self.folder}/"}}  # what the guard knows it by
        self._data.mkdir(exist_ok=True)
        if os.geteuid() == 0:  # which the server refuses
            nobody = pwd.getpwnam("nobody")
            for folder in (self.folder, self._data):
                os.chown(folder, nobody.pw_uid, nobody.pw_gid)
            self._as |= {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}
        self._process: Any = None
        if not (self._data / "PG_VERSION").exists():
            self._call("initdb", "-D", str(self._data), "-U", "fleet", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")
        self.url = f"postgresql://fleet@/postgres?host={self.folder}"

    def _call(self, program: str, *arguments: str) -> None:
        done = subprocess.run([str(self._programs / program), *arguments], capture_output=True, text=True, cwd="/", **self._as)
        if done.returncode != 0:
            raise RuntimeError(f"{program}: {done.stdout}{done.stderr}")

    def _answers(self) -> bool:
        ready = [str(self._programs / "pg_isready"), "-h", str(self.folder), "-q"]
        return subprocess.run(ready, cwd="/", check=False).returncode == 0

    def start(self) -> None:
        command = [str(self._programs / "postgres"), "-D", str(self._data), "-k", str(self.folder), "-c", "listen_addresses=",
                   "-c", "fsync=off", "-c", "shared_buffers=16MB"]
        end = time.monotonic() + 60.0
        while time.monotonic() < end:
            with open(self.folder / "log", "ab") as log:
                self._process = subprocess.Popen(command, stdout=log, stderr=log, cwd="/", **self._as)
            while self._process.poll() is None:
                if self._answers():
                    return
                time.sleep(0.05)
            time.sleep(0.2)  # processes of a server that was killed are not all gone yet
        raise RuntimeError((self.folder / "log").read_text()[-1000:])

    @property
    def pid(self) -> int:
        return int(self._process.pid)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)  # fast shutdown
            self._process.wait(30)
        self._guard.close()
