"""Which logs there are, whose they are and of which day, and what of them has changed."""

from __future__ import annotations

import csv
import datetime
import glob
import hashlib
import os
import re
import tomllib
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, Optional

from trundle import _trundle

_LOG_SUFFIXES = {".bag", ".mcap", ".wpilog", ".db3", ".ulg", ".bin", ".tuple"}
_DATE = re.compile(r"(?<!\d)(20\d\d)[-_]?(0[1-9]|1[0-2])[-_]?(0[1-9]|[12]\d|3[01])(?!\d)")


class Log(NamedTuple):
    path: str
    robot_file: str
    robot: str
    date: Optional[str]  # ISO 8601; None: not known


def date_of(path: str) -> Optional[str]:
    """The last date that stands in a path, as 2026-03-03 or 20260303."""
    for found in reversed(list(_DATE.finditer(path))):
        try:
            return datetime.date(*map(int, found.groups())).isoformat()
        except ValueError:  # 30 February
            continue
    return None


def _robot_file(log: Path) -> Optional[Path]:
    """robot.toml in the log's folder, or the nearest above it."""
    return next((file for folder in [log, *log.parents] if (file := folder / "robot.toml").is_file()), None)


def _robot_name(log: Path, robot_file: Optional[Path]) -> str:
    """By the log's path and its robot.toml alone, so that it is the same however the log was given."""
    folder = log if log.is_dir() else log.parent
    if robot_file is not None and robot_file.parent in folder.parents:
        return robot_file.parent.name
    return next((above.name for above in log.parents if above.name and date_of(above.name) is None), log.parent.name)


def _recordings_below(folder: Path, seen: set[str]) -> Iterator[Path]:
    """A recording.toml that cannot be read hides no other recording: its own is found, and fails with the line."""
    real = os.path.realpath(folder)
    if real in seen:
        return
    seen.add(real)
    try:
        yield from map(Path, _trundle.recordings_below(folder))
    except ValueError:  # there is none, or some recording.toml cannot be read
        if (folder / "recording.toml").exists():
            yield folder
            return
        for below in sorted(folder.iterdir(), key=lambda path: (path.is_symlink(), path)):
            if below.is_dir():
                yield from _recordings_below(below, seen)


def _is_rosbag2(folder: Path) -> bool:
    return (folder / "metadata.yaml").exists() and any(file.suffix in (".db3", ".mcap") for file in folder.iterdir())


def _logs_below(root: Path) -> Iterator[Path]:
    """Recordings, and logs that none of them reads. What is below a recording belongs to it."""
    if _is_rosbag2(root):
        yield root
        return
    recordings = set(_recordings_below(root, set()))
    yield from recordings
    places = {path if path.is_dir() else path.parent for path in recordings}
    mapped = {place: _mapped_by(place / "recording.toml") for place in places}
    read = {os.path.realpath(file) for files in mapped.values() for file in files}  # by whatever path a recording names it
    for place, folders, names in os.walk(root):
        folder = Path(place)
        bags = {name for name in folders if _is_rosbag2(folder / name)}
        logs = {folder / name for name in (*bags, *names) if name in bags or Path(name).suffix.lower() in _LOG_SUFFIXES}
        if folder in places:
            logs = logs if mapped[folder] else set()
            bags.update(folders)
        folders[:] = set(folders) - bags
        yield from (log for log in logs - recordings if os.path.realpath(log) not in read)


