"""What the database holds, brought together: each robot's parameters, their changes, and what stands out."""

from __future__ import annotations

import datetime
from typing import Any, NamedTuple, Optional

import numpy
import sqlalchemy as sql

from . import drift, outliers, population, series, store
from .distributions import Array, normal_tails
from .needs import runs_for

_YEAR_DAYS = 365.25
_DRIFTS_ANYWAY = ("gyro.bias",)  # differs from day to day: its changes are no news


class Run(NamedTuple):
    log: str
    robot: str
    type: str
    date: Optional[str]
    status: str
    line: str
    warnings: int
    measures: dict[str, Any]
    parameters: dict[str, Any]  # rows by name


class RobotParameter(NamedTuple):
    """NaN: not known."""

    value: float
    sigma: float
    low: float
    high: float
    z: float  # in the population
    outlying: bool


class TypeParameter(NamedTuple):
    name: str
    unit: str
    nominal: float
    robots: list[str]
    estimates: list[RobotParameter]
    fit: Optional[population.Population]
    run_spread: float
    changes: list[tuple[str, Run, drift.Change]]  # robot, the first run after it
    outlying_runs: list[tuple[Run, float]]  # with z


class Fleet(NamedTuple):
    robots: dict[str, list[Run]]  # runs by date
    parameters: dict[str, list[TypeParameter]]  # by type


def load(database: store.Store) -> dict[str, list[Run]]:
    """Each robot's runs by their dates."""
    rows = database.rows(sql.select(store.runs))
    parameters: dict[int, dict[str, Any]] = {}
    for row in database.rows(sql.select(store.parameters)):
        parameters.setdefault(row.log_id, {})[row.name] = row
    counted = sql.select(store.findings.c.log_id, sql.func.count()).where(store.findings.c.severity == "warning")
    warnings = {log_id: number for log_id, number in database.rows(counted.group_by(store.findings.c.log_id))}
    types = {row.name: row.type for row in database.rows(sql.select(store.robots))}
    measures = ("duration_s", "path_length_m", "position_rms_before_m", "position_rms_after_m", "end_sigma_m", "slip_events", "slip_share")
    robots: dict[str, list[Run]] = {}
    for row in sorted(rows, key=lambda row: (row.robot, row.date or "", row.log)):
        run = Run(row.log, row.robot, row.type or types.get(row.robot, ""), row.date, row.status, row.line, warnings.get(row.log_id, 0),
                  {name: row[name] for name in measures}, parameters.get(row.log_id, {}))
        robots.setdefault(row.robot, []).append(run)
    return robots


def _arrays(robots: list[list[Run]], name: str) -> tuple[Array, Array, list[list[Run]]]:
    """x and s2 [robot, run] of a parameter, and the runs that have it."""
    having = [[run for run in runs if name in run.parameters and run.parameters[name].observable] for runs in robots]
    shape = (len(robots), max(map(len, having), default=0))
    x, s2 = numpy.zeros(shape), numpy.full(shape, numpy.inf)
    for i, runs in enumerate(having):
        for j, run in enumerate(runs):
            x[i, j], s2[i, j] = run.parameters[name].value, run.parameters[name].sigma ** 2
    return x, s2, having


def _years(runs: list[Run]) -> float:
    """From the first to the last run; 0 where a date is not known: then no change is looked for."""
    if len(runs) < 2 or any(run.date is None for run in runs):
        return 0.0
    first, last = (datetime.date.fromisoformat(str(run.date)[:10]) for run in (runs[0], runs[-1]))
    return (last - first).days / _YEAR_DAYS


def _changes(x: Array, s2: Array, having: list[list[Run]], tested: int) -> dict[int, list[drift.Change]]:
    """By row. Of the false alarms of a robot-year each of its parameters has its part."""
    omega2, degrees = series.robust_run_spread(x, s2)
    limits = numpy.full(len(x), numpy.inf)
    for i, runs in enumerate(having):
        years = _years(runs)
        if years > 0.0:
            limits[i] = drift.with_degrees(drift.limit_for(len(runs), drift.FALSE_ALARMS * years / tested), degrees)
    variance = s2 + omega2
    rows: list[int] = numpy.flatnonzero(drift.suspects(x, variance, limits)).tolist() if x.shape[1] > 1 else []
    return {i: drift.changes(x[i, : len(having[i])], variance[i, : len(having[i])], limits[i]) for i in rows}


def _segments(shape: tuple[int, ...], changes: dict[int, list[drift.Change]]) -> Array:
    segment = numpy.zeros(shape)
    for i, found in changes.items():
        for change in found:
            segment[i, change.first :] += 1.0
    return segment


