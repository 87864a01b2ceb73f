"""Is `trundle` as sure as it is right, where nothing but its documentation says what the sensors do?

    blind_slam.py PROGRAM [--draws N] [--sigma-stated SHARE]

Simulates robots among landmarks from what docs/ says of wheels, gyros and landmark sensors, in steps of 1 ms and with none of the
program's own code, runs the program on the recordings, and compares its errors with the covariances that it states of them.

A draw is a world of its own: chassis, rates, resolutions, noises, motions and landmarks. Each check takes one NEES of each draw,
eᵀ P⁻¹ e of the last pose (3 degrees of freedom), of the whole map with the covariance of all its landmarks together (2 for each),
of all parameters or of a clock, so what errs together within a draw counts once. Draws are independent: where covariances are right the sum of
their NEES has the χ² distribution with the sum of their degrees of freedom, and a check fails where it is outside of that
distribution's quantiles at 0.05 % and 99.95 %. Seeds are fixed. With --sigma-stated 0.5 the robot files claim half of the landmark
sensor's noise, and checks must fail.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Nees = tuple[float, int]  # and its degrees of freedom

STEP_S = 1e-3
DIAMETER_M = 0.15
HALF_TRACK_M = 0.2  # of omni wheels: from the middle
WHEELBASE_M = 0.5
STEERING_SIGMA_RAD = math.radians(0.5)
SENSOR_M = np.array([0.15, 0.05])
TAIL = 0.0005

# name, place [m], rolling direction [rad]
TWO_WHEELS = [("left", np.array([0, HALF_TRACK_M]), 0.0), ("right", np.array([0, -HALF_TRACK_M]), 0.0)]
FOUR_WHEELS = [(name, HALF_TRACK_M * np.array([math.cos(a), math.sin(a)]), a + math.pi / 2)
               for name, a in zip("abcd", np.radians([45, 135, 225, 315]))]


def rotated(points: Array, angle_rad: Array | float) -> Array:
    """Points [m] in rows, turned counter-clockwise."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.stack([c * points[..., 0] - s * points[..., 1], s * points[..., 0] + c * points[..., 1]], -1)


def wrapped(angle_rad: float) -> float:
    """Within half a turn [rad]."""
    return math.remainder(angle_rad, 2 * math.pi)


class Robot:
    """A chassis, its sensors and how it drives, drawn from what robots have."""

    def __init__(self, rng: np.random.Generator, chassis: str, worn: bool = False) -> None:
        self.chassis = chassis  # differential, omni or car
        self.wheels = FOUR_WHEELS if chassis == "omni" else TWO_WHEELS
        self.gyro = bool(rng.random() < 0.7)
        self.wheels_hz, self.gyro_hz, self.sensor_hz = rng.choice([10, 20, 50, 100]), rng.choice([25, 50, 100]), rng.choice([1, 2, 5, 10])
        self.ticks = rng.choice([360, 1000, 4096])  # per revolution
        self.roll, self.slide = rng.choice([0.002, 0.005, 0.01]), rng.choice([0.0005, 0.002])  # of travel, sideways [m/√m]
        self.density, self.walk = rng.choice([1e-4, 5e-4]), rng.choice([3e-6, 1e-5])  # of the gyro [rad/s/√Hz, rad/s/√s]
        self.sigmas = np.array([rng.choice([0.02, 0.05]), math.radians(rng.choice([0.5, 1.5]))])  # of ranges, bearings [m, rad]
        self.range_m, self.view_rad = rng.choice([6.0, 9.0]), math.radians(rng.choice([200, 360]))
        self.speed_m_s, self.rest_s = rng.uniform(0.3, 0.8), rng.choice([0.0, 3.0])
        self.wear = 1 + worn * rng.normal(size=3) * [0.02, 0.02, 0.05]  # left, right wheel and track, as shares of those in its file
        self.metre = 1 + 0.02 * rng.normal() if worn else 1.0  # what ranges are too long by: 2 % as sensors come

    def file(self, sigma_stated: float) -> str:
        """robot.toml, which claims `sigma_stated` of the landmark sensor's noise."""
        lines = []
        for name, (x, y), direction in self.wheels:
            lines += ["[[wheel]]", f'name = "{name}"', f"x_m = {x:.12f}", f"y_m = {y:.12f}", f"direction_deg = {math.degrees(wrapped(direction)):.9f}",
                      f'kind = "{"omni" if self.chassis == "omni" else "fixed"}"', f"diameter_m = {DIAMETER_M}", f"ticks_per_revolution = {self.ticks}"]
        if self.chassis == "car":
            lines += ["[[wheel]]", 'name = "front"', f"x_m = {WHEELBASE_M}", "passive = true", "steered = true",
                      f"steering_sigma_deg = {math.degrees(STEERING_SIGMA_RAD)}"]
        if self.gyro:
            lines += ["[gyro]", f"noise_rad_s_sqrt_hz = {self.density}", f"bias_walk_rad_s_sqrt_s = {self.walk}", "bias_sigma_rad_s = 0.01"]
        lines += ["[noise]", f"wheel_per_sqrt_m = {self.roll}", f"lateral_per_sqrt_m = {self.slide}",
                  "[landmark_sensor]", f"x_m = {SENSOR_M[0]}", f"y_m = {SENSOR_M[1]}", f"max_range_m = {self.range_m + 0.5}",
                  f"range_sigma_m = {sigma_stated * self.sigmas[0]}", f"bearing_sigma_deg = {sigma_stated * math.degrees(self.sigmas[1])}"]
        return "\n".join(lines) + "\n"


