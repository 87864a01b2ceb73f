"""Works off logs of the database: claim, look whether something has changed, compute, store; and reports of robots alike.
Dask's tasks are this."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import threading
import time
import uuid
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Optional

import trundle

from . import logs, store, work
from .host import Host, HostLost, Limits

_CLAIM = 8  # logs under one lease: what a claim and its storing cost is shared by them
_STORE_EACH_S = 2.0  # and what is done is stored at the latest after this time, so that little is lost


class Job(NamedTuple):
    """What a worker needs to know; small, as it goes through the scheduler."""

    database: str
    request: str
    limits: Limits
    lease_s: float = 30.0
    patience_s: float = 120.0
    reports: bool = False  # of robots, rather than logs

    @property
    def table(self) -> Any:
        """What is worked off."""
        return store.reports if self.reports else store.logs


@functools.lru_cache(maxsize=4)
def _store(database: str, patience_s: float) -> store.Store:
    return store.Store(database, patience_s)


_hosts = threading.local()  # one for each thread that works


def _host() -> Host:
    if not hasattr(_hosts, "host"):
        _hosts.host = Host()
    host: Host = _hosts.host
    return host


@contextlib.contextmanager
def _heartbeat(database: store.Store, lease: str, lease_s: float, table: Any = store.logs) -> Iterator[None]:
    done = threading.Event()

    def beat() -> None:
        while not done.wait(lease_s / 3.0):
            try:
                store.renew(database, lease, lease_s, table)
            except ValueError:  # the database is away: the lease ends, and the log is somebody else's
                continue

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _stamp(files: list[str]) -> list[tuple[str, int, int]]:
    stats = [(file, Path(file).stat()) for file in files]
    return [(file, stat.st_size, stat.st_mtime_ns) for file, stat in stats]


@functools.lru_cache(maxsize=1)
def _version() -> str:
    """Of what computes: two builds of one version may differ."""
    code = hashlib.sha256()
    for file in (trundle._trundle.__file__, trundle.__file__, work.__file__):
        code.update(Path(file).read_bytes())
    return f"{trundle.__version__} {code.hexdigest()[:16]}"


def _is_unchanged(known: Any, row: dict[str, Any]) -> bool:
    """A final row of the same bytes by the same version. What failed may do better under other limits."""
    same = ("robot", "date", "log_sha256", "robot_sha256", "version") + (("limits",) if known.status == "failed" else ())
    return all(getattr(known, name) == row[name] for name in same)


def _failed(claim: store.Claim, row: dict[str, Any], line: str) -> store.Final:
    document = store.canonical({"line": line})
    run = {**row, "type": "", "status": "failed", "line": line, "document": document}
    return store.Final(claim.id, "failed", run)


_MEASURES = ("duration_s", "path_length_m", "position_rms_before_m", "position_rms_after_m", "end_sigma_m", "slip_events", "slip_share")


def _done(claim: store.Claim, row: dict[str, Any], document: dict[str, Any]) -> store.Final:
    run = {**row, "type": document["type"], "status": "done", "line": document["line"],
           **{name: document[name] for name in _MEASURES}, "document": store.canonical(document)}
    parameters = [{"log_id": claim.id, **parameter} for parameter in document["parameters"]]
    findings = [{"log_id": claim.id, "number": i, **finding} for i, finding in enumerate(document["findings"])]
    return store.Final(claim.id, "done", run, parameters, findings)


def _without_answer(claim: store.Claim, row: dict[str, Any], line: str) -> Optional[store.Final]:
    """None: it will be tried again."""
    return _failed(claim, row, line) if claim.attempts + 1 >= store.MOST_ATTEMPTS else None


def _look_at(claim: store.Claim, known: Any, job: Job) -> Optional[store.Final]:
    row = {"log_id": claim.id, "log": claim.path, "robot": claim.robot, "date": claim.date, "version": _version(),
           "limits": store.canonical(job.limits._asdict()), "log_sha256": "", "robot_sha256": "",
           **dict.fromkeys(_MEASURES)}
    if claim.losses >= store.MOST_LOSSES:
        return _failed(claim, row, f"{claim.path}: {claim.losses} workers ended while they worked on it")
    if not claim.robot_file:
        return _failed(claim, row, f"{claim.path}: no robot.toml beside or above it; expected one, or --robot FILE")
    try:
        files = logs.files_of(claim.path)
        before = _stamp([*files, claim.robot_file])
        row["log_sha256"] = logs.sha256_of(files, logs.folder_of(claim.path))
        row["robot_sha256"] = logs.sha256_of([claim.robot_file], Path(claim.robot_file).parent)
        if known is not None and _is_unchanged(known, row):
            return store.Final(claim.id, known.status)
        answer = _host().ask(claim.path, claim.robot_file, job.limits)
        if _stamp([*files, claim.robot_file]) != before:
            answer = {"line": f"{claim.path}: changed while it was read"}
    except OSError as error:
        answer = {"line": f"{error.filename or claim.path}: {error.strerror or error}"}
    if "document" in answer:
        return _done(claim, row, answer["document"])
    return _without_answer(claim, row, answer["line"])


def _work_on_claims(database: store.Store, job: Job, lease: str, claims: list[store.Claim]) -> int:
    known = store.known_runs(database, [claim.id for claim in claims])
    finals: list[store.Final] = []
    stored, last = 0, time.monotonic()
    for claim in claims:
        try:
            final = _look_at(claim, known.get(claim.id), job)
        except HostLost:  # as if this worker had been
            store.release(database, lease, [claim.id], losses=1)
            continue
        if final is None:
            store.release(database, lease, [claim.id], attempts=1)
        else:
            finals.append(final)
        if time.monotonic() - last > _STORE_EACH_S:
            stored += store.finish(database, lease, finals)
            finals, last = [], time.monotonic()
    return stored + store.finish(database, lease, finals)


def _make_report(database: store.Store, job: Job, lease: str, claim: store.ReportClaim) -> int:
    if claim.losses >= store.MOST_LOSSES:
        line = f"report of {claim.robot}: {claim.losses} workers ended while they made it"
        return store.finish_report(database, lease, claim.id, None, line)
    try:
        answer = _host().ask_report(claim.robot, json.loads(claim.shows), job.limits)
    except HostLost:
        store.release(database, lease, [claim.id], losses=1, table=store.reports)
        return 0
    if "document" in answer:
        return store.finish_report(database, lease, claim.id, zlib.compress(answer["document"].encode()), "")
    if claim.attempts + 1 >= store.MOST_ATTEMPTS:
        return store.finish_report(database, lease, claim.id, None, answer["line"])
    store.release(database, lease, [claim.id], attempts=1, table=store.reports)
    return 0


def work_off(job: Job, most: int, most_s: float = 20.0) -> int:
    """Works on logs, or reports, of a request until none is left to claim, or for about so many or so long. Returns how many
    are final."""
    database = _store(job.database, job.patience_s)
    at_once = 1 if job.reports else _CLAIM
    started, stored, claimed = time.monotonic(), 0, 0
    while claimed < most and time.monotonic() - started < most_s:
        lease = uuid.uuid4().hex
        claims = store.claim(database, job.request, lease, min(at_once, most - claimed), job.lease_s, job.table)
        if not claims:
            break
        claimed += len(claims)
        with _heartbeat(database, lease, job.lease_s, job.table):
            stored += _make_report(database, job, lease, claims[0]) if job.reports else _work_on_claims(database, job, lease, claims)
    return stored
