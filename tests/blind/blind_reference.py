"""Is `trundle calibrate --landmarks --with-reference` as sure as it is right, where nothing but its documentation says what the sensors do?

    blind_reference.py PROGRAM [--draws N] [--seed FIRST] [--noise-stated SHARE] [--keep FOLDER]

Simulates robots among landmarks that a reference watches (wheels of blind_odometry.py with a gyro or without, or a velocity that another program
computed), in steps of 1 ms and with none of the program's own code; calibrates them from sightings and positions together, and from sightings
alone, and compares the errors of all parameters with the sigmas that are stated of them.

A draw is a robot, a world and a drive of its own: the reference is motion capture, a total station, RTK or plain GPS; its clock may be off, it
may have gaps, fixes metres away or a spell on which all are; its antenna is anywhere on the robot; landmarks may have no names. Printed is, by
parameter and by class of reference, the mean of (error/sigma)², the share within 1.96 sigmas and how many; by what else the recordings are; and
the worst. The check: each draw's eᵀ P⁻¹ e of all parameters, whose sum is χ² where covariances are right, within the quantiles at 0.05 % and
99.95 %, by class of reference for drives whose reference has no fault, and for those where it has one; so each parameter of the first. Seeds are
fixed. With --noise-stated 0.5 robot files claim half of the noise, and checks must fail. The table of 120 draws, in 20 minutes:

    blind_reference.py PROGRAM --draws 120

One draw, with its recordings and both results left in a folder, and the words that the program printed:

    blind_reference.py PROGRAM --draws 1 --seed 17 --keep FOLDER
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from blind_slam import TAIL, Array, chi_square_quantile, rotated, scattered, verdict
from wheeled import STEP_S, Drive, Recording, Robot

CLASSES = {"capture": (100.0, 0.001), "station": (5.0, 0.005), "RTK": (1.0, 0.02), "GPS": (1.0, 0.5)}  # [Hz, m]
PLATFORMS = ("wheels", "wheels, gyro", "velocity")
WAYS = {"with reference": ["--landmarks", "--with-reference"], "sightings alone": ["--landmarks"]}
LENGTHS = ("left.diameter", "right.diameter", "track", "velocity.forward_scale")
SHOWN = 12  # worst errors


def save(file: Path, columns: dict[str, Any]) -> None:
    """To the last digit: coordinates may be those of a country's grid."""
    lines = [",".join(columns), *(",".join(str(cell) for cell in row) for row in zip(*columns.values()))]
    file.write_text("\n".join(lines) + "\n")


class Sensor:
    """What sees the landmarks: as its file says, and as it is."""

    def __init__(self, rng: np.random.Generator, free: bool) -> None:
        self.hz, self.view_rad, self.range_m = rng.choice([1, 2, 5, 10]), math.radians(rng.choice([120, 200, 360])), rng.choice([6.0, 9.0])
        self.sigmas = np.array([rng.choice([0.02, 0.05]), math.radians(rng.choice([0.5, 1.5]))])  # [m, rad]
        self.place = rng.uniform([-0.1, -0.1], [0.25, 0.1])  # in the file [m]
        self.truth = {"sensor.range_scale": 1 + 0.02 * rng.normal()}
        errors = {"range_offset": 0.04, "bearing_offset": math.radians(1.5), "x": 0.02, "y": 0.02}
        self.truth |= {f"sensor.{name}": free * sigma * rng.normal() for name, sigma in errors.items()}
        self.truth["sensor.x"] += self.place[0]
        self.truth["sensor.y"] += self.place[1]
        self.truth["sensor.depth_share"] = float(free and rng.random() < 0.15)
        self.truth["sensor.time_offset"] = float(rng.choice([0.0, rng.uniform(-0.2, 0.2)])) if free else 0.0

    def file(self, stated: float) -> str:
        return (f"[landmark_sensor]\nx_m = {self.place[0]}\ny_m = {self.place[1]}\nmax_range_m = {self.range_m * 1.1 + 0.2}\n"
                f"range_sigma_m = {stated * self.sigmas[0]}\nbearing_sigma_deg = {stated * math.degrees(self.sigmas[1])}\n")

    def record(self, folder: Path, drive: Drive, landmarks: Array, rng: np.random.Generator, named: bool, whole_ms: bool) -> None:
        rows: list[tuple[Any, ...]] = []
        said = {name.partition(".")[2]: value for name, value in self.truth.items()}
        for moment in np.arange(rng.uniform(0, 1 / self.hz), drive.seconds, 1 / self.hz):
            pose = drive.at(np.array([moment]))[0]
            stamp = moment - said["time_offset"]
            for i, (x, y) in enumerate(rotated(landmarks - pose[:2], -pose[2]) - [said["x"], said["y"]]):
                away, bearing = math.hypot(x, y), math.remainder(math.atan2(y, x) + said["bearing_offset"], 2 * math.pi)
                if 0.4 < away < self.range_m and abs(bearing) < self.view_rad / 2 and rng.random() < 0.9:
                    reading = said["range_scale"] * away * (1 - said["depth_share"] * (1 - math.cos(bearing))) + said["range_offset"]
                    noisy = np.array([reading, bearing]) + self.sigmas * rng.normal(size=2)
                    if noisy[0] > 0.1:
                        rows.append((round(stamp, 3) if whole_ms else stamp, str(i + 1) if named else "", float(noisy[0]), float(noisy[1])))
        save(folder / "sightings.csv", dict(zip(["time_s", "landmark", "range_m", "bearing_rad"], zip(*rows))))


