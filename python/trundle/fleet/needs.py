"""What run a robot needs next: the motion that shows what its runs have not shown. docs/drive-a-calibration.md."""

from __future__ import annotations

from collections.abc import Iterable

_WITH_REFERENCE = "a run with a reference: straight, squares or turns whose ends are measured"
ANOTHER_DAY = "the same on another day: the variation between sessions is unknown"
_RUNS = (  # by the end, or the start, of the parameter's name
    (".diameter", "a straight run of measured length"),
    ("track", "ten turns on the spot each way, the heading measured at the end"),
    (".lever", "ten turns on the spot each way, the heading measured at the end"),
    ("gyro.scale", "ten turns on the spot each way, the heading measured at the end"),
    ("gyro.bias", "a rest of ten seconds"),
    ("icr_x", "turns on the spot, the position measured at the end"),
    ("scrub", "wide curves and turns on the spot each way, the heading measured at the end"),
    (".direction", "straight and sideways runs, the position measured at the end"),
    (".steering_zero", "a straight run, the position measured at the end"),
    (".steering_scale", "circles each way, the heading measured at the end"),
    (".x", "circles each way, the heading measured at the end"),
    (".y", "circles each way, the heading measured at the end"),
    ("velocity.", "straight runs and squares at two speeds, with stops"),
)


def run_for(parameter: str) -> str:
    """The run that shows a parameter."""
    return next((run for part, run in _RUNS if parameter.endswith(part) or parameter.startswith(part)), _WITH_REFERENCE)


def runs_for(unobservable: Iterable[str], calibrated_days: int) -> list[str]:
    """What to drive next, the most telling first; nothing where all is known."""
    if calibrated_days == 0:
        return [_WITH_REFERENCE]
    runs = list(dict.fromkeys(run_for(parameter) for parameter in unobservable))
    return runs + [ANOTHER_DAY] if calibrated_days == 1 else runs
