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


def _robot_file(log: Path, root: Path) -> Optional[Path]:
    """robot.toml in the log's folder, or the nearest above it, not above the root."""
    for folder in [log, *log.parents]:
        if (folder / "robot.toml").is_file():
            return folder / "robot.toml"
        if folder == root:
            break
    return None


def _robot_name(log: Path, robot_file: Path, root: Path) -> str:
    """The folder of the robot's own file where that lies between root and log; else the first folder below the root."""
    home = robot_file.parent
    if home != root and home != log and root in home.parents:
        return str(home.relative_to(root))
    below = log.relative_to(root).parts
    return below[0] if len(below) > 1 else root.name


def _logs_below(folder: Path) -> Iterator[Path]:
    try:
        yield from map(Path, _trundle.recordings_below(folder))
    except ValueError:
        pass  # it holds none as folders; perhaps as files
    for parent, folders, names in os.walk(folder):
        folders.sort()
        if not Path(parent, "metadata.yaml").exists():  # a rosbag2 is one log
            yield from (Path(parent, name) for name in sorted(names) if Path(name).suffix.lower() in _LOG_SUFFIXES)


def _from_list(file: Path) -> Iterator[dict[str, str]]:
    """A path on each line, or a table with the columns log, robot_file, robot, date, all but the first optional."""
    with open(file, encoding="utf-8", newline="") as lines:
        rows = [line for line in lines.read().splitlines() if line.strip() and not line.startswith("#")]
    head = rows[0].split(",") if rows else []
    if "log" not in head:
        rows, head = [f'"{row}"' for row in rows], ["log"]
    else:
        rows = rows[1:]
    for row in csv.DictReader(rows, fieldnames=head):
        yield {key: value for key, value in row.items() if key and value}


def _candidates(given: str) -> tuple[Path, list[dict[str, str]]]:
    """The root that robots are named below, and the logs of one argument."""
    place = Path(given)
    if place.suffix in (".txt", ".csv", ".list") and place.is_file():
        rows = list(_from_list(place))
        root = place.resolve().parent
        return root, [{**row, "log": str(root / row["log"])} for row in rows]
    if place.is_dir():
        return place.resolve(), [{"log": str(path)} for path in _logs_below(place.resolve())]
    found = sorted(glob.glob(given, recursive=True))
    if not found:
        raise ValueError(f"{given}: does not exist; expected a folder, a list, a log or a pattern")
    fixed = [part for part in Path(given).parts]
    stars = next((i for i, part in enumerate(fixed) if glob.has_magic(part)), len(fixed) - 1)
    return Path(*fixed[:stars]).resolve() if stars else Path.cwd(), [{"log": str(Path(path).resolve())} for path in found]


def find_logs(given: Iterable[str], robot_file: Optional[str] = None) -> list[Log]:
    """All logs of folders, lists, patterns, each once, by the order of their paths."""
    logs: dict[str, Log] = {}
    for argument in given:
        root, rows = _candidates(argument)
        for row in rows:
            path = Path(row["log"])
            one_for_it = row.get("robot_file", robot_file)
            own = (root / one_for_it if "robot_file" in row else Path(one_for_it).resolve()) if one_for_it else _robot_file(path, root)
            if own is None:
                raise ValueError(f"{path}: no robot.toml beside or above it; expected one, or --robot FILE")
            within = root if root in path.parents else path.parent
            robot = row.get("robot") or _robot_name(path, own, within)
            logs[str(path)] = Log(str(path), str(own), robot, row.get("date") or date_of(str(path)))
    if not logs:
        raise ValueError(f"{', '.join(given)}: no log; expected recordings as `trundle info` reads them")
    return [logs[path] for path in sorted(logs)]


def in_shard(path: str, number: int, of: int) -> bool:
    """Whether a log is in shard `number` (from 1) of `of`. By its path alone, so that shards need not know each other."""
    return zlib.crc32(path.encode()) % of == number - 1


def _mapped_files(tables: Any) -> Iterator[str]:
    for key, value in tables.items() if isinstance(tables, dict) else ():
        if key in ("file", "tuple_file") and isinstance(value, str):
            yield value
        else:
            yield from _mapped_files(value)


def files_of(log: str) -> list[str]:
    """All files that reading a log may open."""
    path = Path(log)
    folder = path if path.is_dir() else path.parent
    if path.is_file():
        files = {path} | {map for map in [folder / "recording.toml"] if map.is_file()}
    else:
        files = {file for file in folder.iterdir() if file.is_file()}
    recording_map = folder / "recording.toml"
    if recording_map in files:
        try:
            tables = tomllib.loads(recording_map.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError):
            tables = {}  # who reads the log will say so
        for name in _mapped_files(tables) if path.is_dir() else ():
            matched = folder.glob(name) if glob.has_magic(name) and not Path(name).is_absolute() else [folder / name]
            files.update(file for file in matched if file.is_file())
    return sorted(map(str, files))


def sha256_of(files: Iterable[str], relative_to: str) -> str:
    """Of names, lengths and bytes of files."""
    whole = hashlib.sha256()
    for file in files:
        with open(file, "rb") as content:
            digest = hashlib.file_digest(content, "sha256").hexdigest()
        whole.update(f"{os.path.relpath(file, relative_to)}\0{digest}\n".encode())
    return whole.hexdigest()
