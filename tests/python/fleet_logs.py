"""Simulated fleets: robots that differ, each with logs on several dates; for tests and tools."""

from __future__ import annotations

import datetime
import random
import tempfile
from pathlib import Path

import sqlalchemy
import trundle
from trundle.fleet import store

_SCENARIO = """
robot = "{robot}"
steering = "odometry"
[truth]
track_m = {track}
[truth.wheel.left]
diameter_m = {left}
[truth.wheel.right]
diameter_m = {right}
[truth.gyro]
bias_rad_s = {bias}
scale = {scale}
[pace]
forward_m_s = 0.3
turn_rad_s = 0.8
rest_s = 0.7
[encoders]
rate_hz = 20
[gyro]
rate_hz = 50
[reference]
rate_hz = 5
position_sigma_m = 0.002
heading_sigma_deg = 0.2
[[run]]
name = "tour"
[[run.path]]
drive = "pause"
duration_s = {pause_s}
[[run.path]]
drive = "tour"
length_m = {length_m}
box_x_m = 4
box_y_m = 4
"""
MINUTE = 14.0  # [m] of way that take about a minute


def make_logs(folder: Path, robots: range, logs: int, robot_file: Path, length_m: float = MINUTE) -> None:
    """folder/robot_0001/2026-03-02/: a recording each. The same numbers give the same bytes."""
    with tempfile.TemporaryDirectory() as work:
        scenario = Path(work, "scenario.toml")
        for robot in robots:
            draw = random.Random(robot)
            truth = {"track": draw.gauss(0.303, 0.001), "left": draw.gauss(0.1, 2e-4), "right": draw.gauss(0.1, 2e-4),
                     "bias": draw.gauss(0.0, 0.01), "scale": draw.gauss(1.0, 0.004)}
            scenario.write_text(_SCENARIO.format(robot=robot_file.resolve(), length_m=length_m, pause_s=min(4.0, length_m), **truth))
            for number in range(logs):
                day = datetime.date(2026, 3, 2) + datetime.timedelta(7 * number)
                trundle.simulate(scenario, folder / f"robot_{robot:04}" / day.isoformat(), seed=1000 * robot + number)


def finals(url: str) -> list[list[str]]:
    """Every final row of runs, parameters and findings, in the order of their logs."""
    database = store.Store(url)
    paths = {row.id: row.path for row in database.rows(sqlalchemy.select(store.logs))}

    def rows_of(table: sqlalchemy.Table) -> list[str]:
        rows = database.rows(sqlalchemy.select(table))
        return sorted(repr((paths[row.log_id], *[value for key, value in row._mapping.items() if key != "log_id"])) for row in rows)

    return [rows_of(table) for table in (store.runs, store.parameters, store.findings)]
