"""What the database holds, brought together: each robot's parameters, their changes, and what stands out."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
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
    digests: tuple[str, ...] = ()  # of the log, the robot file and what computed it


class RobotParameter(NamedTuple):
    """NaN: not known."""

    value: float
    sigma: float
    low: float
    high: float
    z: float  # in the population
    outlying: bool
    own_sigma: float  # by its own runs alone


class TypeParameter(NamedTuple):
    name: str
    unit: str
    nominal: float
    robots: list[str]
    estimates: list[RobotParameter]
    fit: Optional[population.Population]
    run_spread: float
    changes: list[tuple[str, Run, drift.Change]]  # robot, its first run
    outlying_runs: list[tuple[Run, float]]  # with z

    def badly_known(self) -> list[str]:
        """Robots of which the population tells more than their own runs: b < 1/2, docs/theory/fleet.md, eq. 4, wherever in its
        95 % interval the spread is. An outlying robot is not of the population, and what drifts no run tells of the next."""
        if self.fit is None or self.name in _DRIFTS_ANYWAY:
            return []
        most = float(self.fit.spread_high)
        return [robot for robot, one in zip(self.robots, self.estimates) if one.own_sigma > most and not one.outlying]


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
                  {name: row[name] for name in measures}, parameters.get(row.log_id, {}), (row.log_sha256, row.robot_sha256, row.version))
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


def _years(having: list[list[Run]], shape: tuple[int, ...]) -> Array:
    """Each run's date from the robot's first; all 0 where one is not known: then no change is looked for."""
    years = numpy.zeros(shape)
    for i, runs in enumerate(having):
        if all(run.date is not None for run in runs):
            days = numpy.array([datetime.date.fromisoformat(str(run.date)[:10]).toordinal() for run in runs])
            years[i, : len(runs)] = (days - days[:1]) / _YEAR_DAYS
    return years


def _pieces(x: Array, s2: Array, years: Array, tested: int) -> dict[int, list[drift.Piece]]:
    """Of those rows that are not one constant. Of the false alarms of a robot-year each of its parameters has its part."""
    omega2, degrees = series.robust_run_spread(x, s2)
    limits = numpy.full(len(x), numpy.inf)
    for i, last in enumerate(years.max(axis=1, initial=0.0)):
        if last > 0.0:
            runs = int(numpy.isfinite(s2[i]).sum())
            limits[i] = drift.with_degrees(drift.limit_for(runs, drift.FALSE_ALARMS * last / tested), degrees)
    variance = s2 + omega2
    rows: list[int] = numpy.flatnonzero(drift.suspects(x, variance, years, limits)).tolist()
    return {i: drift.pieces(x[i], variance[i], years[i], limits[i]) for i in rows}


class _Column:
    """A parameter of the robots of a type, while it is worked out."""

    def __init__(self, name: str, names: list[str], robots: list[list[Run]], tested: int) -> None:
        self.name, self.names = name, numpy.array(names, object)
        self.x, self.s2, self.having = _arrays(robots, name)
        self.some = next(run.parameters[name] for runs in robots for run in runs if name in run.parameters)
        self.years = _years(self.having, self.x.shape)
        self.pieces = {} if name in _DRIFTS_ANYWAY else _pieces(self.x, self.s2, self.years, tested)
        self._divide()
        self.logs = numpy.full(self.x.shape, "", object)
        for i, runs in enumerate(self.having):
            self.logs[i, : len(runs)] = [run.log for run in runs]

    def _divide(self) -> None:
        """The piece of each run, and its time from the last one of its piece where that has a trend, else 0."""
        self.segment, self.time = numpy.zeros(self.x.shape), numpy.zeros(self.x.shape)
        for i, pieces in self.pieces.items():
            for number, piece in enumerate(pieces):
                end = pieces[number + 1].first if number + 1 < len(pieces) else len(self.having[i])
                self.segment[i, piece.first :] = number
                if piece.is_trend:
                    self.time[i, piece.first : end] = self.years[i, piece.first : end] - self.years[i, end - 1]
        self.last = self.segment == self.segment.max(axis=1, keepdims=True, initial=0.0)

    def judge_runs(self) -> Array:
        """The probability of each run."""
        omega2, degrees = series.robust_run_spread(self.x, self.s2)
        y, v = series.robot_values(self.x, numpy.where(self.last, self.s2, numpy.inf), numpy.asarray(omega2), self.time)
        self.z_of_runs = p = numpy.full(self.x.shape, numpy.nan)
        if numpy.isfinite(v).sum() < 4:
            return p
        mean, spread = population.robust_fit(y, v)
        self.z_of_runs = z = outliers.run_scores(self.x, self.s2, omega2, float(mean), float(spread), self.segment, self.time)
        seen = numpy.isfinite(z)
        p[seen] = outliers.tails(z[seen], degrees) if degrees > 0.0 else normal_tails(z[seen])
        return p

    def judge_robots(self, outlying_runs: Array) -> Array:
        """The probability of each robot, by its runs since its last step but those that stand out."""
        self.outlying_runs = outlying_runs
        self.z = p = numpy.full(len(self.names), numpy.nan)
        self.omegas = numpy.zeros(1)
        self.y, self.v = numpy.zeros((1, *p.shape)), numpy.full((1, *p.shape), numpy.inf)
        if not self.x.shape[1]:
            return p
        now = numpy.where(self.last & ~outlying_runs, self.s2, numpy.inf)
        self.omegas = series.run_spreads(self.x, now, self.time)
        self.y, self.v = map(numpy.stack, zip(*(series.robot_values(self.x, now, omega2, self.time) for omega2 in self.omegas)))
        middle = len(self.omegas) // 2
        if numpy.isfinite(self.v[middle]).sum() >= 4:
            self.z, p = outliers.robot_scores(self.y[middle], self.v[middle])
        return p

    def finished(self, outlying: Array) -> TypeParameter:
        """Each robot's value; the population's, without the robots that stand out."""
        middle = len(self.omegas) // 2
        seen = numpy.isfinite(self.v[middle])
        sigma = numpy.where(seen, numpy.sqrt(numpy.where(seen, self.v[middle], 0.0)), numpy.nan)
        value, own_sigma = numpy.where(seen, self.y[middle], numpy.nan), sigma.copy()
        low, high, fit = value - 1.96 * sigma, value + 1.96 * sigma, None
        usual = ~outlying
        if (seen & usual).sum() >= 3:
            fit = population.fit(self.y[:, usual], self.v[:, usual])
            shrunken = population.shrink(self.y[:, usual], self.v[:, usual])
            for mine, theirs in zip((value, sigma, low, high), shrunken):
                mine[usual] = theirs
        rows = zip(*(column.tolist() for column in (value, sigma, low, high, self.z, outlying, own_sigma)))
        return TypeParameter(
            self.name, self.some.unit, self.some.nominal, self.names.tolist(), [RobotParameter(*row) for row in rows], fit,
            float(numpy.sqrt(self.omegas[middle])),
            [(self.names[i], self.having[i][change.first], change)
             for i, pieces in self.pieces.items() for change in drift.changes(pieces, self.years[i])],
            [(self.having[i][j], float(self.z_of_runs[i, j])) for i, j in numpy.argwhere(self.outlying_runs)])


def _told(columns: dict[str, list[_Column]], things: str, probabilities: dict[str, list[Array]]) -> dict[str, list[Array]]:
    """Which of the fleet's robots or runs (`things`: their names in a column) are told of which parameter."""
    index: dict[str, int] = {}
    rows = {kind: [numpy.array([index.setdefault(name, len(index)) for name in getattr(column, things).ravel()], int) for column in some]
            for kind, some in columns.items()}
    p = numpy.full((len(index), max(map(len, columns.values()), default=0)), numpy.nan)
    for kind, some in probabilities.items():
        for k, of_column in enumerate(some):
            p[rows[kind][k], k] = of_column.ravel()
    told = outliers.told(p)
    return {kind: [told[rows[kind][k], k].reshape(of_column.shape) for k, of_column in enumerate(some)]
            for kind, some in probabilities.items()}