def _outlying_runs(x: Array, s2: Array, segment: Array) -> tuple[Array, Array]:
    """Which runs stand out, and z of all."""
    omega2, degrees = series.robust_run_spread(x, s2)
    y, v = series.robot_means(x, s2, numpy.asarray(omega2))
    if numpy.isfinite(v).sum() < 4:
        return numpy.zeros(x.shape, bool), numpy.full(x.shape, numpy.nan)
    mean, spread = population.robust_fit(y, v)
    z = outliers.run_scores(x, s2, omega2, float(mean), float(spread), segment)
    p = numpy.full(z.shape, numpy.nan)
    seen = numpy.isfinite(z)
    p[seen] = outliers.tails(z[seen], degrees) if degrees > 0.0 else normal_tails(z[seen])
    return outliers.rejected(p.ravel()).reshape(x.shape), z


def _estimates(x: Array, s2: Array) -> tuple[list[RobotParameter], Optional[population.Population], float]:
    """Each robot's value; the population's, without the robots that stand out."""
    omegas = series.run_spreads(x, s2)
    means = [series.robot_means(x, s2, omega2) for omega2 in omegas]
    y, v = numpy.stack([m for m, _ in means]), numpy.stack([var for _, var in means])
    middle = len(omegas) // 2
    own, variance = y[middle], v[middle]
    seen = numpy.isfinite(variance)
    z, outlying = numpy.full(own.shape, numpy.nan), numpy.zeros(own.shape, bool)
    if seen.sum() >= 4:
        z, p = outliers.robot_scores(own, variance)
        outlying = outliers.rejected(p)
    sigma = numpy.where(seen, numpy.sqrt(numpy.where(seen, variance, 0.0)), numpy.nan)
    value = numpy.where(seen, own, numpy.nan)
    low, high, fit = value - 1.96 * sigma, value + 1.96 * sigma, None
    usual = ~outlying
    if (seen & usual).sum() >= 3:
        fit = population.fit(y[:, usual], v[:, usual])
        shrunken = population.shrink(y[:, usual], v[:, usual])
        for mine, theirs in zip((value, sigma, low, high), shrunken):
            mine[usual] = theirs
    rows = zip(*(column.tolist() for column in (value, sigma, low, high, z, outlying)))
    return [RobotParameter(*row) for row in rows], fit, float(numpy.sqrt(omegas[middle]))


def _type_parameter(name: str, names: list[str], robots: list[list[Run]], tested: int) -> TypeParameter:
    x, s2, having = _arrays(robots, name)
    some = next(run.parameters[name] for runs in robots for run in runs if name in run.parameters)
    changes = {} if name in _DRIFTS_ANYWAY else _changes(x, s2, having, tested)
    segment = _segments(x.shape, changes)
    stands_out, z = _outlying_runs(x, s2, segment)
    last = segment == segment.max(axis=1, keepdims=True, initial=0.0)
    now = numpy.where(last & ~stands_out, s2, numpy.inf)
    nothing = RobotParameter(numpy.nan, numpy.nan, numpy.nan, numpy.nan, numpy.nan, False)
    estimates, fit, omega = _estimates(x, now) if x.shape[1] else ([nothing] * len(names), None, 0.0)
    return TypeParameter(
        name, some.unit, some.nominal, names, estimates, fit, omega,
        [(names[i], having[i][change.first], change) for i, found in changes.items() for change in found],
        [(having[i][j], float(z[i, j])) for i, j in numpy.argwhere(stands_out)])


def summarise(robots: dict[str, list[Run]]) -> Fleet:
    types: dict[str, list[str]] = {}
    for robot, runs in robots.items():
        types.setdefault(runs[-1].type, []).append(robot)
    parameters = {}
    for kind, names in sorted(types.items()):
        of_type = [robots[robot] for robot in names]
        known = list(dict.fromkeys(name for runs in of_type for run in runs for name in run.parameters))
        tested = max(1, sum(name not in _DRIFTS_ANYWAY for name in known))
        parameters[kind] = [_type_parameter(name, names, of_type, tested) for name in known]
    return Fleet(robots, parameters)


def needs_of(runs: list[Run]) -> list[str]:
    """What a robot should drive next."""
    calibrated = [run for run in runs if run.parameters]
    names = list(dict.fromkeys(name for run in calibrated for name in run.parameters))
    unobservable = [name for name in names if not any(run.parameters[name].observable for run in calibrated if name in run.parameters)]
    return runs_for(unobservable, len({run.date or run.log for run in calibrated}))