class Drive:
    """Where a robot was, from 0 s on in steps of 1 ms: around in bends that never repeat, from rest to rest, with a stop on the way."""

    def __init__(self, robot: Robot, rng: np.random.Generator, seconds: float, start: Array) -> None:
        t = np.arange(0, seconds, STEP_S) + STEP_S / 2
        pace = np.clip(np.minimum.reduce([t - robot.rest_s, seconds - 1 - t, np.abs(t - seconds / 2) - 1]), 0, 1)
        bends = sum(np.sin(2 * math.pi * (t / rng.uniform(5, 20) + rng.random())) for _ in range(2))
        per_m = rng.choice([-1, 1]) * (0.3 + 0.25 * bends)  # turn [rad/m]
        ahead, self.steering_rad = robot.speed_m_s * pace * STEP_S, np.arctan(WHEELBASE_M * np.append(per_m, per_m[-1]))
        skids = robot.slide * np.sqrt(ahead) * rng.normal(size=(2, len(t)))  # of what cannot skid: the rear wheels, and a car's front beside them
        turn = ahead * per_m + (skids[1] / WHEELBASE_M if robot.chassis == "car" else 0)
        aside = 0.4 * ahead * np.sin(2 * math.pi * t / rng.uniform(8, 15)) if robot.chassis == "omni" else skids[0]
        heading = start[2] + np.concatenate([[0], np.cumsum(turn)])
        steps = rotated(np.stack([ahead, aside], -1), heading[:-1] + turn / 2)
        self.motions = np.stack([ahead, aside, turn], -1)  # [m, m, rad] of each step, in the robot's frame
        self.poses = np.column_stack([start[:2] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, 0)]), heading])  # x [m], y [m], heading [rad]

    def at(self, time_s: float) -> Array:
        """The pose."""
        return np.array([np.interp(time_s / STEP_S, np.arange(len(self.poses)), column) for column in self.poses.T])


def write(file: Path, columns: dict[str, Array]) -> None:
    np.savetxt(file, np.column_stack(list(columns.values())), fmt="%.9g", delimiter=",", header=",".join(columns), comments="")


