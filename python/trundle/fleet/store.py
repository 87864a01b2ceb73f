"""The database: logs and reports of robots with their leases, and a row for each robot, run, parameter and finding.

Logs, and likewise reports, are claimed under a lease, which its worker renews while it lives; what is stored is stored by who still holds
the lease, together with the end of it in one transaction. So each log has one final row, whoever is killed when.
"""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, Optional, TypeVar

import sqlalchemy as sql
from sqlalchemy.dialects import postgresql, sqlite

from .logs import Log

T = TypeVar("T")

MOST_ATTEMPTS = 3  # of a log that fails: the first, and two more
MOST_LOSSES = 10  # leases that ended with their worker: beyond, the log is what kills it

_tables = sql.MetaData()
_text = sql.Text


def _queue(name: str) -> Iterable[Any]:
    """Columns of what is claimed and worked off."""
    yield sql.Column("request", _text, nullable=False)
    yield sql.Column("state", _text, nullable=False)  # waiting, leased, done, failed
    yield sql.Column("attempts", sql.Integer, nullable=False)
    yield sql.Column("losses", sql.Integer, nullable=False)
    yield sql.Column("lease", _text)
    yield sql.Column("lease_until_s", sql.Float)  # of the database's clock
    yield sql.Index(f"{name}_by_state", "request", "state", "losses", "id")


logs = sql.Table(
    "log", _tables,
    sql.Column("id", sql.Integer, primary_key=True),
    sql.Column("path", _text, nullable=False, unique=True),
    sql.Column("robot_file", _text, nullable=False),
    sql.Column("robot", _text, nullable=False),
    sql.Column("date", _text),
    *_queue("log"),
)
reports = sql.Table(
    "report", _tables,
    sql.Column("id", sql.Integer, primary_key=True),
    sql.Column("robot", _text, nullable=False, unique=True),
    sql.Column("shows", _text, nullable=False),  # canonical JSON of all that it is made of
    sql.Column("limits", _text, nullable=False),
    sql.Column("line", _text, nullable=False),  # why there is none
    sql.Column("html", sql.LargeBinary),  # by zlib
    *_queue("report"),
)
robots = sql.Table(
    "robot", _tables,
    sql.Column("name", _text, primary_key=True),
    sql.Column("type", _text, nullable=False),
    sql.Column("robot_file", _text, nullable=False),
)
runs = sql.Table(
    "run", _tables,
    sql.Column("log_id", sql.ForeignKey("log.id"), primary_key=True),
    sql.Column("log", _text, nullable=False),
    sql.Column("robot", _text, nullable=False, index=True),
    sql.Column("type", _text, nullable=False),
    sql.Column("date", _text),
    sql.Column("status", _text, nullable=False),  # done, failed
    sql.Column("line", _text, nullable=False),  # why it failed, or why nothing was calibrated
    sql.Column("log_sha256", _text, nullable=False),
    sql.Column("robot_sha256", _text, nullable=False),
    sql.Column("version", _text, nullable=False),
    sql.Column("limits", _text, nullable=False),
    sql.Column("duration_s", sql.Float),
    sql.Column("path_length_m", sql.Float),
    sql.Column("position_rms_before_m", sql.Float),
    sql.Column("position_rms_after_m", sql.Float),
    sql.Column("end_sigma_m", sql.Float),
    sql.Column("slip_events", sql.Integer),
    sql.Column("slip_share", sql.Float),
    sql.Column("document", _text, nullable=False),  # canonical JSON of all of it
)
parameters = sql.Table(
    "parameter", _tables,
    sql.Column("log_id", sql.ForeignKey("log.id"), primary_key=True),
    sql.Column("name", _text, primary_key=True),
    sql.Column("unit", _text, nullable=False),
    sql.Column("nominal", sql.Float, nullable=False),
    sql.Column("value", sql.Float, nullable=False),
    sql.Column("sigma", sql.Float, nullable=False),
    sql.Column("observable", sql.Boolean, nullable=False),
)
findings = sql.Table(
    "finding", _tables,
    sql.Column("log_id", sql.ForeignKey("log.id"), primary_key=True),
    sql.Column("number", sql.Integer, primary_key=True),
    sql.Column("severity", _text, nullable=False),
    sql.Column("kind", _text, nullable=False),
    sql.Column("place", _text, nullable=False),
    sql.Column("count", sql.Integer, nullable=False),
    sql.Column("message", _text, nullable=False),
)


