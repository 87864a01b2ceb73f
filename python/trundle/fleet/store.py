"""The database: logs with their leases, and a row for each robot, run, parameter and finding.

Logs are claimed under a lease, which its worker renews while it lives; what is stored is stored by who still holds
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
logs = sql.Table(
    "log", _tables,
    sql.Column("id", sql.Integer, primary_key=True),
    sql.Column("path", _text, nullable=False, unique=True),
    sql.Column("robot_file", _text, nullable=False),
    sql.Column("robot", _text, nullable=False),
    sql.Column("date", _text),
    sql.Column("request", _text, nullable=False),
    sql.Column("state", _text, nullable=False),  # waiting, leased, done, failed
    sql.Column("attempts", sql.Integer, nullable=False),
    sql.Column("losses", sql.Integer, nullable=False),
    sql.Column("lease", _text),
    sql.Column("lease_until_s", sql.Float),  # of the database's clock
    sql.Index("log_by_state", "request", "state", "losses", "id"),
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


def _register(store: Store, request: str, found: list[Log], types: Callable[[Log], str], connection: Any) -> None:
    rows = [{**log._asdict(), "request": request, "state": "waiting", "attempts": 0, "losses": 0} for log in found]
    inserted = store.insert(logs)
    new = inserted.excluded
    leased = sql.and_(logs.c.state == "leased", logs.c.lease_until_s >= store.now(), logs.c.request == request)
    changed = {name: new[name] for name in ("robot_file", "robot", "date", "request", "state", "attempts", "losses")}
    connection.execute(
        inserted.on_conflict_do_update(index_elements=["path"], set_={**changed, "lease": None}, where=~leased), rows)
    told_last = sorted(found, key=lambda log: bool(types(log)))  # a log without a robot file does not hide that of the others
    named = {log.robot: {"name": log.robot, "type": types(log), "robot_file": log.robot_file} for log in told_last}
    inserted = store.insert(robots)
    update = {name: inserted.excluded[name] for name in ("type", "robot_file")}
    connection.execute(inserted.on_conflict_do_update(index_elements=["name"], set_=update), list(named.values()))


def claim(store: Store, request: str, lease: str, count: int, lease_s: float) -> list[Claim]:
    """Takes up to `count` logs under one lease: those that wait, and those whose worker is gone."""
    return store.transact(functools.partial(_claim, store, request, lease, count, lease_s))


def _claim(store: Store, request: str, lease: str, count: int, lease_s: float, connection: Any) -> list[Claim]:
    now = store.now()
    expired = sql.and_(logs.c.state == "leased", logs.c.lease_until_s < now)
    free = (
        sql.select(logs.c.id)
        .where(logs.c.request == request, sql.or_(logs.c.state == "waiting", expired))
        .order_by(logs.c.losses, logs.c.id)  # what lost its worker comes last: it shall not hold up the rest
        .limit(count)
        .with_for_update(skip_locked=True)  # left out by SQLite, whose transaction has the whole file
    )
    ids = [row.id for row in connection.execute(free)]
    if not ids:
        return []
    taken = logs.c.id.in_(ids)
    lost = sql.case((logs.c.state == "leased", logs.c.losses + 1), else_=logs.c.losses)
    connection.execute(logs.update().where(taken).values(state="leased", losses=lost, lease=lease, lease_until_s=now + lease_s))
    columns = [logs.c[name] for name in Claim._fields]
    return [Claim(*row) for row in connection.execute(sql.select(*columns).where(taken).order_by(logs.c.id))]


def renew(store: Store, lease: str, lease_s: float) -> None:
    held = sql.and_(logs.c.lease == lease, logs.c.state == "leased")
    store.change(logs.update().where(held).values(lease_until_s=store.now() + lease_s))


def release(store: Store, lease: str, ids: list[int], *, attempts: int = 0, losses: int = 0) -> None:
    """Puts logs back, with so many more failed attempts, or processes that were lost at work on them."""
    held = sql.and_(logs.c.id.in_(ids), logs.c.lease == lease, logs.c.state == "leased")
    back = {"state": "waiting", "lease": None, "attempts": logs.c.attempts + attempts, "losses": logs.c.losses + losses}
    store.change(logs.update().where(held).values(back))


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
        mine = sql.and_(logs.c.id == final.id, logs.c.lease == lease, logs.c.state == "leased")
        ended = connection.execute(logs.update().where(mine).values(state=final.state, lease=None))
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


def progress(store: Store, request: str) -> dict[str, int]:
    """Logs of a request by their state."""
    counted = sql.select(logs.c.state, sql.func.count()).where(logs.c.request == request).group_by(logs.c.state)
    return {state: number for state, number in store.rows(counted)}
