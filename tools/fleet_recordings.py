#!/usr/bin/env python3
"""The real recordings as one fleet: what trundle.fleet makes of logs as different as they are. Every data set of DATA is laid
out as tools/run_all.py does, other people's log files as `trundle init` drafts them, and all of it given as one list, with the
dates of sessions, to the engine in this process on SQLite. Prints a table of the data sets, the lines of what failed or could
not be calibrated, and what the page says of robots; or writes them between the marks of PAGE.md.

PYTHONPATH=build/python /usr/bin/python3 tools/fleet_recordings.py [DATA [PAGE.md]]"""

from __future__ import annotations

import collections
import contextlib
import csv
import datetime
import io
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any, Iterable, Iterator, NamedTuple, Optional

import run_all
import sqlalchemy
import trundle
from fleet_processes import ROOT, cpu_s
from trundle.fleet import host, store, worker
from trundle.fleet.__main__ import main as fleet
from trundle.fleet.logs import find_logs

BEGIN, END = "<!-- fleet_recordings: begin -->", "<!-- fleet_recordings: end -->"
FAULTS_PUT_IN = ("kobuki_injected", "omni3_clean", "omni3_injected")  # made from recordings that are here already
GROUPS = ("slam", "slip")  # folders of data sets
SURFACES = {"ice": "2024-07-30", "gravel": "2024-08-06", "asphalt": "2024-09-25"}  # as the files' names say


class Given(NamedTuple):
    """A row of the list."""

    log: str
    robot_file: str
    robot: str
    date: str = ""
    robot_number: str = ""

    @property
    def found_as(self) -> str:
        return self.log + (f"#{self.robot_number}" if self.robot_number else "")


def day_of(log: Path) -> str:
    """Of a session's name, 231220200040: day, month, year, and the time."""
    surface = next((day for name, day in SURFACES.items() if name in log.parts), "")
    found = re.search(r"/(\d\d)(\d\d)(20\d\d)\d{4}/", str(log))
    return datetime.date(*map(int, reversed(found.groups()))).isoformat() if found else surface


def drafts(data: Path, out: Path) -> Iterator[Given]:
    """Other people's log files, each of another robot."""
    for log in sorted((data / "logs").glob("*.*")):
        if log.suffix != ".txt":
            folder = out / "logs" / log.name
            trundle.init(log, folder)
            yield Given(str(folder), str(folder / "robot.toml"), log.stem + log.suffix.replace(".", "_"))


def recordings(data: Path, out: Path) -> dict[str, list[Given]]:
    """Of each data set."""
    with contextlib.redirect_stdout(io.StringIO()):
        run_all.lay_out(data, out)
    sets: dict[str, list[Given]] = collections.defaultdict(list)
    for log in find_logs([str(out)]):
        name, surface, *_ = (part for part in (*Path(log.path).relative_to(out).parts, "") if part not in GROUPS)
        if name not in (*FAULTS_PUT_IN, "mrclam"):
            sets[f"{name}, {surface}" if surface in SURFACES else name].append(Given(log.path, log.robot_file, name, day_of(Path(log.path))))
    layout = data / "mrclam/MRCLAM_Dataset6"
    sets["mrclam"] = [Given(str(layout), str(out / "slam/mrclam/robot.toml"), f"mrclam_{number}", "", str(number)) for number in range(1, 6)]
    sets["logs"] = list(drafts(data, out))
    return dict(sorted(sets.items()))


class Timed(host.Host):
    """Seconds of the processor by log: of the process that works on it, and of its children."""

    def __init__(self) -> None:
        super().__init__()
        self.seconds: dict[str, float] = collections.defaultdict(float)

    def _used(self) -> float:
        return cpu_s(self._process.pid) if self._process is not None else 0.0

    def ask(self, log: str, robot_file: str, limits: host.Limits) -> dict[str, Any]:
        before = self._used()
        answer = super().ask(log, robot_file, limits)
        self.seconds[log] += self._used() - before
        return answer


class Result(NamedTuple):
    code: int
    seconds: dict[str, float]  # by log
    runs: dict[str, Any]  # rows of the database by log
    findings: dict[str, int]
    folder: Path  # of the page


def run(sets: dict[str, list[Given]], work: Path) -> Result:
    """All of them as one fleet, in this process."""
    listed, url = work / "list.csv", f"sqlite:///{work}/fleet.db"
    with open(listed, "w", newline="") as lines:
        writer = csv.writer(lines)
        writer.writerow(Given._fields)
        writer.writerows(row for rows in sets.values() for row in rows)
    worker._hosts.host = timed = Timed()
    try:
        code = fleet([str(listed), "--database", url, "--workers", "0", "--reports", "none", "-o", str(work / "page"), "--quiet"])
    finally:
        del worker._hosts.host
        timed.close()
    database = store.Store(url)
    paths = {row.id: row.path for row in database.rows(sqlalchemy.select(store.logs))}
    counted = sqlalchemy.select(store.findings.c.log_id, sqlalchemy.func.count()).group_by(store.findings.c.log_id)
    return Result(code, timed.seconds, {row.log: row for row in database.rows(sqlalchemy.select(store.runs))},
                  {paths[id]: number for id, number in database.rows(counted)}, work / "page")


