"""The fleet page, and beside it the same as CSV and for Prometheus. The same database gives the same bytes."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Optional

import trundle

from . import drift, outliers, reports, store
from .files import write
from .needs import is_urgent
from .summary import Fleet, Run, TypeParameter, load, needs_of, summarise


def _number(value: Any) -> Optional[float]:
    """Seven digits: the page shows fewer."""
    return float(f"{value:.7g}") if value is not None and math.isfinite(value) else None


def change_in_words(parameter: TypeParameter, run: Run, change: drift.Change) -> str:
    """'left.diameter −0.8 % (± 0.1 %) since 2026-03-03', of a trend 'left.diameter −0.8 % a year (± 0.1 %) since 2026-01-03'"""
    size, each = (change.slope, " a year") if isinstance(change, drift.Trend) else (change.step, "")
    share = parameter.nominal != 0.0 and parameter.unit in ("m", "1")
    factor, unit = (100.0 / abs(parameter.nominal), "%") if share else (1.0, parameter.unit)
    decimals = min(9, max(0, 1 - math.floor(math.log10(change.sigma * factor)))) if change.sigma > 0.0 else 3
    signed = f"{size * factor:+.{decimals}f}".replace("-", "−")
    return f"{parameter.name} {signed} {unit}{each} (± {change.sigma * factor:.{decimals}f} {unit}) since {run.date}"


_REASONS = ("change", "failed", "outlier", "run", "run_needed", "warning")


class _Attention:
    """Why each robot stands out."""

    def __init__(self, fleet: Fleet) -> None:
        self.reasons: dict[str, list[str]] = {robot: [] for robot in fleet.robots}
        self.changes: dict[str, list[list[Any]]] = {robot: [] for robot in fleet.robots}
        badly_known: dict[str, list[str]] = {robot: [] for robot in fleet.robots}
        for parameters in fleet.parameters.values():
            for parameter in parameters:
                self._of_parameter(parameter)
                for robot in parameter.badly_known():
                    badly_known[robot].append(parameter.name)
        self.needs = {robot: needs_of(runs, badly_known[robot]) for robot, runs in fleet.robots.items()}
        for robot, runs in fleet.robots.items():
            self._add(robot, "failed", runs[-1].status == "failed")
            self._add(robot, "warning", runs[-1].warnings > 0)
            self._add(robot, "run_needed", any(map(is_urgent, self.needs[robot])))

    def _add(self, robot: str, reason: str, holds: bool = True) -> None:
        if holds and reason not in self.reasons[robot]:
            self.reasons[robot].append(reason)

    def _of_parameter(self, parameter: TypeParameter) -> None:
        for robot, run, change in parameter.changes:
            self._add(robot, "change")
            line = [_number(change.start), _number(change.slope)] if isinstance(change, drift.Trend) else None
            self.changes[robot].append([parameter.name, run.date or "", run.log, change_in_words(parameter, run, change), line])
        for robot, estimate in zip(parameter.robots, parameter.estimates):
            self._add(robot, "outlier", estimate.outlying)
        for run, _ in parameter.outlying_runs:
            self._add(run.robot, "run")


def _types(fleet: Fleet) -> list[dict[str, Any]]:
    def parameter(one: TypeParameter) -> dict[str, Any]:
        fit = None if one.fit is None else [_number(float(value)) for value in one.fit[1:]]
        return {"name": one.name, "unit": one.unit, "nominal": one.nominal, "fit": fit, "run_spread": _number(one.run_spread)}

    return [{"name": kind, "parameters": list(map(parameter, parameters))} for kind, parameters in fleet.parameters.items()]


def _values(fleet: Fleet) -> dict[str, list[Any]]:
    """[value, low, high, z, outlying] for each parameter of the robot's type; null where it is not known."""
    values: dict[str, list[Any]] = {robot: [] for robot in fleet.robots}
    for parameters in fleet.parameters.values():
        for parameter in parameters:
            for robot, one in zip(parameter.robots, parameter.estimates):
                known = math.isfinite(one.value)
                values[robot].append([*map(_number, (one.value, one.low, one.high, one.z)), int(one.outlying)] if known else None)
    return values