def record(folder: Path, robot: Robot, drive: Drive, landmarks: Array, rng: np.random.Generator, sigma_stated: float, late_s: float = 0.0) -> None:
    """What wheels, gyro and landmark sensor say of a drive, as a recording with its robot file; the sensor's stamps are late."""
    folder.mkdir()
    (folder / "robot.toml").write_text(robot.file(sigma_stated))
    count = len(drive.motions)
    read = np.arange(0, count + 1, round(1 / robot.wheels_hz / STEP_S))
    wheels = {"time_s": read * STEP_S}
    for i, (name, (x, y), direction) in enumerate(robot.wheels):
        travel = drive.motions @ [math.cos(direction), math.sin(direction), (x * math.sin(direction) - y * math.cos(direction)) * robot.wear[2]]
        rolled = np.concatenate([[0], np.cumsum(travel + robot.roll * np.sqrt(np.abs(travel)) * rng.normal(size=count))])
        tick_m = math.pi * DIAMETER_M * robot.wear[i % 2] / robot.ticks
        wheels[f"{name}_ticks"] = np.floor(rolled[read] / tick_m + rng.random())
    if robot.chassis == "car":
        wheels["front_steering_rad"] = drive.steering_rad[read] + STEERING_SIGMA_RAD * rng.normal(size=len(read))
    write(folder / "wheels.csv", wheels)
    if robot.gyro:
        read = np.arange(0, count + 1, round(1 / robot.gyro_hz / STEP_S))
        rates = np.diff(drive.poses[read, 2], prepend=drive.poses[0, 2]) * robot.gyro_hz
        rates += 0.01 * rng.normal() + np.cumsum(robot.walk / math.sqrt(robot.gyro_hz) * rng.normal(size=len(read)))
        rates += robot.density * math.sqrt(robot.gyro_hz) * rng.normal(size=len(read))
        write(folder / "gyro.csv", {"time_s": read * STEP_S, "yaw_rate_rad_s": rates})
    sightings = []
    for time_s in np.arange(rng.uniform(0, 1 / robot.sensor_hz), count * STEP_S, 1 / robot.sensor_hz):
        pose = drive.at(time_s)
        for i, line in enumerate(rotated(landmarks - pose[:2], -pose[2]) - SENSOR_M):
            true = np.array([math.hypot(*line), math.atan2(line[1], line[0])])
            if 0.4 < true[0] < robot.range_m and abs(true[1]) < robot.view_rad / 2 and rng.random() < 0.9:
                sightings.append([time_s + late_s, i, *(true * [robot.metre, 1] + robot.sigmas * rng.normal(size=2))])
    write(folder / "sightings.csv", dict(zip(["time_s", "landmark", "range_m", "bearing_rad"], np.array(sightings).T)))


def scattered(rng: np.random.Generator, drive: Drive, count: int) -> Array:
    """Landmarks [m] around a drive, none within 0.8 m of another."""
    low, high = drive.poses[:, :2].min(0) - 2, drive.poses[:, :2].max(0) + 2
    found = np.empty((0, 2))
    while len(found) < count:
        place = rng.uniform(low, high)
        if (np.hypot(*(found - place).T) > 0.8).all():
            found = np.vstack([found, place])
    return found


def table(file: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in file.read_text().splitlines() if not line.startswith("#")))


def normalised(error: Array, covariance: Array) -> Nees:
    return float(error @ np.linalg.solve(covariance, error)), len(error)


def last_pose(file: Path, drive: Drive) -> Nees:
    row = {name: float(value) for name, value in table(file)[-1].items()}
    error = np.array([row["x_m"], row["y_m"], row["heading_rad"]]) - drive.at(row["time_s"])
    error[2] = wrapped(error[2])
    variances = np.array([row[f"var_{axes}"] for axes in ("xx", "xy", "xh", "yy", "yh", "hh")])
    return normalised(error, variances[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])


def whole_map(folder: Path, landmarks: Array, named: bool = True) -> Nees:
    """Of a map in its sensor's metre, which begins at the origin. A name that `merge` kept apart is 2/NAME; a landmark without one is taken for the nearest that there is."""
    rows = table(folder / "landmarks.csv")
    places = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows])
    which = [int(row["landmark"].rpartition("/")[2]) for row in rows] if named else [int(np.argmin(np.hypot(*(landmarks - place).T))) for place in places]
    covariance = np.array([[float(v) for k, v in row.items() if k.startswith("cov_")] for row in table(folder / "landmarks_covariance.csv")])
    said = folder / "slam.json"
    metre = json.loads(said.read_text()).get("metre_sigma", 0.0) * places.ravel() if said.exists() else 0 * places.ravel()
    return normalised((places - landmarks[which]).ravel(), covariance + np.outer(metre, metre))