class VelocityRobot(Robot):
    """A differential drive of which only the velocity is known that something on board computed."""

    def __init__(self, rng: np.random.Generator, gyro: bool) -> None:
        super().__init__(rng, "differential", gyro, 1.0)
        self.wheels_hz = rng.choice([5, 10, 20, 50, 100])
        self.turn_m, self.turn_rad = rng.choice([0.003, 0.01, 0.02]), rng.choice([0.003, 0.01, 0.02])  # [rad/√m, rad/√rad]
        self.truth = {"gyro.scale": self.truth["gyro.scale"], "velocity.forward_scale": 1 + 0.03 * rng.normal(), "velocity.yaw_scale": 1 + 0.04 * rng.normal(),
                      "velocity.yaw_per_forward": 0.02 * rng.normal(), "velocity.yaw_bias": 0.004 * rng.normal()}

    def row(self, wheel: Any, angle: Array | None = None) -> Array:
        return np.array([1.0, 0, -wheel.y])

    def file(self, stated: float) -> str:
        text = super().file(stated)
        return (text[text.index("[gyro]" if self.gyro else "[noise]"):] + f"turn_per_sqrt_m = {stated * self.turn_m}\nturn_per_sqrt_rad = {stated * self.turn_rad}\n")

    def record(self, folder: Path, drive: Drive, rng: np.random.Generator) -> None:
        """Means since the row before."""
        folder.mkdir(parents=True)
        hz, said = self.wheels_hz, self.truth
        moments = rng.uniform(0, 1 / hz) + np.arange(0, drive.seconds - 1.01 / hz, 1 / hz)
        steps = np.diff(drive.poses, axis=0)
        way = rotated(steps[:, :2], -drive.poses[:-1, 2] - steps[:, 2] / 2)[:, 0]
        turned = steps[:, 2]
        noisy_way = way + self.roll * np.sqrt(np.abs(way)) * rng.normal(size=len(way))
        noisy_turn = turned + self.turn_m * np.sqrt(np.abs(way)) * rng.normal(size=len(way)) + self.turn_rad * np.sqrt(np.abs(turned)) * rng.normal(size=len(way))
        read_way = noisy_way / said["velocity.forward_scale"]
        read_turn = (noisy_turn - said["velocity.yaw_per_forward"] * read_way - said["velocity.yaw_bias"] * STEP_S) / said["velocity.yaw_scale"]
        at = np.arange(len(way) + 1) * STEP_S
        rates = [np.diff(np.interp(moments, at, np.concatenate([[0], np.cumsum(read)])), prepend=0.0) * hz for read in (read_way, read_turn)]
        rates[1][0] = -said["velocity.yaw_bias"] / said["velocity.yaw_scale"]  # at rest before
        save(folder / "velocity.csv", {"time_s": np.round(moments, 3) if self.whole_ms else moments, "forward_m_s": rates[0], "yaw_rate_rad_s": rates[1]})
        if self.gyro:  # a robot without wheels: of these the recorder writes stamps alone
            wheels, self.wheels = self.wheels, []
            Recording(folder / "gyro", self, drive, rng)
            self.wheels = wheels
            (folder / "gyro" / "gyro.csv").rename(folder / "gyro.csv")
            (folder / "gyro" / "wheels.csv").unlink()
            (folder / "gyro").rmdir()