def _rows_of(file: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Of a list, with the numbers of its lines: a path on each, or in a .csv a table with a column log and perhaps more."""
    try:
        text = file.read_text(encoding="utf-8-sig")  # sheets write a mark before it
    except UnicodeDecodeError:
        raise ValueError(f"{file}: is not in UTF-8; expected a list of logs in it") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if file.suffix != ".csv":
        yield from ((i, {"log": line.strip()}) for i, line in lines)
        return
    number, first = lines[0] if lines else (1, "")
    comma = max(",;\t", key=first.count)
    table = csv.reader((line for _, line in lines), delimiter=comma, skipinitialspace=True)
    head, *rows = [[cell.strip() for cell in row] for row in table] or [[]]
    if "log" not in head:
        raise ValueError(f"{file}:{number}: has no column 'log'; expected log, and perhaps robot_file, robot, date, robot_number")
    for (number, _), row in zip(lines[1:], rows):
        yield number, {key: value for key, value in zip(head, row) if value}


def _checked(row: dict[str, str], place: str) -> dict[str, str]:
    """A row of a list, whose date is an ISO 8601 one."""
    if "log" not in row:
        raise ValueError(f"{place}: has no log; expected a path in the column 'log'")
    if "date" in row:
        try:
            day = datetime.datetime.fromisoformat(row["date"])
        except ValueError:
            raise ValueError(f"{place}: date is '{row['date']}'; expected one as 2026-03-04") from None
        row["date"] = (day if "T" in row["date"] or " " in row["date"] else day.date()).isoformat()
    if not re.fullmatch("[1-9][0-9]{0,5}", row.get("robot_number", "1")):
        raise ValueError(f"{place}: robot_number is '{row['robot_number']}'; expected 1 or more")
    return row


def _given(argument: str) -> Iterator[tuple[Path, dict[str, str]]]:
    """The paths of an argument, and what a list says of them."""
    places = [argument] if os.path.exists(argument) else sorted(glob.glob(argument, recursive=True))
    if not places:
        raise ValueError(f"{argument}: does not exist; expected a folder, a list, a log or a pattern")
    for place in map(Path, places):
        if place.suffix not in (".txt", ".csv", ".list") or not place.is_file():
            yield place, {}
            continue
        for number, row in _rows_of(place):
            row = _checked(row, f"{place}:{number}")
            if "robot_file" in row:
                row["robot_file"] = str(place.parent / row["robot_file"])
            yield place.parent / row["log"], row


def _absolute(path: str | Path) -> Path:
    return Path(os.path.abspath(path))  # not resolved: a link may be what names a robot


def _log(path: Path, row: dict[str, str], of_all: Optional[str]) -> Log:
    named = row.get("robot_file", of_all)
    found = None if named else _robot_file(path)
    number = f"#{row['robot_number']}" if "robot_number" in row else ""
    own = str(_absolute(named)) if named else str(found or "")
    robot = row.get("robot") or _robot_name(path, found) + number
    one_place = os.path.join(os.path.realpath(path.parent), path.name)  # whichever way leads to it
    return Log(one_place + number, own, robot, row.get("date") or date_of(str(path)))


def find_logs(given: Iterable[str], robot_file: Optional[str] = None) -> list[Log]:
    """All logs of folders, lists, patterns, each once, by the order of their paths."""
    logs: dict[str, Log] = {}
    for argument in given:
        for place, row in _given(argument):
            path = _absolute(place)
            below = [] if "robot_number" in row or not path.is_dir() else list(_logs_below(path))
            for log in below or ([path] if row or not path.is_dir() else []):
                found = _log(log, row, robot_file)
                logs[found.path] = found
    if not logs:
        raise ValueError(f"{', '.join(given)}: no log; expected recordings as `trundle info` reads them")
    return [logs[path] for path in sorted(logs)]


def path_and_number(log: str) -> tuple[str, int]:
    """Of a log of several robots, as folder#3, which of them is meant; 0: it is one robot's."""
    path, mark, number = log.rpartition("#")
    return (path, int(number)) if mark and number.isdecimal() and not os.path.exists(log) else (log, 0)


def in_shard(path: str, number: int, of: int) -> bool:
    """Whether a log is in shard `number` (from 1) of `of`. By its path alone, so that shards need not know each other."""
    return zlib.crc32(path.encode()) % of == number - 1


def _mapped_names(tables: Any) -> Iterator[str]:
    for key, value in tables.items() if isinstance(tables, dict) else ():
        if key in ("file", "tuple_file") and isinstance(value, str):
            yield value
        else:
            yield from _mapped_names(value)


def _mapped_by(recording_map: Path) -> list[Path]:
    """The files and folders that a recording.toml names; none where it cannot be read: who reads the log will say so."""
    try:
        tables = tomllib.loads(recording_map.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError):
        return []
    folder, found = recording_map.parent, []
    for name in _mapped_names(tables):
        found += folder.glob(name) if glob.has_magic(name) and not Path(name).is_absolute() else [folder / name]
    return found


def _files_in(folder: Path) -> list[Path]:
    return [file for file in folder.iterdir() if file.is_file() and not file.name.startswith(".")]


def folder_of(log: str) -> Path:
    path = Path(path_and_number(log)[0])
    return path if path.is_dir() else path.parent


def files_of(log: str) -> list[str]:
    """All files that reading a log may open."""
    path, folder = Path(path_and_number(log)[0]), folder_of(log)
    recording_map = folder / "recording.toml"
    if path.is_file():
        return sorted(str(file) for file in (path, recording_map) if file.is_file())
    files = set(_files_in(folder))
    for named in _mapped_by(recording_map):
        files.update(_files_in(named) if named.is_dir() else [named] if named.is_file() else [])
    return sorted(map(str, files))


def sha256_of(files: Iterable[str], folder: Path) -> str:
    """Of one file its own; of several that of what sha256sum prints of them in the folder."""
    digests = {}
    for file in files:
        with open(file, "rb") as content:
            digests[os.path.relpath(file, folder)] = hashlib.file_digest(content, "sha256").hexdigest()
    if len(digests) == 1:
        return next(iter(digests.values()))
    return hashlib.sha256("".join(f"{digests[name]}  {name}\n" for name in sorted(digests)).encode()).hexdigest()
