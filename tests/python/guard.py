"""Servers of tests outlive no test: guard.py FOLDER ends what runs for a folder once nothing more can come from standard
input, however who held its other end was ended, and removes the folder."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path


def processes_of(folder: str) -> list[int]:
    """Those that work in the folder or have a path of it in their environment, which what they start inherits."""
    mark, place, found = f"={folder}/".encode(), f"{os.path.realpath(folder)}/", []
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdigit() and (
                    f"{os.readlink(process / 'cwd')}/".startswith(place)
                    or any(mark in variable for variable in (process / "environ").read_bytes().split(b"\0"))):
                found.append(int(process.name))
        except OSError:  # it ended, or is another user's
            continue
    return found


class Guard:
    """Of a folder of this process."""

    def __init__(self, folder: Path) -> None:
        self._process = subprocess.Popen([sys.executable, __file__, str(folder)], stdin=subprocess.PIPE, start_new_session=True)

    def close(self) -> None:
        """Ends what is left, and removes the folder."""
        self._process.communicate()


def main() -> None:
    sys.stdin.read()
    folder, end = sys.argv[1], time.monotonic() + 30.0
    while (left := processes_of(folder)) and time.monotonic() < end:
        for process in left:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass
        time.sleep(0.02)
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
