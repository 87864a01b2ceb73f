"""A fleet page of ROBOTS simulated robots, without logs: fleet_page.py FOLDER [ROBOTS]. Prints its file, and on standard error how
long the statistics and writing it took."""

from __future__ import annotations

import datetime
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy
import sqlalchemy
from trundle.fleet import store
from trundle.fleet.page import write_page

PARAMETERS = (("left.diameter", "m", 0.1, 2e-4, 5e-5), ("right.diameter", "m", 0.1, 2e-4, 5e-5), ("track", "m", 0.3, 1e-3, 2e-4),
              ("gyro.scale", "1", 1.0, 4e-3, 1e-3), ("gyro.bias", "rad/s", 0.0, 1e-2, 3e-4))


class Rows(NamedTuple):
    logs: list[dict[str, object]]
    robots: list[dict[str, object]]
    runs: list[dict[str, object]]
    parameters: list[dict[str, object]]


def simulated(robots: int, runs: int) -> Rows:
    """One robot in 100 is outlying, one in 100 changes by 1 %, one in 100 wears, one run in 200 failed; two types of robots."""
    rng, rows = numpy.random.Generator(numpy.random.Philox(1)), Rows([], [], [], [])
    for number in range(robots):
        name, kind = f"robot_{number:05}", "kobuki" if number % 10 else "husky"
        truth = [nominal + spread * rng.standard_normal() + (8 * spread if number % 100 == 7 else 0.0) for _, _, nominal, spread, _ in PARAMETERS]
        rows.robots.append({"name": name, "type": kind, "robot_file": "/robots/robot.toml"})
        for run in range(runs):
            log_id = len(rows.runs) + 1
            date = (datetime.date(2026, 1, 5) + datetime.timedelta(7 * run)).isoformat()
            log, failed = f"/logs/{name}/{date}", rng.random() < 0.005
            rows.logs.append({"id": log_id, "path": log, "robot_file": "/robots/robot.toml", "robot": name, "date": date, "request": "",
                              "state": "failed" if failed else "done", "attempts": 0, "losses": 0})
            rows.runs.append({"log_id": log_id, "log": log, "robot": name, "type": "" if failed else kind, "date": date,
                              "status": "failed" if failed else "done", "line": f"{log}/wheels.csv:1: has no column 'right_ticks'" if failed else "",
                              "log_sha256": "", "robot_sha256": "", "version": "", "limits": "", "position_rms_after_m": 0.01 + 0.01 * rng.random(),
                              "slip_share": 0.01 * rng.random(), "document": "{}"})
            for value, (parameter, unit, nominal, _, sigma) in zip(truth, PARAMETERS):
                step = 0.01 * nominal if number % 100 == 3 and run >= runs // 2 and parameter == "left.diameter" else 0.0
                if number % 100 == 13 and parameter == "left.diameter":
                    step = 0.002 * nominal * run
                if not failed:
                    rows.parameters.append({"log_id": log_id, "name": parameter, "unit": unit, "nominal": nominal, "sigma": sigma,
                                            "value": value - step + sigma * rng.standard_normal(), "observable": True})
    return rows


def write(folder: Path, robots: int, runs: int = 3) -> list[str]:
    folder.mkdir(parents=True, exist_ok=True)
    url = f"sqlite:///{folder}/fleet.db"
    database = store.Store(url)
    database.create_tables()
    rows = simulated(robots, runs)

    def insert(connection: sqlalchemy.engine.Connection) -> None:
        for table, some in zip((store.logs, store.robots, store.runs, store.parameters), rows):
            connection.execute(table.delete())
            connection.execute(table.insert(), some)

    database.transact(insert)
    start = time.process_time()
    written = write_page(url, str(folder), "none", lambda *_: None)[0]
    print(f"statistics and page of {robots} robots: {time.process_time() - start:.1f} s of the processor", file=sys.stderr)
    return written


if __name__ == "__main__":
    print(write(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10000)[0])
