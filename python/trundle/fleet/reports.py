"""Reports of single robots, below the fleet page: made by the workers, kept in the database, and made anew where what they
show has changed."""

from __future__ import annotations

import hashlib
import re
import zlib
from pathlib import Path
from typing import Optional

from . import store
from .files import write
from .summary import Run


def shown_by(runs: list[Run], robot_file: str) -> Optional[str]:
    """All that the report of a robot is made of, as canonical JSON; None where no run was calibrated."""
    calibrated_on = [run for run in runs if run.parameters]
    if not calibrated_on:
        return None
    last = next(run for run in reversed(runs) if run.status == "done")
    return store.canonical({"robot_file": robot_file, "calibrated_on": [run.log for run in calibrated_on], "last": last.log,
                            "digests": [run.digests for run in (*calibrated_on, last)]})


def request_for(shows: dict[str, str], limits: str) -> str:
    """The same for the same command, so that it goes on where one before it was ended."""
    return hashlib.sha256(store.canonical([shows, limits]).encode()).hexdigest()[:16]


def write_reports(database: store.Store, shows: dict[str, str], folder: Path) -> tuple[dict[str, str], list[str]]:
    """Paths below the folder by robot; and why some robots have none."""
    links, lines = {}, []
    for robot, html, line in store.finished_reports(database, shows):
        if html is None:
            lines.append(line)
            continue
        links[robot] = f"robots/{re.sub('[^A-Za-z0-9_.-]', '_', robot)}_{zlib.crc32(robot.encode()):08x}.html"
        write(folder / links[robot], zlib.decompress(html).decode())
    return links, lines