def _last(runs: list[Run], name: str) -> Optional[float]:
    return next((_number(run.measures[name]) for run in reversed(runs) if run.measures.get(name) is not None), None)


def _data(fleet: Fleet, attention: _Attention, links: dict[str, str]) -> dict[str, Any]:
    types = list(fleet.parameters)
    runs = [run for of_robot in fleet.robots.values() for run in of_robot]
    dates = sorted(run.date for run in runs if run.date)
    needs = list(dict.fromkeys(need for robot in attention.needs.values() for need in robot))
    values, robots = _values(fleet), fleet.robots
    return {
        "version": trundle.__version__, "logs": len(runs), "failed": sum(run.status == "failed" for run in runs),
        "first": dates[0] if dates else None, "last": dates[-1] if dates else None, "rate": outliers.RATE,
        "types": _types(fleet), "needs": needs,
        "robots": {
            "name": list(robots),
            "type": [types.index(runs[-1].type) for runs in robots.values()],
            "runs": [len(runs) for runs in robots.values()],
            "last": [runs[-1].date for runs in robots.values()],
            "rms": [_last(runs, "position_rms_after_m") for runs in robots.values()],
            "slip": [_last(runs, "slip_share") for runs in robots.values()],
            "reasons": [attention.reasons[robot] for robot in robots],
            "score": [len(attention.reasons[robot]) for robot in robots],
            "changes": [attention.changes[robot] for robot in robots],
            "needs": [[needs.index(need) for need in attention.needs[robot]] for robot in robots],
            "values": [values[robot] for robot in robots],
            "report": [links.get(robot, "") for robot in robots],
        },
    }


def _history(fleet: Fleet) -> list[Any]:
    """Of each robot's runs: date, log, status, warnings, [value, sigma] by parameter, remark."""
    def row(run: Run, names: list[str]) -> list[Any]:
        rows = [run.parameters.get(name) for name in names]
        known = [[_number(one.value), _number(one.sigma)] if one is not None and one.observable else None for one in rows]
        return [run.date, run.log, run.status, run.warnings, known, run.line]

    names = {kind: [parameter.name for parameter in parameters] for kind, parameters in fleet.parameters.items()}
    return [[row(run, names[runs[-1].type]) for run in runs] for runs in fleet.robots.values()]


