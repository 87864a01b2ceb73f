"""Results as pandas DataFrames, with the columns of the files that the program writes. Imported when it is asked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Optional, Union

import pandas

from . import _trundle


def _of_trajectory(trajectory: _trundle.Trajectory) -> pandas.DataFrame:
    columns = {
        "time_s": trajectory.time_s,
        "x_m": trajectory.x_m,
        "y_m": trajectory.y_m,
        "heading_rad": trajectory.heading_rad,
    }
    covariance = trajectory.covariance
    if covariance is not None:
        axes = "xyh"
        for i in range(3):
            for j in range(i, 3):
                columns[f"var_{axes[i]}{axes[j]}"] = covariance[:, i, j]
    return pandas.DataFrame(columns)


def _of_rows(rows: Any, names: list[str]) -> pandas.DataFrame:
    return pandas.DataFrame([[getattr(row, name) for name in names] for row in rows], columns=names)


def _of_recording(recording: _trundle.Recording, stream: str = "wheels") -> pandas.DataFrame:
    if stream == "landmarks":
        rows = [[name, *place] for name, place in recording.landmarks.items()]
        return pandas.DataFrame(rows, columns=["landmark", "x_m", "y_m"])
    streams = ["wheels", "gyro", "velocity", "commands", "accel", "sightings", "reference"]
    if stream not in streams:
        raise ValueError(f"stream: is '{stream}'; expected one of {', '.join(streams)}, landmarks")
    return pandas.DataFrame(getattr(recording, stream))


def _of_calibration(calibration: _trundle.Calibration) -> pandas.DataFrame:
    names = ["name", "unit", "nominal", "value", "sigma", "sigma_within", "sigma_between", "observable"]
    return _of_rows(calibration.parameters, names).set_index("name")


def _of_slip(slip: _trundle.Slip) -> pandas.DataFrame:
    names = ["start_s", "end_s", "wheel", "kind", "excess_m", "confidence", "excess_sigma_m", "by_chance"]
    return _of_rows(slip.events, names)


def _of_map(result: Union[_trundle.Slam, _trundle.JointSlam, _trundle.Merge]) -> pandas.DataFrame:
    places, covariances = result.positions, result.position_covariances
    columns = {
        "x_m": places[:, 0],
        "y_m": places[:, 1],
        "var_xx": covariances[:, 0, 0],
        "var_xy": covariances[:, 0, 1],
        "var_yy": covariances[:, 1, 1],
        "sightings": result.sightings,
    }
    return pandas.DataFrame(columns, index=pandas.Index(result.landmarks, name="landmark"))


def _of_evaluation(evaluation: _trundle.Evaluation) -> pandas.DataFrame:
    names = ["distance_m", "pairs", "translation_rms_m", "translation_mean_percent", "heading_rms_rad"]
    return _of_rows(evaluation.relative, names)


def _of_run(run: _trundle.Run) -> pandas.DataFrame:
    return _of_rows(run.stages, ["name", "status", "message"])


def _of_install_angle(angle: _trundle.InstallAngle) -> pandas.DataFrame:
    return pandas.DataFrame(angle.to_dict()["runs"])


def _of_report(report: _trundle.Report) -> pandas.DataFrame:
    names = ["results", "name", "role", "poses", "position_rms_m"]
    rows = []
    for results in report.to_dict()["results"]:
        rms = {error["name"]: error["summary"]["position_rms_m"] for error in results["errors"]}
        for track in results["tracks"]:
            rows.append([results["label"], track["name"], track["role"], track["poses"], rms.get(track["name"])])
    return pandas.DataFrame(rows, columns=names)


_TABLES: dict[type, Callable[..., pandas.DataFrame]] = {
    _trundle.Trajectory: _of_trajectory,
    _trundle.Recording: _of_recording,
    _trundle.Calibration: _of_calibration,
    _trundle.Slip: _of_slip,
    _trundle.Slam: _of_map,
    _trundle.JointSlam: _of_map,
    _trundle.Merge: _of_map,
    _trundle.Evaluation: _of_evaluation,
    _trundle.Run: _of_run,
    _trundle.InstallAngle: _of_install_angle,
    _trundle.Report: _of_report,
}


def to_pandas(result: Any, stream: Optional[str] = None) -> pandas.DataFrame:
    """`stream`: of a recording."""
    table = _TABLES.get(type(result))
    if table is None:
        return _of_trajectory(result.trajectory)
    return table(result) if stream is None else table(result, stream)
