"""One figure for each result, by matplotlib. Imported when it is asked."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Any, Optional, Union

import matplotlib.pyplot
import numpy
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse

from . import _trundle

_ELLIPSES = 25  # along a trajectory: more hide it


def _ellipse(axes: Axes, place: Any, covariance: Any, colour: str) -> None:
    """The 95 % ellipse of a position: chi squared of two degrees of freedom is below 5.99."""
    variances, directions = numpy.linalg.eigh(covariance)
    width, height = 2.0 * numpy.sqrt(5.991 * numpy.maximum(variances, 0.0))
    angle = numpy.degrees(numpy.arctan2(directions[1, 0], directions[0, 0]))
    axes.add_patch(Ellipse(tuple(place), width, height, angle=angle, fill=False, color=colour, linewidth=0.8))


def _from_above(axes: Axes, title: str) -> None:
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(True, alpha=0.3)


def _path(axes: Axes, trajectory: _trundle.Trajectory, label: str, colour: str = "C0") -> None:
    axes.plot(trajectory.x_m, trajectory.y_m, color=colour, label=label)
    if trajectory.covariance is None or len(trajectory) == 0:
        return
    for i in numpy.unique(numpy.linspace(0, len(trajectory) - 1, _ELLIPSES, dtype=int)):
        place = (trajectory.x_m[i], trajectory.y_m[i])
        _ellipse(axes, place, trajectory.covariance[i, :2, :2], colour)


def _plot_trajectory(trajectory: _trundle.Trajectory, axes: Axes) -> None:
    _path(axes, trajectory, "trajectory")
    _from_above(axes, "Trajectory, with 95 % ellipses")


def _plot_recording(recording: _trundle.Recording, axes: Axes) -> None:
    """Where it was measured; else what the wheels did, or the first of the sensors that there are."""
    reference = recording.reference
    if reference:
        axes.plot(reference["x_m"], reference["y_m"], color="C2", label="reference")
        for name, (x, y) in recording.landmarks.items():
            axes.plot(x, y, "k^")
            axes.annotate(name, (x, y), textcoords="offset points", xytext=(4, 4), fontsize="small")
        _from_above(axes, f"{recording.name}: reference")
        return
    names = ["wheels", "gyro", "velocity", "commands", "accel", "sightings"]
    stream = next((name for name in names if getattr(recording, name)), None)
    if stream is None:
        raise ValueError(f"{recording.name}: holds nothing to draw; expected one of reference, {', '.join(names)}")
    columns = getattr(recording, stream)
    for name, values in columns.items():
        if name not in ("time_s", "landmark"):
            axes.plot(columns["time_s"], values, "." if stream == "sightings" else "-", label=name)
    axes.set(xlabel="time [s]", title=f"{recording.name}: {stream} as recorded")
    axes.legend()


def _plot_calibration(calibration: _trundle.Calibration, axes: Axes) -> None:
    shown = [p for p in calibration.parameters if p.observable]
    rows = numpy.arange(len(shown))
    moved = [(p.value - p.nominal) / p.sigma if p.sigma > 0.0 else 0.0 for p in shown]
    axes.errorbar(moved, rows, xerr=1.96, fmt="o", capsize=3)
    axes.axvline(0.0, color="k", linewidth=0.8)
    axes.set_yticks(rows, [p.name for p in shown])
    axes.invert_yaxis()
    axes.set(xlabel="calibrated − nominal [σ], with 95 % intervals", title="Calibration")
    axes.grid(True, axis="x", alpha=0.3)


def _plot_slip(slip: _trundle.Slip, axes: Axes) -> None:
    axes.plot(slip.end_s, slip.statistic, color="C0", linewidth=0.8, label="statistic")
    if slip.limit > 0.0:
        axes.axhline(slip.limit, color="C3", linestyle="--", label="limit")
        axes.set_yscale("symlog")
    for event in slip.events:
        axes.axvspan(event.start_s, event.end_s, color="C3", alpha=0.2)
        middle = 0.5 * (event.start_s + event.end_s)
        axes.annotate(f"{event.wheel} {event.kind}", (middle, 1.0), xycoords=("data", "axes fraction"),
                      rotation=90, va="top", ha="center", fontsize="small")
    axes.set(xlabel="time [s]", ylabel="statistic of an interval", title="Slip")
    axes.legend(loc="lower right")


def _landmarks(axes: Axes, result: Union[_trundle.Slam, _trundle.JointSlam, _trundle.Merge]) -> None:
    for name, place, covariance in zip(result.landmarks, result.positions, result.position_covariances):
        axes.plot(*place, "k^", markersize=4)
        _ellipse(axes, place, covariance, "k")
        axes.annotate(name, tuple(place), textcoords="offset points", xytext=(4, 4), fontsize="small")


def _plot_slam(slam: _trundle.Slam, axes: Axes) -> None:
    _path(axes, slam.trajectory, "trajectory")
    _landmarks(axes, slam)
    _from_above(axes, "Trajectory and landmarks, with 95 % ellipses")


def _plot_joint_slam(slam: _trundle.JointSlam, axes: Axes) -> None:
    for i, (robot, trajectory) in enumerate(slam.trajectories.items()):
        _path(axes, trajectory, robot, f"C{i % 10}")
    _landmarks(axes, slam)
    _from_above(axes, "Trajectories and landmarks, with 95 % ellipses")
    axes.legend()


def _plot_merge(merge: _trundle.Merge, axes: Axes) -> None:
    _landmarks(axes, merge)
    _from_above(axes, "Merged landmarks, with 95 % ellipses")


def _plot_evaluation(evaluation: _trundle.Evaluation, axes: Axes) -> None:
    shown = [error for error in evaluation.relative if error.pairs > 0]
    axes.bar([f"{error.distance_m:g}" for error in shown], [error.translation_rms_m for error in shown])
    axes.set(xlabel="distance along the path [m]", ylabel="relative position error, rms [m]",
             title=f"Position error {evaluation.position_m.rms:.4f} m rms, alignment '{evaluation.alignment}'")


def _plot_run(run: _trundle.Run, axes: Axes) -> None:
    if not run.errors:
        raise ValueError(f"{run.folder}: no trajectory was compared; expected a recording with a reference")
    shown = [error for error in run.errors if error.alignment == run.errors[0].alignment]
    axes.barh([error.trajectory for error in shown], [error.rms_m for error in shown])
    axes.invert_yaxis()
    axes.set(xlabel=f"position error, rms [m], alignment '{shown[0].alignment}'", title=run.folder)


def _plot_install_angle(angle: _trundle.InstallAngle, axes: Axes) -> None:
    degrees = numpy.degrees(angle.run_alpha_rad)
    axes.plot(numpy.arange(1, len(degrees) + 1), degrees, "o", label="each run")
    mean, half = numpy.degrees(angle.alpha_rad), 1.96 * numpy.degrees(angle.sigma_rad)
    axes.axhline(mean, color="C1", label="all of them, with its 95 % interval")
    axes.axhspan(mean - half, mean + half, color="C1", alpha=0.2)
    axes.set(xlabel="run", ylabel="mounting error of pod 1 [°]", title="Mounting angle")
    axes.legend()


def _numbers(column: dict[str, Any]) -> Any:
    """As docs/report-json.md has a column."""
    return column["offset"] + numpy.frombuffer(base64.b64decode(column["float32"]), "<f4")


def _plot_report(report: _trundle.Report, axes: Axes) -> None:
    for results in report.to_dict()["results"]:
        for track in results["tracks"]:
            label = f"{results['label']}: {track['name']}"
            axes.plot(_numbers(track["x_m"]), _numbers(track["y_m"]), label=label)
    _from_above(axes, "Trajectories")
    if axes.lines:
        axes.legend()


_FIGURES: dict[type, Callable[[Any, Axes], None]] = {
    _trundle.Trajectory: _plot_trajectory,
    _trundle.Recording: _plot_recording,
    _trundle.Calibration: _plot_calibration,
    _trundle.Slip: _plot_slip,
    _trundle.Slam: _plot_slam,
    _trundle.JointSlam: _plot_joint_slam,
    _trundle.Merge: _plot_merge,
    _trundle.Evaluation: _plot_evaluation,
    _trundle.Run: _plot_run,
    _trundle.InstallAngle: _plot_install_angle,
    _trundle.Report: _plot_report,
}


def plot(result: Any, axes: Optional[Axes] = None) -> Axes:
    if axes is None:
        axes = matplotlib.pyplot.figure(layout="constrained").add_subplot()
    draw = _FIGURES.get(type(result))
    if draw is None:
        _plot_trajectory(result.trajectory, axes)
    else:
        draw(result, axes)
    return axes