def table(sets: dict[str, list[Given]], found: Result) -> Iterator[str]:
    yield "| data set | logs | done | of which calibrated | failed | findings | processor, s |"
    yield "|---|---|---|---|---|---|---|"
    sums = [0.0] * 6
    for name, given in sets.items():
        runs = [found.runs[one.found_as] for one in given]
        done = [run for run in runs if run.status == "done"]
        row = [len(runs), len(done), sum(not run.line for run in done), len(runs) - len(done),
               sum(found.findings.get(run.log, 0) for run in runs), sum(found.seconds[run.log] for run in runs)]
        sums = [a + b for a, b in zip(sums, row)]
        yield f"| {name} | " + " | ".join(f"{value:.0f}" if i < 5 or value >= 10.0 else f"{value:.1f}" for i, value in enumerate(row)) + " |"
    yield "| all | " + " | ".join(f"{value:.0f}" for value in sums) + " |"


class Said(NamedTuple):
    """The line of some logs of a data set; where nothing was calibrated what it begins with, without its numbers."""

    data_set: str
    status: str
    logs: list[str]
    line: str


def said_in(sets: dict[str, list[Given]], found: Result) -> list[Said]:
    all_said: dict[tuple[str, str, str], list[str]] = {}
    for name, given in sets.items():
        for one in given:
            run = found.runs[one.found_as]
            line = re.sub(rf"^(run )?({re.escape(one.log)}|{re.escape(os.path.basename(one.log))})[/:] ?", "", run.line)
            if line:
                key = name, run.status, re.sub(r"(?<!\w)-?\d[\d.e+-]*", "…", line.split(": ")[0]) if run.status == "done" else line
                all_said.setdefault(key, []).append(os.path.basename(one.log))
    return [Said(name, status, logs, line) for (name, status, line), logs in all_said.items()]


def lines_of(some: list[Said]) -> Iterator[str]:
    yield "| data set | logs | | line |"
    yield "|---|---|---|---|"
    for one in sorted(some, key=lambda one: (one.status != "failed", one.data_set, -len(one.logs))):
        logs = ", ".join(one.logs) if len(one.logs) < 5 and one.data_set == "logs" else str(len(one.logs))
        yield f"| {one.data_set} | {logs} | {'failed' if one.status == 'failed' else 'not calibrated'} | {one.line.replace('|', '/')} |"


def change_in_words(change: dict[str, str]) -> str:
    size, sigma, unit = (change[key] for key in (("step", "sigma", "unit") if change["kind"] == "step" else ("slope", "slope_sigma", "slope_unit")))
    return f"{change['robot']}: {change['parameter']} {float(size):+.3f} ± {float(sigma):.3f} {unit} since {change['since']}"


def told(found: Result) -> Iterator[str]:
    """What the page says of robots."""
    def rows_of(name: str) -> list[dict[str, str]]:
        with open(found.folder / name, newline="", encoding="utf-8") as rows:
            return list(csv.DictReader(rows))

    robots = rows_of("robots.csv")
    named = {reason: [row["robot"] for row in robots if reason in row["attention"].split()] for reason in ("change", "outlier", "run", "warning", "run_needed", "failed")}
    yield f"Of {len(robots)} robots need attention: " + ", ".join(
        f"{reason.replace('_', ' ')} {len(some)}{' (' + ', '.join(some) + ')' if reason in ('change', 'outlier', 'run') and some else ''}" for reason, some in named.items()) + "."
    yield from (f"- {change_in_words(change)}" for change in rows_of("changes.csv"))


def page_of(sets: dict[str, list[Given]], found: Result) -> str:
    parts: Iterable[Iterable[str]] = (
        [f"Made on {datetime.date.today()} by `tools/fleet_recordings.py` ({trundle.__version__})."],
        table(sets, found),
        lines_of(said_in(sets, found)),
        told(found))
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def main(data: Path, page: Optional[Path]) -> int:
    with tempfile.TemporaryDirectory(prefix="fleet_recordings_") as folder:
        sets = recordings(data.resolve(), Path(folder, "out"))
        found = run(sets, Path(folder))
        text = page_of(sets, found)
    if page is None:
        print(text, end="")
    else:
        head, rest = page.read_text(encoding="utf-8").split(BEGIN)
        page.write_text(f"{head}{BEGIN}\n\n{text}\n{END}{rest.split(END)[1]}", encoding="utf-8")
    return found.code


if __name__ == "__main__":
    if len(sys.argv) > 3:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared/data", Path(sys.argv[2]) if len(sys.argv) > 2 else None))
