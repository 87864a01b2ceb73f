"""`python3 -m trundle.fleet`: the command line."""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import re
import sys
from typing import Any, Optional

import trundle

_EXAMPLE = """example:
  python3 -m trundle.fleet logs/ --database sqlite:///fleet.db -o fleet/
  python3 -m trundle.fleet logs/ --database postgresql://db/fleet --scheduler tcp://head:8786 -o fleet/
"""


_LINES = 3  # of logs that failed, on the terminal; all are in the database


def _shard(text: str) -> tuple[int, int]:
    try:
        number, of = map(int, text.split("/"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"is '{text}'; expected K/N, as 3/16") from None
    if not 1 <= number <= of:
        raise argparse.ArgumentTypeError(f"is '{text}'; expected K from 1 to N")
    return number, of


def _from(least: float, kind: type = int) -> "functools.partial[float]":
    def parse(least: float, kind: type, text: str) -> float:
        try:
            value: float = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"is '{text}'; expected a number") from None
        if not least <= value < 1e9:
            raise argparse.ArgumentTypeError(f"is {text}; expected at least {least:g}")
        return value

    return functools.partial(parse, least, kind)


def _address(text: str) -> str:
    """Looked at before Dask is, which takes 20 s to give up what it cannot read."""
    parts = re.fullmatch(r"(?:(?:tcp|tls|ws|wss)://)?(?:[^\s/:]+|\[[0-9A-Fa-f:.]+\]):(\d{1,5})", text)
    if parts is None or not 1 <= int(parts[1]) <= 65535:
        raise argparse.ArgumentTypeError(f"is '{text}'; expected HOST:PORT or tcp://HOST:PORT, tls, ws or wss alike")
    return text


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(
        prog="trundle-fleet", description="Calibration, health, slip and odometry of many logs, and what the fleet shows.",
        epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = made.add_argument
    add("logs", nargs="*", metavar="LOGS", help="folders, lists (.txt, .csv), patterns or logs; none: only -o, of what the database holds")
    add("--robot", metavar="FILE", help="robot.toml of all logs; without it, the one beside or above each")
    add("--database", required=True, metavar="URL", help="sqlite:///fleet.db is enough on one machine: a file, made where it is missing; for several postgresql://[USER@]HOST/NAME")
    add("--scheduler", type=_address, metavar="ADDRESS", help="of a Dask scheduler; without it, a cluster of this machine's processes")
    add("--workers", type=_from(0), default=2, metavar="N", help="processes of that cluster (2); 0: none, in this process without Dask")
    add("--shard", type=_shard, metavar="K/N", help="only the K-th of N parts of the logs: for arrays of jobs")
    add("--memory-limit-mb", type=_from(1), default=2048, metavar="MB", help="of one log, or report (2048)")
    add("--time-limit-s", type=_from(0.1, float), default=300.0, metavar="S", help="of one log, or report (300)")
    add("--lease-s", type=_from(1, float), default=30.0, metavar="S", help="after which the logs of a lost worker are others' (30)")
    add("-o", dest="output", metavar="FOLDER", help="write fleet.html, the CSV files and fleet.prom there")
    add("--reports", choices=("attention", "all", "none"), default="attention", help="which robots get a report of their own (attention)")
    add("--json", action="store_true", help="print the counts as one JSON document")
    add("--quiet", action="store_true", help="no progress")
    add("--version", action="version", version=trundle.__version__)
    return made


def _types_of() -> "functools._lru_cache_wrapper[str]":
    @functools.lru_cache(maxsize=None)
    def name_of(robot_file: str) -> str:
        try:
            return trundle.Robot(robot_file).name
        except ValueError:
            return ""  # each of its logs will say why

    return name_of


def _analyse(given: argparse.Namespace) -> tuple[dict[str, int], list[str]]:
    """The number of logs by their state, and the lines of the first that failed."""
    from . import engine, store
    from .host import Limits
    from .logs import find_logs, in_shard
    from .progress import Bar
    from .worker import Job

    if given.robot:
        trundle.Robot(given.robot)  # what is wrong with the one for all is said once, at once
    found = [log for log in find_logs(given.logs, given.robot) if given.shard is None or in_shard(log.path, *given.shard)]
    limits = Limits(given.memory_limit_mb, given.time_limit_s)
    request = hashlib.sha256(json.dumps([found, limits]).encode()).hexdigest()[:16]
    job = Job(given.database, request, limits, given.lease_s)
    database = store.Store(given.database, patience_s=10.0)
    database.create_tables()
    name_of = _types_of()
    store.register(database, request, found, lambda log: name_of(log.robot_file))
    with Bar(len(found), given.quiet) as bar:
        counts = engine.work_on(job, bar, workers=given.workers, scheduler=given.scheduler)
    if others := len(found) - sum(counts.values()):
        raise ValueError(f"{others} of {len(found)} logs were taken over by another call; expected one at a time on the same logs")
    return counts, store.failed_lines(database, request, _LINES)


def _make_reports(given: argparse.Namespace, database: Any, shows: dict[str, str]) -> None:
    from . import engine, reports, store
    from .host import Limits
    from .progress import Bar
    from .worker import Job

    limits = Limits(given.memory_limit_mb, given.time_limit_s)
    as_text = store.canonical(limits._asdict())
    request = reports.request_for(shows, as_text)
    if missing := store.register_reports(database, request, shows, as_text):
        job = Job(given.database, request, limits, given.lease_s, reports=True)
        with Bar(sum(store.progress(database, request, job.table).values()), given.quiet, "reports") as bar:
            engine.work_on(job, bar, workers=min(given.workers, missing), scheduler=given.scheduler)


def run(given: argparse.Namespace) -> int:
    if given.output:
        from .files import require_folder

        require_folder(given.output)  # before hours of work
    counts, lines = _analyse(given) if given.logs else ({}, [])
    done, failed = counts.get("done", 0), counts.get("failed", 0)
    if failed and not given.quiet:
        print(*(f"trundle-fleet: {line}" for line in lines), sep="\n", file=sys.stderr)
        print(f"trundle-fleet: {failed} of {done + failed} logs failed; their lines are in the table run", file=sys.stderr)
    document = {"program": "trundle-fleet", "version": trundle.__version__, "done": done, "failed": failed}
    if given.output:
        from .page import write_page

        document["outputs"], lines = write_page(given.database, given.output, given.reports, functools.partial(_make_reports, given))
        if lines and not given.quiet:
            print(*(f"trundle-fleet: {line}" for line in lines[:_LINES]), sep="\n", file=sys.stderr)
            print(f"trundle-fleet: reports of single robots that could not be made: {len(lines)}; their lines are in the table report", file=sys.stderr)
    if given.json:
        print(json.dumps(document))
    elif not given.quiet:
        for path in document.get("outputs", []):  # type: ignore[attr-defined]
            print(f"wrote {path}")
    return 3 if failed and not done else 0


def main(arguments: Optional[list[str]] = None) -> int:
    made = parser()
    given = made.parse_args(arguments)
    if not given.logs and not given.output:
        made.error("LOGS: none given; expected logs to work on, or -o FOLDER for the page of what the database holds")
    try:
        return run(given)
    except ImportError as missing:
        print(f"trundle-fleet: {missing}; expected Debian's python3-sqlalchemy, python3-distributed, python3-psycopg2", file=sys.stderr)
        return 3
    except (ValueError, OSError) as error:
        print(f"trundle-fleet: {str(error).splitlines()[0]}", file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        print("trundle-fleet: interrupted; the same command goes on where it was", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
