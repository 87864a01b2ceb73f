"""What is computed of one log: health, calibration where it can be told, odometry and slip; and of all logs of a robot its
report. No database, no clock."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any, Optional

import trundle

from .logs import path_and_number


def _finite(value: Optional[float]) -> Optional[float]:
    return float(value) if value is not None and math.isfinite(value) else None


def _calibration(recording: trundle.Recording, robot: trundle.Robot) -> tuple[Optional[trundle.Calibration], str]:
    try:
        return trundle.calibrate(recording, robot), ""
    except trundle.CannotAnswer as cannot:
        return None, str(cannot)


def _parameters(calibration: trundle.Calibration) -> list[dict[str, Any]]:
    names = ("name", "unit", "nominal", "value", "sigma", "observable")
    return [{name: getattr(estimate, name) for name in names} for estimate in calibration.parameters]


def _position_rms(found: trundle.Odometry, recording: trundle.Recording, robot: trundle.Robot) -> Optional[float]:
    if not recording.reference:
        return None
    try:
        return _finite(trundle.evaluate(found, recording, robot=robot).position_m.rms)
    except (trundle.CannotAnswer, ValueError):  # the reference has no place, or too few rows at the same time
        return None


def _odometry(recording: trundle.Recording, nominal: trundle.Robot, best: trundle.Robot) -> dict[str, Any]:
    found = trundle.odometry(recording, best)
    before = found if best is nominal else trundle.odometry(recording, nominal)
    time_s, covariance = found.trajectory.time_s, found.end_covariance
    return {
        "duration_s": float(time_s[-1] - time_s[0]) if len(time_s) else 0.0,
        "path_length_m": found.path_length_m,
        "end_sigma_m": _finite(math.sqrt(max(0.0, covariance[0, 0] + covariance[1, 1]))),
        "position_rms_before_m": _position_rms(before, recording, nominal),
        "position_rms_after_m": None if best is nominal else _position_rms(found, recording, best),
    }


def _slip(recording: trundle.Recording, robot: trundle.Robot) -> dict[str, Any]:
    try:
        found = trundle.slip(recording, robot)
    except trundle.CannotAnswer as cannot:
        return {"slip_events": None, "slip_share": None, "slip_line": str(cannot)}
    return {"slip_events": len(found.clear), "slip_share": _finite(found.flagged_share), "slip_line": ""}


def recording_of(log: str) -> trundle.Recording:
    path, number = path_and_number(log)
    return trundle.Recording(path, robot_number=number)


def analyse(log: str, robot_file: str) -> dict[str, Any]:
    """Raises ValueError or CannotAnswer with one line where the log gives no odometry."""
    robot = trundle.Robot(robot_file)
    recording = recording_of(log)
    problems = recording.info(robot)["problems"]
    calibration, line = _calibration(recording, robot)
    best = calibration.robot if calibration is not None else robot
    return {
        "type": robot.name,
        "line": line,
        "findings": [{key: problem[key] for key in ("severity", "kind", "place", "count", "message")} for problem in problems],
        "parameters": _parameters(calibration) if calibration is not None else [],
        "warnings": list(calibration.warnings) if calibration is not None else [],
        **_odometry(recording, robot, best),
        **_slip(recording, best),
    }


def report(shows: dict[str, Any]) -> str:
    """The page of a robot: calibrated on all of `shows["calibrated_on"]`, with odometry and slip of `shows["last"]`."""
    with tempfile.TemporaryDirectory() as folder:
        calibration = trundle.calibrate(list(map(recording_of, shows["calibrated_on"])), trundle.Robot(shows["robot_file"]))
        calibration.save(Path(folder, "calibrated.toml"))
        last = recording_of(shows["last"])
        trundle.odometry(last, calibration.robot).save(Path(folder, "odometry.csv"))
        try:
            trundle.slip(last, calibration.robot).save(Path(folder, "slip.csv"))
        except trundle.CannotAnswer:
            pass  # no redundant measurement
        return trundle.report(folder).html