class Claim(NamedTuple):
    id: int
    path: str
    robot_file: str
    robot: str
    date: Optional[str]
    attempts: int
    losses: int


class ReportClaim(NamedTuple):
    id: int
    robot: str
    shows: str
    attempts: int
    losses: int


_CLAIMS: dict[sql.Table, Any] = {logs: Claim, reports: ReportClaim}


def canonical(document: Any) -> str:
    return json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


class DatabaseUnreachable(ValueError):
    """Wrong address, or a server that is away for longer than the patience."""


class Store:
    """A connection pool, and the seconds that it waits for a server that is away."""

    def __init__(self, url: str, patience_s: float = 120.0) -> None:
        self.url, self.patience_s = url, patience_s
        try:
            parsed = sql.engine.make_url(url)
            self.is_sqlite = parsed.get_backend_name() == "sqlite"
            arguments = {"timeout": 60.0} if self.is_sqlite else {"connect_timeout": 10}
            self.engine = sql.create_engine(parsed, connect_args=arguments, pool_pre_ping=not self.is_sqlite)
        except (sql.exc.ArgumentError, ImportError) as error:
            raise DatabaseUnreachable(f"--database: {_one_line(error)}; expected sqlite:///FILE or postgresql://...") from None
        if self.is_sqlite:
            sql.event.listen(self.engine, "connect", _prepare_sqlite)
            sql.event.listen(self.engine, "begin", lambda connection: connection.exec_driver_sql("BEGIN IMMEDIATE"))

    def transact(self, work: Callable[[Any], T]) -> T:
        """Runs `work(connection)` as one transaction, again and again while the server is away.

        A connection that breaks during the commit leaves open whether it happened: `work` has to bear being done twice.
        """
        started, pause = time.monotonic(), 0.05
        while True:
            try:
                with self.engine.begin() as connection:
                    return work(connection)
            except (sql.exc.OperationalError, sql.exc.InterfaceError) as error:
                in_vain = self.is_sqlite and "locked" not in str(error)  # no server that could come back
                if in_vain or time.monotonic() - started > self.patience_s:
                    raise DatabaseUnreachable(f"{self.engine.url!r}: {_one_line(error)}; expected a database that answers") from None
            time.sleep(pause)
            pause = min(2.0 * pause, 2.0)

    def rows(self, statement: Any) -> list[Any]:
        def read(connection: Any) -> list[Any]:
            return list(connection.execute(statement))

        return self.transact(read)

    def change(self, statement: Any) -> None:
        def execute(connection: Any) -> None:
            connection.execute(statement)

        self.transact(execute)

    def create_tables(self) -> None:
        def create(connection: Any) -> None:
            if not self.is_sqlite:  # IF NOT EXISTS alone is not safe against a second client
                connection.execute(sql.text("SELECT pg_advisory_xact_lock(7468617)"))
            _tables.create_all(connection)

        self.transact(create)

    def now(self) -> Any:
        """The database's own clock [s]: those of workers may differ."""
        return sql.literal_column(
            "((julianday('now') - 2440587.5) * 86400.0)" if self.is_sqlite else "extract(epoch from clock_timestamp())::float8")

    def insert(self, table: Any) -> Any:
        return sqlite.insert(table) if self.is_sqlite else postgresql.insert(table)


def _one_line(error: BaseException) -> str:
    return str(getattr(error, "orig", None) or error).strip().splitlines()[0]