def parameters(file: Path, robot: Robot) -> Nees:
    """Of a calibration; all but the gyro's bias, which is another one in each recording."""
    found = json.loads(file.read_text())
    shares = {"left.diameter": robot.wear[0], "right.diameter": robot.wear[1], "track": robot.wear[2], "gyro.scale": 1.0}
    error = {p["name"]: p["value"] - p["nominal"] * shares[p["name"]] for p in found["parameters"] if p["name"] in shares}
    names = found["correlation"]["names"]
    kept = [i for i, name in enumerate(names) if name in error]
    return normalised(np.array([error[names[i]] for i in kept]), np.array(found["correlation"]["covariance_total"])[np.ix_(kept, kept)])


class Checks:
    """Runs the program, and collects NEES by check."""

    def __init__(self, program: str, sigma_stated: float) -> None:
        self.program, self.sigma_stated = program, sigma_stated
        self.found: dict[str, list[Nees]] = {}
        self.refused: list[str] = []

    def run(self, *arguments: object) -> bool:
        done = subprocess.run([self.program, *map(str, arguments), "--quiet"], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            self.refused.append(f"{' '.join(map(str, arguments))}: exit code {done.returncode}, expected 0: {done.stderr.strip()}")
        return done.returncode == 0

    def add(self, check: str, nees: Nees) -> None:
        self.found.setdefault(check, []).append(nees)

    def draw(self, folder: Path, seed: int) -> None:
        """One world, driven through twice; its frame is the start of the first drive."""
        rng = np.random.default_rng(seed)
        robot = Robot(rng, ["differential", "omni", "car"][seed % 3])
        a, b, known = folder / "a", folder / "b", folder / "smoother"
        first = Drive(robot, rng, rng.choice([40, 60, 90]), np.zeros(3))
        second = Drive(robot, rng, 40, first.poses[rng.integers(len(first.poses))] + [0, 0, rng.uniform(-3, 3)])
        landmarks = scattered(rng, first, rng.choice([12, 20, 30]))
        record(a, robot, first, landmarks, rng, self.sigma_stated)
        record(b, robot, second, landmarks, rng, self.sigma_stated)
        file = ("--robot", a / "robot.toml")
        ways: dict[str, list[object]] = {"smoother": [], "ekf": ["--filter", "ekf"], "window": ["--window", 20], "no names": ["--unknown-ids"]}
        for name, options in ways.items():
            if self.run("slam", a, *file, *options, "-o", folder / name):
                self.add(f"slam, {name}: last pose", last_pose(folder / name / "trajectory.csv", first))
                self.add(f"slam, {name}: map", whole_map(folder / name, landmarks, name != "no names"))
        x, y, heading = second.poses[0] + rng.normal(size=3) * [0.2, 0.2, math.radians(5)]
        start = ["--start", f"{x},{y},{math.degrees(heading)}", "--start-sigma-m", 0.2, "--start-sigma-deg", 5]
        ways = {"from nowhere": [], "no names": [*start, "--unknown-ids"]}
        for name, options in ways.items():
            if self.run("localize", b, *file, "--map", known / "landmarks.csv", *options, "-o", folder / "found.csv"):
                self.add(f"localize, {name}: last pose", last_pose(folder / "found.csv", second))
        if self.run("slam", a, b, "--together", "-o", folder / "together"):
            self.add("slam, together: last pose of the second", last_pose(folder / "together" / "b" / "trajectory.csv", second))
            self.add("slam, together: map", whole_map(folder / "together", landmarks))
        if self.run("slam", b, *file, "-o", folder / "other") and self.run("merge", known, folder / "other", "-o", folder / "merged"):
            self.add("merge: map", whole_map(folder / "merged", landmarks))

    def calibration(self, folder: Path, seed: int) -> None:
        """Three drives of a robot of which neither wheels nor ranges are what its file says; the last with what the others show."""
        rng = np.random.default_rng(seed)
        robot = Robot(rng, "differential", worn=True)
        for name in "abc":
            drive = Drive(robot, rng, 60, np.zeros(3))
            landmarks = scattered(rng, drive, 15)
            record(folder / name, robot, drive, landmarks, rng, self.sigma_stated)
        if self.run("calibrate", folder / "a", folder / "b", "--landmarks", "--robot", folder / "a" / "robot.toml", "-o", folder / "calibrated.toml"):
            self.add("calibrate --landmarks: parameters", parameters(folder / "calibration.json", robot))
            for name, options in {"smoother": ["--smooth"], "ekf": ["--filter", "ekf"]}.items():
                if self.run("slam", folder / "c", "--robot", folder / "calibrated.toml", *options, "-o", folder / name):
                    self.add(f"slam, calibrated, {name}: last pose", last_pose(folder / name / "trajectory.csv", drive))
                    self.add(f"slam, calibrated, {name}: map", whole_map(folder / name, landmarks))

    def clock(self, folder: Path, seed: int) -> None:
        """A drive of worn wheels, with a landmark sensor that has a clock of its own; where that is told."""
        rng = np.random.default_rng(seed)
        robot, late_s = Robot(rng, ["differential", "omni", "car"][seed % 3], worn=True), rng.choice([0.0, rng.uniform(-0.3, 0.3)])
        drive = Drive(robot, rng, 60, np.zeros(3))
        record(folder / "a", robot, drive, scattered(rng, drive, 15), rng, self.sigma_stated, late_s)
        command = [self.program, "info", folder / "a", "--robot", folder / "a" / "robot.toml", "--json"]
        said = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
        if found := said["landmark_sensor_time_offset"]:
            self.add("info: clock of the landmark sensor", (((found["time_offset_s"] + late_s) / found["sigma_s"]) ** 2, 1))

    def failures(self) -> list[str]:
        failed = list(self.refused)
        for check, nees in self.found.items():
            total, degrees = sum(n for n, _ in nees), sum(d for _, d in nees)
            low, high = (chi_square_quantile(degrees, p) / degrees for p in (TAIL, 1 - TAIL))
            text = f"{check}: NEES per degree of freedom {total / degrees:.3f}, expected {low:.3f} to {high:.3f} ({len(nees)} draws)"
            print(text)
            if not low <= total / degrees <= high:
                failed.append(text)
        return failed


def judged(checks: Checks, draws: dict[Callable[[Path, int], None], range]) -> int:
    """Runs each step of them with each seed, in a folder of its own; the exit code."""
    for step, seeds in draws.items():
        for seed in seeds:
            with tempfile.TemporaryDirectory() as folder:
                step(Path(folder), seed)
    return verdict(checks.failures())


def verdict(failed: list[str]) -> int:
    """The exit code; what failed is printed."""
    for line in failed:
        print(f"failed: {line}", file=sys.stderr)
    return 1 if failed else 0


def chi_square_quantile(degrees: int, probability: float) -> float:
    """By the approximation of Wilson and Hilferty, right to 1 % from 20 degrees of freedom on."""
    spread = 2 / (9 * degrees)
    return float(degrees * (1 - spread + NormalDist().inv_cdf(probability) * math.sqrt(spread)) ** 3)


def main() -> int:
    parser = argparse.ArgumentParser(description="Compares errors with the covariances that are stated of them.")
    parser.add_argument("program")
    parser.add_argument("--sigma-stated", type=float, default=1.0, help="share of the landmark sensor's noise that robot files claim")
    parser.add_argument("--draws", type=int, default=24, help="worlds; calibrations are a third as many, clocks twice")
    options = parser.parse_args()
    checks = Checks(options.program, options.sigma_stated)
    return judged(checks, {checks.draw: range(options.draws), checks.calibration: range(1000, 1000 + options.draws // 3),
                           checks.clock: range(2000, 2000 + 2 * options.draws)})


if __name__ == "__main__":
    sys.exit(main())