def _for_script(document: Any) -> str:
    """'<' occurs only inside strings, where this means the same."""
    return json.dumps(document, ensure_ascii=False, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def page(data: Any, history: Any) -> str:
    template = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
    head, rest = template.split("{{data}}")
    middle, tail = rest.split("{{history}}")
    return head + _for_script(data) + middle + _for_script(history) + tail


def _csv(head: list[str], rows: Iterable[Iterable[Any]]) -> str:
    def cell(value: Any) -> Any:
        # A sheet must not take a name for a formula.
        return f"'{value}" if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t") else value

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([cell(value) for value in row] for row in rows)
    return text.getvalue()


def _change_cells(change: drift.Change, unit: str) -> list[Any]:
    if isinstance(change, drift.Trend):
        return ["", "", "trend", _number(change.slope), _number(change.sigma), f"{unit}/year"]
    return [_number(change.step), _number(change.sigma), "step", "", "", ""]


def _tables(fleet: Fleet, attention: _Attention) -> dict[str, str]:
    parameters = [one for of_type in fleet.parameters.values() for one in of_type]
    robots = [[robot, runs[-1].type, len(runs), runs[-1].date, runs[-1].status, " ".join(attention.reasons[robot]),
               "; ".join(attention.needs[robot])] for robot, runs in fleet.robots.items()]
    values = [[robot, one.name, one.unit, *map(_number, (e.value, e.sigma, e.low, e.high, e.z)), int(e.outlying)]
              for one in parameters for robot, e in zip(one.robots, one.estimates) if math.isfinite(e.value)]
    changes = [[robot, one.name, one.unit, run.date, run.log, *_change_cells(change, one.unit)]
               for one in parameters for robot, run, change in one.changes]
    runs = [[run.robot, one.name, run.date, run.log, _number(z)] for one in parameters for run, z in one.outlying_runs]
    return {
        "robots.csv": _csv(["robot", "type", "runs", "last_run", "last_status", "attention", "next_run"], robots),
        "parameters.csv": _csv(["robot", "parameter", "unit", "value", "sigma", "low_95", "high_95", "z", "outlying"], values),
        "changes.csv": _csv(["robot", "parameter", "unit", "since", "log", "step", "sigma", "kind", "slope", "slope_sigma", "slope_unit"], changes),
        "outlying_runs.csv": _csv(["robot", "parameter", "date", "log", "z"], runs),
    }


def _metric(name: str, text: str, rows: list[tuple[dict[str, str], float]]) -> list[str]:
    def escaped(value: str) -> str:
        return value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")

    labels = [",".join(f'{key}="{escaped(value)}"' for key, value in row.items()) for row, _ in rows]
    return [f"# HELP {name} {text}", f"# TYPE {name} gauge", *(f"{name}{{{label}}} {value:.10g}" for label, (_, value) in zip(labels, rows))]


def _prometheus(fleet: Fleet, attention: _Attention) -> str:
    runs = [run for of_robot in fleet.robots.values() for run in of_robot]
    fits = [(kind, one) for kind, parameters in fleet.parameters.items() for one in parameters if one.fit is not None]
    lines = [
        *_metric("trundle_fleet_robots", "Robots by type.", [
            ({"type": kind}, float(sum(of[-1].type == kind for of in fleet.robots.values()))) for kind in fleet.parameters]),
        *_metric("trundle_fleet_logs", "Logs by status.", [
            ({"status": status}, float(sum(run.status == status for run in runs))) for status in ("done", "failed")]),
        *_metric("trundle_fleet_attention_robots", "Robots that need attention, by reason.", [
            ({"reason": reason}, float(sum(reason in of for of in attention.reasons.values()))) for reason in _REASONS]),
        *_metric("trundle_fleet_attention", "1 for each robot and reason.", [
            ({"robot": robot, "reason": reason}, 1.0) for robot, of in attention.reasons.items() for reason in of]),
        *_metric("trundle_fleet_parameter_mean", "Mean over the robots of a type, in SI units.", [
            ({"type": kind, "parameter": one.name}, float(one.fit.mean)) for kind, one in fits if one.fit]),
        *_metric("trundle_fleet_parameter_spread", "Standard deviation between robots of a type, in SI units.", [
            ({"type": kind, "parameter": one.name}, float(one.fit.spread)) for kind, one in fits if one.fit]),
    ]
    return "\n".join(lines) + "\n"


Make = Callable[[store.Store, dict[str, str]], None]  # makes reports of robots, of what each shall show


def write_page(url: str, folder: str, which: str, make: Make) -> tuple[list[str], list[str]]:
    """Returns the files that it wrote, without the reports of single robots, and why some of these could not be made."""
    database, place = store.Store(url, patience_s=10.0), Path(folder)
    database.create_tables()
    robots = load(database)
    if not robots:
        raise ValueError(f"{database.engine.url!r}: has no run; expected logs to work on first")
    fleet = summarise(robots)
    attention = _Attention(fleet)
    files = {row.name: row.robot_file for row in database.rows(store.robots.select())}
    chosen = [robot for robot in robots if which == "all" or (which == "attention" and attention.reasons[robot])]
    shows = {robot: text for robot in chosen if (text := reports.shown_by(robots[robot], files.get(robot, ""))) is not None}
    make(database, shows)
    links, lines = reports.write_reports(database, shows, place)
    written = [write(place / "fleet.html", page(_data(fleet, attention, links), _history(fleet)))]
    written += [write(place / name, text) for name, text in _tables(fleet, attention).items()]
    return [*written, write(place / "fleet.prom", _prometheus(fleet, attention))], lines