@dataclass
class Draw:
    """A robot, its world and what was recorded; all from the seed."""

    seed: int
    folder: Path
    stated: float
    traits: dict[str, str] = field(default_factory=dict)
    truth: dict[str, float] = field(default_factory=dict)
    biases: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        rng = np.random.default_rng([self.seed, 7])
        kind, platform = list(CLASSES)[self.seed % 4], PLATFORMS[self.seed // 4 % 3]
        free = self.free = bool(rng.random() < 0.75)
        named = bool(rng.random() < 0.75)
        self.robot = robot = (VelocityRobot(rng, bool(rng.random() < 0.3)) if platform == "velocity" else
                              Robot(rng, "differential", platform == "wheels, gyro", 1.0, rates_hz=(5, 10, 20, 50, 100), ticks=(20, 60, 360, 1000, 4096)))
        robot.bias_spread = 0.0
        if kind == "GPS":
            robot.speed_m_s = rng.choice([0.4, 0.8])
        self.sensor = sensor = Sensor(rng, free)
        self.truth = {**robot.truth, **sensor.truth}
        seconds = float(rng.uniform(60, 300))
        drive = Drive(robot, rng, seconds)
        landmarks = scattered(rng, drive, int(rng.integers(8, 26)))
        self.lever = rng.uniform(-0.3, 0.3, size=2) if rng.random() < 0.7 else np.zeros(2)
        self.late_s = float(rng.uniform(-0.2, 0.2)) if rng.random() < 0.35 else 0.0
        self.fault = str(rng.choice(["none", "gap", "fixes away", "spell"], p=[0.55, 0.15, 0.15, 0.15]))
        grid = bool(rng.random() < 0.3)
        second = bool(rng.random() < 0.15)
        walk, robot.walk = robot.walk, 0.0 if second else robot.walk  # what is said of the bias of one run of several is its mean
        for name in "ab" if second else "a":
            self.biases.append(robot.bias)
            if isinstance(robot, VelocityRobot):
                robot.record(self.folder / "runs" / name, drive, rng)
            else:
                Recording(self.folder / "runs" / name, robot, drive, rng)
            sensor.record(self.folder / "runs" / name, drive, landmarks, rng, named, robot.whole_ms)
            if name == "a":
                self.reference(self.folder / "runs" / "a", drive, rng, *CLASSES[kind], grid)
            if second:
                robot.bias, drive = robot.bias + 0.003 * rng.normal(), Drive(robot, rng, 60)
                landmarks = scattered(rng, drive, len(landmarks))
        robot.walk = walk
        (self.folder / "robot.toml").write_text(robot.file(self.stated) + sensor.file(self.stated) +
                                                f"[reference_sensor]\nx_m = {self.lever[0]}\ny_m = {self.lever[1]}\n")
        extent_m = float(np.ptp(drive.poses[:, :2], axis=0).max())
        self.traits = {"reference": kind, "platform": platform, "names": "names" if named else "no names", "fault": self.fault,
                       "reference's clock": "late" if self.late_s else "right", "freed": "sensor" if free else "nothing else", "rate of odometry": f"{robot.wheels_hz} Hz",
                       "ticks": "none" if platform == "velocity" else f"{robot.ticks}", "sightings": f"{sensor.hz} Hz", "coordinates": "grid" if grid else "near 0",
                       "runs": "two" if second else "one", "depths": "depths" if sensor.truth["sensor.depth_share"] else "distances",
                       "antenna": "aside" if self.lever.any() else "middle", "extent": f"{'below' if extent_m < 6 else 'above'} 6 m", "whole ms": str(robot.whole_ms)}

    def reference(self, folder: Path, drive: Drive, rng: np.random.Generator, hz: float, sigma_m: float, grid: bool) -> None:
        moments = rng.uniform(0, 1 / hz) + np.arange(0, drive.seconds - 1.01 / hz, 1 / hz)
        frame = rng.uniform(-3, 3, size=3) + (np.array([452000.0, 5411000.0, 0]) if grid else 0)
        poses = drive.at(moments)
        places = poses[:, :2] + rotated(np.broadcast_to(self.lever, (len(poses), 2)), poses[:, 2])
        places = frame[:2] + rotated(places, frame[2]) + sigma_m * rng.normal(size=(len(moments), 2))
        start = rng.uniform(10, drive.seconds - 25)
        within = (moments > start) & (moments < start + rng.uniform(5, 15))
        kept = np.ones(len(moments), bool)
        if self.fault == "gap":
            kept = ~within
        elif self.fault == "spell":
            angle = rng.uniform(-math.pi, math.pi)
            places[within] += rng.uniform(1, 5) * np.array([math.cos(angle), math.sin(angle)])
        elif self.fault == "fixes away":
            which = rng.random(len(moments)) < 0.02
            which[rng.integers(len(moments))] = True
            angles = rng.uniform(-math.pi, math.pi, size=int(which.sum()))
            places[which] += rng.uniform(2, 10, size=(len(angles), 1)) * np.stack([np.cos(angles), np.sin(angles)], -1)
        stamps = moments + self.late_s
        save(folder / "reference.csv", {"time_s": (np.round(stamps, 3) if self.robot.whole_ms else stamps)[kept], "x_m": places[kept, 0], "y_m": places[kept, 1]})

    def command(self, program: str, way: str) -> list[str]:
        free = ["--free", "sensor"] if self.free else []
        return [program, "calibrate", str(self.folder / "runs"), *WAYS[way], "--robot", str(self.folder / "robot.toml"),
                "-o", str(self.folder / way.replace(" ", "_") / "calibrated.toml"), *free]


@dataclass
class Error:
    way: str
    parameter: str
    squared: float
    seed: int
    traits: dict[str, str]


class ReferenceChecks:
    def __init__(self, program: str, stated: float) -> None:
        self.program, self.stated = program, stated
        self.errors: list[Error] = []
        self.nees: dict[str, list[tuple[float, int]]] = {}
        self.failed: list[str] = []
        self.held: dict[tuple[str, str], int] = {}

    def draw(self, seed: int, folder: Path, loud: bool) -> None:
        draw = Draw(seed, folder, self.stated)
        for way in WAYS:
            command = draw.command(self.program, way)
            Path(command[command.index("-o") + 1]).parent.mkdir()
            began = time.monotonic()
            try:
                done = subprocess.run([*command, *([] if loud else ["--json"])], capture_output=True, text=True, check=False, timeout=300)
            except subprocess.TimeoutExpired:
                self.failed.append(f"draw {seed}, {way}: more than 300 s")
                continue
            took_s = time.monotonic() - began
            if done.returncode != 0:
                self.failed.append(f"draw {seed}, {way}: exit code {done.returncode}, expected 0: {done.stderr.strip()}")
                continue
            if loud:
                print(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
            found = json.loads((folder / way.replace(" ", "_") / "calibration.json").read_text())
            mean = self.judge(draw, way, found)
            print(f"draw {seed}, {way}: {mean:.2f} in {took_s:.1f} s; {', '.join(draw.traits.values())}", flush=True)

    def judge(self, draw: Draw, way: str, found: dict[str, Any]) -> float:
        """The mean squared error over sigma of one calibration."""
        before = len(self.errors)

        def add(name: str, error: float, sigma: float) -> None:
            if not (math.isfinite(error) and sigma is not None and math.isfinite(sigma) and sigma > 0):
                self.failed.append(f"draw {draw.seed}, {way}: {name} has error {error}, sigma {sigma}")
            else:
                self.errors.append(Error(way, name, (error / sigma) ** 2, draw.seed, draw.traits))

        errors = {}
        for p in found["parameters"]:
            name = p["name"]
            if name == "gyro.bias":
                if len(draw.biases) == 1 and p["sigma_total"]:
                    add(name, p["value"] - draw.biases[0], p["sigma_total"])
            elif not p["observable"]:
                self.held[way, name] = self.held.get((way, name), 0) + 1
            elif name in draw.truth:
                errors[name] = p["value"] - draw.truth[name]
                add(name, errors[name], p["sigma_total"])
        for i, run in enumerate(found["runs"]):
            if run["gyro_bias"] and len(draw.biases) > 1:
                add("gyro.bias of a run", run["gyro_bias"]["rad_s"] - draw.biases[i], run["gyro_bias"]["sigma_rad_s"])
            if run["reference_clock"] and way == "with reference":
                add("reference's clock", run["reference_clock"]["time_offset_s"] + draw.late_s, run["reference_clock"]["sigma_s"])
        names = [name for name in found["correlation"]["names"]]
        kept = [i for i, name in enumerate(names) if name in errors]
        error = np.array([errors[names[i]] for i in kept])
        covariance = np.array(found["correlation"]["covariance_total"])[np.ix_(kept, kept)]
        sigmas = np.sqrt(np.diag(covariance))
        variances, modes = np.linalg.eigh(covariance / np.outer(sigmas, sigmas))
        told = variances > 1e-7
        which = draw.traits["reference"] if draw.fault in ("none", "gap") else "a reference with a fault"
        total = float(((modes.T @ (error / sigmas))[told] ** 2 / variances[told]).sum())
        self.nees.setdefault(f"{way}, {which}", []).append((total, int(told.sum())))
        these = [e.squared for e in self.errors[before:]]
        return float(np.mean(these)) if these else math.nan

    def cell(self, errors: list[Error]) -> str:
        if not errors:
            return f"{'-':>17}"
        squared = np.array([e.squared for e in errors])
        low, high = (chi_square_quantile(len(squared), p) / len(squared) for p in (TAIL, 1 - TAIL))
        return f"{squared.mean():7.2f}{' ' if low <= squared.mean() <= high else '*'} {100 * (squared < 1.96 ** 2).mean():3.0f}% {len(squared):3d}"

    def tables(self) -> None:
        columns = [*CLASSES, "all", "no fault"]
        for way in WAYS:
            print(f"\n{way}: mean (error/sigma)², share within 1.96 sigmas, count; * beyond what chance leaves")
            print(f"{'':26}" + "".join(f"{c:>18}" for c in columns))
            these = [e for e in self.errors if e.way == way]
            for name in sorted({e.parameter for e in these}) + ["all"]:
                rows = [e for e in these if name in (e.parameter, "all")]
                cells = [[e for e in rows if e.traits["reference"] == c or c == "all" or (c == "no fault" and e.traits["fault"] in ("none", "gap"))] for c in columns]
                held = self.held.get((way, name), 0)
                print(f"{name:26}" + " ".join(self.cell(c) for c in cells) + (f"   held {held}" if held else ""))
        print("\nby what recordings are: with reference | sightings alone; errors of a draw are not independent")
        for trait in self.errors[0].traits if self.errors else []:
            for value in sorted({e.traits[trait] for e in self.errors}):
                cells = [self.cell([e for e in self.errors if e.way == way and e.traits[trait] == value]) for way in WAYS]
                print(f"{trait + ': ' + value:34}" + " | ".join(cells))
        print("\nworst, with reference:")
        for e in sorted((e for e in self.errors if e.way == "with reference"), key=lambda e: -e.squared)[:SHOWN]:
            print(f"draw {e.seed}: {e.parameter}, {math.sqrt(e.squared):.1f} sigmas; {', '.join(e.traits.values())}")

    def failures(self) -> list[str]:
        failed = list(self.failed)
        print()
        totals = {f"{check}: parameters": nees for check, nees in self.nees.items()}
        for e in self.errors:
            if e.way == "with reference" and e.traits["fault"] in ("none", "gap"):
                totals.setdefault(f"with reference, {e.parameter}", []).append((e.squared, 1))
        for check, nees in totals.items():
            total, degrees = sum(n for n, _ in nees), sum(d for _, d in nees)
            low, high = (chi_square_quantile(degrees, p) / degrees for p in (TAIL, 1 - TAIL))
            text = f"{check}: NEES per degree of freedom {total / degrees:.3f}, expected {low:.3f} to {high:.3f} ({len(nees)} draws)"
            print(text)
            if not low <= total / degrees <= high and not check.startswith("sightings alone"):
                failed.append(text)
        return failed


def main() -> int:
    parser = argparse.ArgumentParser(description="Compares errors of calibrations from landmarks and a reference with the sigmas that are stated of them.")
    parser.add_argument("program")
    parser.add_argument("--noise-stated", type=float, default=1.0, help="share of the noise that robot files claim")
    parser.add_argument("--draws", type=int, default=24, help="robots, each in a world of its own")
    parser.add_argument("--seed", type=int, default=0, help="of the first draw")
    parser.add_argument("--keep", type=Path, help="leave recordings and results in this folder, and print what the program says")
    options = parser.parse_args()
    checks = ReferenceChecks(options.program, options.noise_stated)
    for seed in range(options.seed, options.seed + options.draws):
        if options.keep:
            (options.keep / str(seed)).mkdir(parents=True)
            checks.draw(seed, options.keep / str(seed), True)
        else:
            with tempfile.TemporaryDirectory() as folder:
                checks.draw(seed, Path(folder), False)
    checks.tables()
    return verdict(checks.failures())


if __name__ == "__main__":
    sys.exit(main())