def _columns(names: list[str], robots: list[list[Run]]) -> list[_Column]:
    known = list(dict.fromkeys(name for runs in robots for run in runs for name in run.parameters))
    tested = max(1, sum(name not in _DRIFTS_ANYWAY for name in known))
    return [_Column(name, names, robots, tested) for name in known]


def summarise(robots: dict[str, list[Run]]) -> Fleet:
    types: dict[str, list[str]] = {}
    for robot, runs in robots.items():
        types.setdefault(runs[-1].type, []).append(robot)
    columns = {kind: _columns(names, [robots[robot] for robot in names]) for kind, names in sorted(types.items())}
    runs_told = _told(columns, "logs", {kind: [column.judge_runs() for column in some] for kind, some in columns.items()})
    robots_told = _told(columns, "names", {kind: [column.judge_robots(told) for column, told in zip(some, runs_told[kind])]
                                           for kind, some in columns.items()})
    return Fleet(robots, {kind: [column.finished(told) for column, told in zip(some, robots_told[kind])]
                          for kind, some in columns.items()})


def needs_of(runs: list[Run], badly_known: Iterable[str] = ()) -> list[str]:
    """What a robot should drive next."""
    calibrated = [run for run in runs if run.parameters]
    names = list(dict.fromkeys(name for run in calibrated for name in run.parameters))
    unobservable = [name for name in names if not any(run.parameters[name].observable for run in calibrated if name in run.parameters)]
    return runs_for(unobservable, len({run.date or run.log for run in calibrated}), badly_known)