def _prepare_sqlite(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # SQLAlchemy begins, not the driver: BEGIN IMMEDIATE waits, an upgrade would fail
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=NORMAL")  # a crash of the machine may cost the last results, never the file


def register(store: Store, request: str, found: Iterable[Log], types: Callable[[Log], str]) -> None:
    """Puts logs to be looked at, and their robots. A log on which somebody works under a lease for the same request stays
    his; that of another request is taken over, so that all logs are in this one's count, and what he did is not stored."""
    everything = list(found)
    for start in range(0, len(everything), 500):
        some = everything[start : start + 500]
        store.transact(functools.partial(_register, store, request, some, types))


def _put(store: Store, table: sql.Table, key: str, request: str, rows: list[dict[str, Any]], connection: Any) -> None:
    """Rows to be worked off, from the first attempt on; but one on which somebody works under a lease for this request stays his."""
    fresh = [{**row, "request": request, "state": "waiting", "attempts": 0, "losses": 0} for row in rows]
    inserted = store.insert(table)
    changed = {name: inserted.excluded[name] for name in fresh[0] if name != key}
    leased = sql.and_(table.c.state == "leased", table.c.lease_until_s >= store.now(), table.c.request == request)
    connection.execute(inserted.on_conflict_do_update(index_elements=[key], set_={**changed, "lease": None}, where=~leased), fresh)


def _register(store: Store, request: str, found: list[Log], types: Callable[[Log], str], connection: Any) -> None:
    _put(store, logs, "path", request, [log._asdict() for log in found], connection)
    told_last = sorted(found, key=lambda log: bool(types(log)))  # a log without a robot file does not hide that of the others
    named = {log.robot: {"name": log.robot, "type": types(log), "robot_file": log.robot_file} for log in told_last}
    inserted = store.insert(robots)
    update = {name: inserted.excluded[name] for name in ("type", "robot_file")}
    connection.execute(inserted.on_conflict_do_update(index_elements=["name"], set_=update), list(named.values()))


def register_reports(store: Store, request: str, shows: dict[str, str], limits: str) -> int:
    """Puts those reports to be made, of `shows` by robot, that are not there as they shall be; returns how many. One that
    failed may do better under other limits."""
    def is_there(row: Any) -> bool:
        return row.shows == shows.get(row.robot) and (row.state == "done" or (row.state == "failed" and row.limits == limits))

    def put(connection: Any) -> int:
        columns = [reports.c[name] for name in ("robot", "shows", "state", "limits")]
        there = {row.robot for row in connection.execute(sql.select(*columns)) if is_there(row)}
        rows = [{"robot": robot, "shows": text, "limits": limits, "line": "", "html": None}
                for robot, text in shows.items() if robot not in there]
        for start in range(0, len(rows), 500):
            _put(store, reports, "robot", request, rows[start : start + 500], connection)
        return len(rows)

    return store.transact(put)


def claim(store: Store, request: str, lease: str, count: int, lease_s: float, table: sql.Table = logs) -> list[Any]:
    """Takes up to `count` logs, or reports, under one lease: those that wait, and those whose worker is gone."""
    return store.transact(functools.partial(_claim, store, request, lease, count, lease_s, table=table))


def _claim(store: Store, request: str, lease: str, count: int, lease_s: float, connection: Any, table: sql.Table = logs) -> list[Any]:
    now, c = store.now(), table.c
    expired = sql.and_(c.state == "leased", c.lease_until_s < now)
    free = (
        sql.select(c.id)
        .where(c.request == request, sql.or_(c.state == "waiting", expired))
        .order_by(c.losses, c.id)  # what lost its worker comes last: it shall not hold up the rest
        .limit(count)
        .with_for_update(skip_locked=True)  # left out by SQLite, whose transaction has the whole file
    )
    ids = [row.id for row in connection.execute(free)]
    if not ids:
        return []
    taken = c.id.in_(ids)
    lost = sql.case((c.state == "leased", c.losses + 1), else_=c.losses)
    connection.execute(table.update().where(taken).values(state="leased", losses=lost, lease=lease, lease_until_s=now + lease_s))
    kind = _CLAIMS[table]
    columns = [c[name] for name in kind._fields]
    return [kind(*row) for row in connection.execute(sql.select(*columns).where(taken).order_by(c.id))]


def _held(table: sql.Table, lease: str) -> Any:
    return sql.and_(table.c.lease == lease, table.c.state == "leased")


def renew(store: Store, lease: str, lease_s: float, table: sql.Table = logs) -> None:
    store.change(table.update().where(_held(table, lease)).values(lease_until_s=store.now() + lease_s))


def release(store: Store, lease: str, ids: list[int], *, attempts: int = 0, losses: int = 0, table: sql.Table = logs) -> None:
    """Puts work back, with so many more failed attempts, or processes that were lost at work on it."""
    c = table.c
    back = {"state": "waiting", "lease": None, "attempts": c.attempts + attempts, "losses": c.losses + losses}
    store.change(table.update().where(c.id.in_(ids), _held(table, lease)).values(back))


def finish_report(store: Store, lease: str, id: int, html: Optional[bytes], line: str) -> int:
    """Stores a report, or why there is none, and ends the lease; returns 1 where it was still held."""
    final = {"state": "failed" if html is None else "done", "lease": None, "html": html, "line": line}

    def end(connection: Any) -> int:
        return int(connection.execute(reports.update().where(reports.c.id == id, _held(reports, lease)).values(final)).rowcount)

    return store.transact(end)


def finished_reports(store: Store, shows: dict[str, str]) -> Iterable[tuple[str, Optional[bytes], str]]:
    """Robot, report and line of those that are there as they shall be; one at a time, as all of a fleet are large."""
    columns = [reports.c[name] for name in ("id", "robot", "shows", "line")]
    for row in store.rows(sql.select(*columns).where(reports.c.state.in_(("done", "failed"))).order_by(reports.c.robot)):
        if shows.get(row.robot) == row.shows:
            [(html,)] = store.rows(sql.select(reports.c.html).where(reports.c.id == row.id))
            yield row.robot, html, row.line


class Final(NamedTuple):
    """What is stored of a log; `run` None: nothing has changed, the rows that are there remain."""

    id: int
    state: str
    run: Optional[dict[str, Any]] = None
    parameters: list[dict[str, Any]] = []
    findings: list[dict[str, Any]] = []


def finish(store: Store, lease: str, finals: list[Final]) -> int:
    """Stores final rows and ends the leases; returns how many were still held."""
    return store.transact(functools.partial(_finish, lease, finals)) if finals else 0


def _finish(lease: str, finals: list[Final], connection: Any) -> int:
    held = []
    for final in finals:
        ended = connection.execute(logs.update().where(logs.c.id == final.id, _held(logs, lease)).values(state=final.state, lease=None))
        if ended.rowcount == 1:
            held.append(final)
    renewed = [final for final in held if final.run is not None]
    ids = [final.id for final in renewed]
    for table in (findings, parameters, runs):
        if ids:
            connection.execute(table.delete().where(table.c.log_id.in_(ids)))
    for table, rows in (
        (runs, [final.run for final in renewed]),
        (parameters, [row for final in renewed for row in final.parameters]),
        (findings, [row for final in renewed for row in final.findings]),
    ):
        if rows:
            connection.execute(table.insert(), rows)
    return len(held)


def known_runs(store: Store, ids: list[int]) -> dict[int, Any]:
    """What decides whether a log has changed since its final row."""
    names = ("log_id", "status", "robot", "date", "type", "log_sha256", "robot_sha256", "version", "limits")
    wanted = sql.select(*(runs.c[name] for name in names)).where(runs.c.log_id.in_(ids))
    return {row.log_id: row for row in store.rows(wanted)}


def failed_lines(store: Store, request: str, most: int) -> list[str]:
    """Why logs of a request failed, the first of them."""
    failed = sql.select(runs.c.line).join(logs, runs.c.log_id == logs.c.id).where(logs.c.request == request, logs.c.state == "failed")
    return [row.line for row in store.rows(failed.order_by(logs.c.path).limit(most))]


def progress(store: Store, request: str, table: sql.Table = logs) -> dict[str, int]:
    """Logs, or reports, of a request by their state."""
    counted = sql.select(table.c.state, sql.func.count()).where(table.c.request == request).group_by(table.c.state)
    return {state: number for state, number in store.rows(counted)}
