"""Results as notebooks show them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from html import escape
from typing import Any

from . import _trundle

_MOST_ROWS = 20


def _table(head: Iterable[str], rows: list[list[Any]]) -> str:
    def line(cells: Iterable[Any], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(line(row, "td") for row in rows[:_MOST_ROWS])
    more = f"<p>and {len(rows) - _MOST_ROWS} more</p>" if len(rows) > _MOST_ROWS else ""
    return f"<table><thead>{line(head, 'th')}</thead><tbody>{body}</tbody></table>{more}"


def _findings(result: Any) -> str:
    rows = [[f.severity, f.place, f.message] for f in getattr(result, "findings", [])]
    return _table(["", "place", "finding"], rows) if rows else ""


def _frame(page: str) -> str:
    """A page in a page."""
    return f'<iframe srcdoc="{escape(page, quote=True)}" width="100%" height="720" frameborder="0"></iframe>'


def _details(result: Any) -> str:
    if isinstance(result, _trundle.Calibration):
        parameters = [
            [p.name, f"{p.nominal:.8g}", f"{p.value:.8g}", f"± {p.sigma:.2g}" if p.observable else "unobservable",
             p.unit]
            for p in result.parameters
        ]
        errors = [[e.what, f"{e.before:.5g}", f"{e.after:.5g}", e.unit] for e in result.errors]
        notes = [["warning", text] for text in result.warnings] + [["note", text] for text in result.notes]
        return (
            _table(["parameter", "nominal", "calibrated", "", "unit"], parameters)
            + (_table(["error", "before", "after", "unit"], errors) if errors else "")
            + (_table(["", ""], notes) if notes else "")
        )
    if isinstance(result, _trundle.Slip):
        rows = [
            [f"{e.start_s:.3f}", f"{e.end_s:.3f}", e.wheel, e.kind, f"{e.excess_m:.4f}", f"{e.confidence:.3f}"]
            for e in result.events
        ]
        return _table(["start s", "end s", "wheel", "kind", "excess m", "confidence"], rows)
    if isinstance(result, _trundle.Run):
        return _table(["stage", "", ""], [[s.name, s.status, s.message] for s in result.stages])
    if isinstance(result, _trundle.InstallAngle):
        rows = [[f"{run['side_m']:g}", f"{run['end_x_m']:g}", f"{run['end_y_m']:g}", f"{run['alpha_deg']:.4f}"]
                for run in result.to_dict()["runs"]]
        notes = [["warning", text] for text in result.warnings]
        return _table(["side m", "end x m", "end y m", "alpha °"], rows) + (_table(["", ""], notes) if notes else "")
    if isinstance(result, _trundle.Evaluation):
        rows = [
            [f"{e.distance_m:g} m", f"{e.translation_rms_m:.4f} m", f"{e.translation_mean_percent:.3f} %", e.pairs]
            for e in result.relative
            if e.pairs > 0
        ]
        return _table(["over", "rms", "mean", "pairs"], rows) if rows else ""
    return ""


def repr_html(result: Any) -> str:
    if isinstance(result, _trundle.Report):
        return _frame(result.html)
    title = f"<p><b>{escape(repr(result).strip('<>'))}</b></p>"
    page = ""
    if isinstance(result, _trundle.Run):
        path = os.path.join(result.folder, "report.html")
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                page = _frame(file.read())
    return title + _details(result) + _findings(result) + page
