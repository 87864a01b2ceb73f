"""What run a robot needs next: the motion that shows what its runs have not shown. docs/drive-a-calibration.md."""

from __future__ import annotations

from collections.abc import Iterable

_WITH_REFERENCE = "a run with a reference: straight, squares or turns whose ends are measured"
BADLY_KNOWN = "better determined by the other robots of its type than by its own runs"
ANOTHER_DAY = "the same on another day: the variation between sessions is unknown"
_RUNS = (  # by the end, or the start, of the parameter's name; in the words of `trundle calibrate`
    (".diameter", "add one straight run of known length"),
    ("track", "add several full turns of measured angle, both ways"),
    (".lever", "add several full turns of measured angle, both ways"),
    ("gyro.scale", "add several full turns of measured angle, both ways"),
    ("gyro.bias", "stand still for ten seconds"),
    ("icr_x", "turn on the spot with the position measured"),
    ("scrub", "drive wide curves and sharp ones, and turn on the spot, with the heading measured"),
    (".direction", "drive straight ahead and sideways, with the position measured"),
    (".steering_zero", "drive straight ahead, and back, with the position measured"),
    (".steering_scale", "drive curves of very different radii, both ways, with the heading measured"),
    (".x", "drive curves of very different radii, both ways, with the heading measured"),
    (".y", "drive curves of very different radii, both ways, with the heading measured"),
    ("tyre_growth", "drive far at very different speeds, with the way measured"),
    ("velocity.", "drive straight runs and squares at two speeds, with stops"),
)


def run_for(parameter: str) -> str:
    """The run that shows a parameter."""
    return next((run for part, run in _RUNS if parameter.endswith(part) or parameter.startswith(part)), _WITH_REFERENCE)


def runs_for(unobservable: Iterable[str], calibrated_days: int, badly_known: Iterable[str] = ()) -> list[str]:
    """What to drive next, the most telling first; nothing where all is known. `badly_known`: parameters that the other robots
    of the type tell more of than the robot's own runs."""
    if calibrated_days == 0:
        return [_WITH_REFERENCE]
    runs = list(dict.fromkeys(run_for(parameter) for parameter in unobservable))
    more: dict[str, list[str]] = {}
    for parameter in badly_known:
        if (run := run_for(parameter)) not in runs:
            more.setdefault(run, []).append(parameter)
    runs += [f"{run}: {', '.join(names)} {BADLY_KNOWN}" for run, names in more.items()]
    return runs + [ANOTHER_DAY] if calibrated_days == 1 else runs


def is_urgent(need: str) -> bool:
    """Whether without it something is not known at all."""
    return need != ANOTHER_DAY and not need.endswith(BADLY_KNOWN)
