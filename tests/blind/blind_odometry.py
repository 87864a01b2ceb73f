"""Is `trundle` as sure as it is right about wheels, where nothing but its documentation says what the sensors do?

    blind_odometry.py PROGRAM [--draws N] [--noise-stated SHARE]

Simulates robots of many kinds from what docs/ says of wheels, gyros, steering and references, in steps of 1 ms and with none of the
program's own code, and compares the program's errors with what it states of them: of odometry, with parameters that are exact and with
calibrated ones; of calibrations from motion capture, positions, GPS and end poses; of clocks; of slips.

Each draw is a robot and a drive of its own; each check takes one NEES of each draw, eᵀ P⁻¹ e, whose sum is χ² where covariances are
right, or counts what has a stated probability. A check fails where the sum is outside of the distribution's quantiles at 0.05 % and
99.95 %, or the count outside of the binomial's. Errors of poses are Log(truth⁻¹ estimate) (docs/results/coverage.md, eq. 4): in these a
heading's error bends no other. Seeds are fixed. With --noise-stated 0.5 robot files claim half of the noise, and checks must fail.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np

from blind_slam import TAIL, Checks, judged, table
from wheeled import KINDS, STEP_S, Drive, Recording, Reference, Robot

WAYS = {"motion capture": Reference(50, 0.002, 0.005), "positions": Reference(20, 0.005), "GPS": Reference(5, 0.05),
        "end poses": Reference(0, 0.003, math.radians(0.5))}
CHI_SQUARE_3_95 = 7.815  # the quantile at 95 % for 3 degrees of freedom
SLIPPING = [("swerve", True), ("swerve", False), ("differential", True), ("omni3", True), ("omni4", False), ("mecanum", True), ("omni4", True), ("mecanum", False)]


class OdometryChecks(Checks):
    """Runs the program, and collects NEES and counts by check."""

    def __init__(self, program: str, stated: float) -> None:
        super().__init__(program, stated)
        self.counts: dict[str, list[bool]] = {}
        self.expected: dict[str, tuple[float, float]] = {}  # the probability is between these

    def answer(self, *arguments: object) -> dict[str, Any] | None:
        """What it prints with --json, or None where it refuses."""
        done = subprocess.run([self.program, *map(str, arguments), "--json"], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            self.refused.append(f"{' '.join(map(str, arguments))}: exit code {done.returncode}, expected 0: {done.stderr.strip()}")
            return None
        return cast(dict[str, Any], json.loads(done.stdout))

    def count(self, check: str, held: list[bool], low: float, high: float) -> None:
        """Each with a probability between `low` and `high`."""
        self.counts.setdefault(check, []).extend(held)
        self.expected[check] = low, high

    def odometry(self, folder: Path, seed: int) -> None:
        """Of exact parameters."""
        rng, kind = np.random.default_rng(seed), KINDS[seed % 9]
        robot = Robot(rng, kind, bool(rng.random() < 0.5), rates_hz=(10, 20, 30, 50, 100, 200), ticks=(12, 64, 360, 1000, 4096))
        recording = Recording(folder / "a", robot, Drive(robot, rng, 30), rng)
        (folder / "robot.toml").write_text(robot.file(self.sigma_stated))
        if self.answer("odometry", folder / "a", "--robot", folder / "robot.toml", "-o", folder / "a.csv"):
            rows = table(folder / "a.csv")
            self.add(f"odometry, {kind}: last pose", recording.nees(rows[-1]))
            middle = [row for row in rows[len(rows) // 2:] if float(row["var_xx"]) * float(row["var_hh"]) > 0]
            if middle:
                self.add("odometry: pose in the middle", recording.nees(middle[0]))

    def calibrated(self, folder: Path, robot: Robot, rng: np.random.Generator, reference: Reference, runs: str) -> tuple[list[str], Any, Any] | None:
        """Names, errors and covariance of what is calibrated, but for the gyro's bias, which each run has its own of."""
        for name in runs:
            Recording(folder / "runs" / name, robot, Drive(robot, rng, 30, rng.uniform(0.3, 0.5)), rng, reference)
        (folder / "robot.toml").write_text(robot.file(self.sigma_stated))
        found = self.answer("calibrate", folder / "runs", "--robot", folder / "robot.toml", "-o", folder / "calibrated.toml")
        if not found:
            return None
        errors = {p["name"]: p["value"] - robot.truth.get(p["name"], p["nominal"]) for p in found["parameters"] if p["name"] != "gyro.bias"}
        names = found["correlation"]["names"]
        kept = [i for i, name in enumerate(names) if name in errors]
        covariance = np.array(found["correlation"]["covariance_total"])[np.ix_(kept, kept)]
        return [names[i] for i in kept], np.array([errors[names[i]] for i in kept]), covariance

    def steering(self, folder: Path, seed: int) -> None:
        """Where steered wheels point ahead, by positions that hardly show how noisy the wheels are."""
        rng, kind = np.random.default_rng(seed), ("car", "tricycle")[seed % 2]
        robot = Robot(rng, kind, True, 1.0, False, ticks=(360, 1000, 4096))
        if found := self.calibrated(folder, robot, rng, WAYS["GPS"], "ab"):
            names, error, covariance = found
            if "front.steering_zero" in names:
                zero = names.index("front.steering_zero")
                self.add("calibrate, GPS: zero of the steering", (float(error[zero] ** 2 / covariance[zero, zero]), 1))

    def calibration(self, folder: Path, seed: int) -> None:
        """Of robots whose files are wrong, and odometry with the result."""
        rng, (way, reference) = np.random.default_rng(seed), list(WAYS.items())[seed % 4]
        kind = ("differential", "pods", "omni3", "differential", "mecanum")[seed // 4 % 5]
        robot = Robot(rng, kind, bool(rng.random() < 0.5), 1.0, bool(reference.sigma_rad), ticks=(64, 360, 1000, 4096))
        found = self.calibrated(folder, robot, rng, reference, "ab"[:rng.integers(1, 3)] if reference.hz else "abc")
        if not found:
            return
        _, error, covariance = found
        sigmas = np.sqrt(np.diag(covariance))
        variances, modes = np.linalg.eigh(covariance / np.outer(sigmas, sigmas))
        told = variances > 1e-7  # where the robot's own axes point is nobody's error
        self.add(f"calibrate, {way}: parameters", (float(((modes.T @ (error / sigmas))[told] ** 2 / variances[told]).sum()), int(told.sum())))
        which = rng.integers(len(error))  # one of each draw, for those of a draw are not independent
        self.count("calibrate: truth in the 95 % interval", [bool(abs(error[which]) < 1.96 * sigmas[which])], 0.95, 0.95)
        recording = Recording(folder / "c", robot, Drive(robot, rng, 30, 0.4), rng)
        if self.answer("odometry", folder / "c", "--robot", folder / "calibrated.toml", "-o", folder / "c.csv"):
            self.add("odometry, calibrated: last pose", recording.nees(table(folder / "c.csv")[-1]))

    def clocks(self, folder: Path, seed: int) -> None:
        """Of reference, gyro and steering, by `info`."""
        rng, kind = np.random.default_rng(seed), ("differential", "car", "omni3", "tricycle", "pods")[seed % 5]
        robot = Robot(rng, kind, True, 1.0)
        late = dict(zip(("reference", "gyro", "steering"), rng.choice([-1, 1], 3) * rng.uniform(0.03, [0.3, 0.1, 0.1])))
        reference = Reference(rng.choice([10, 50]), 0.002, 0.005, late["reference"])
        Recording(folder / "a", robot, Drive(robot, rng, 60, 0.4), rng, reference, late["gyro"], late["steering"])
        (folder / "robot.toml").write_text(robot.file(self.sigma_stated))
        answer = self.answer("info", folder / "a", "--robot", folder / "robot.toml") or {}
        for clock, late_s in late.items():
            found = answer.get(f"{clock}_time_offset")
            if found and found.get("sigma_s"):
                held = abs(found["time_offset_s"] + late_s) < 3 * found["sigma_s"]  # which has a floor, by the steps of a stream
                self.count(f"info: clock of the {clock} within three sigmas", [held], 0.9973, 1)

    def late_gyro(self, folder: Path, seed: int) -> None:
        """Of pods, whose turns nothing else on board shows: calibrated by motion capture, and driven anew."""
        rng = np.random.default_rng(seed)
        robot = Robot(rng, "pods", True, 1.0, True, ticks=(360, 1000, 4096))
        late_s = float(rng.choice([-1, 1]) * rng.uniform(0.03, 0.1))
        for name in "ab":
            Recording(folder / "runs" / name, robot, Drive(robot, rng, 30, rng.uniform(0.3, 0.5)), rng, WAYS["motion capture"], late_s)
        (folder / "robot.toml").write_text(robot.file(self.sigma_stated))
        recording = Recording(folder / "c", robot, Drive(robot, rng, 30, 0.4), rng, gyro_late_s=late_s)
        if (self.answer("calibrate", folder / "runs", "--robot", folder / "robot.toml", "-o", folder / "calibrated.toml")
                and self.answer("odometry", folder / "c", "--robot", folder / "calibrated.toml", "-o", folder / "c.csv")):
            self.add("odometry, gyro's clock calibrated: last pose", recording.nees(table(folder / "c.csv")[-1]))

    def straight(self, folder: Path, seed: int) -> None:
        """What `info` warns of, of a robot that drives straight on and back, and has no fault; it warns beyond three sigmas."""
        rng, kind = np.random.default_rng(seed), ("differential", "car", "tricycle")[seed % 3]
        robot = Robot(rng, kind, True, 1.0)
        Recording(folder / "a", robot, Drive(robot, rng, 30, 0.4, straight=True), rng)
        (folder / "robot.toml").write_text(robot.file(self.sigma_stated))
        if found := self.answer("info", folder / "a", "--robot", folder / "robot.toml"):
            warned = [problem["message"] for problem in found["problems"] if problem["severity"] != "note"]
            for message in warned:
                print(f"info, straight drive {seed}, {kind}: {message}")
            self.count("info: straight drives without a warning", [not warned], 0.9973, 1)

    def slip(self, folder: Path, seed: int) -> None:
        """A drive without slip, and one in which a wheel that pushes spins for 0.8 s."""
        rng, (kind, gyro) = np.random.default_rng(seed), SLIPPING[seed % len(SLIPPING)]
        robot = Robot(rng, kind, gyro)
        robot.speed_m_s = max(0.4, robot.speed_m_s)
        drive = Drive(robot, rng, 30)
        name = rng.choice(list(drive.travels))
        travelled = np.convolve(np.abs(drive.travels[name]), np.ones(800), "valid")
        start_s = float(rng.choice(np.flatnonzero(travelled > 0.7 * travelled.max()))) * STEP_S
        Recording(folder / "clean", robot, Drive(robot, rng, 60), rng)
        recording = Recording(folder / "a", robot, drive, rng, slip=(name, start_s, start_s + 0.8, rng.uniform(0.4, 1)))
        (folder / "robot.toml").write_text(robot.file(self.sigma_stated))
        file = ("--robot", folder / "robot.toml")
        if clean := self.answer("slip", folder / "clean", *file):
            judged, alarms = clean["intervals"]["judged"], clean["intervals"]["alarms"]
            self.count("slip: intervals without slip that are flagged", [i < alarms for i in range(judged)], 0, 0.01)
        if (self.answer("slip", folder / "a", *file, "-o", folder / "slip.csv", "--corrected", folder / "b.csv")
                and self.answer("odometry", folder / "a", *file, "-o", folder / "a.csv")):
            slips = [row for row in table(folder / "slip.csv") if float(row["start_s"]) < start_s + 0.8 and float(row["end_s"]) > start_s]
            longest = max(slips, key=lambda row: abs(float(row["excess_m"])), default={"wheel": "none"})
            self.count("slip: found", [bool(slips)], 0.99, 1)
            if longest["wheel"] not in ("none", "ambiguous"):
                self.count("slip: a wheel that is named is the right one", [longest["wheel"] == name], 0.9, 1)  # it is named from a confidence of 0.9 on
            if longest["wheel"] == name:
                self.add("slip: its distance", (((float(longest["excess_m"]) - recording.excess_m) / float(longest["excess_sigma_m"])) ** 2, 1))
            plain, corrected = table(folder / "a.csv")[-1], table(folder / "b.csv")[-1]
            nees = recording.nees(corrected)
            if longest["wheel"] == "ambiguous":  # its covariance spans all wheels that it may have been, and is wide (docs/results/slip.md)
                self.count("slip, corrected, ambiguous: last pose within 95 %", [nees[0] < CHI_SQUARE_3_95], 0.95, 1)
            else:
                self.add("slip, corrected, wheel named: last pose", nees)
            off_m = [math.hypot(*recording.error(row)[0][:2]) for row in (corrected, plain)]
            self.count("slip, corrected: nearer to the truth", [off_m[0] < off_m[1]], 0.5, 1)

    def failures(self) -> list[str]:
        failed = super().failures()
        for check, held in self.counts.items():
            (low, high), total = self.expected[check], len(held)
            least, most = binomial_quantile(total, low, TAIL), binomial_quantile(total, high, 1 - TAIL)
            text = f"{check}: {sum(held)} of {total}, expected {least} to {most}"
            print(text)
            if not least <= sum(held) <= most:
                failed.append(text)
        return failed


def binomial_quantile(total: int, share: float, probability: float) -> int:
    """The least count that no more is with at least this probability."""
    if share in (0, 1):
        return round(share) * total
    below = 0.0
    for count in range(total):
        ways = math.lgamma(total + 1) - math.lgamma(count + 1) - math.lgamma(total - count + 1)
        below += math.exp(ways + count * math.log(share) + (total - count) * math.log1p(-share))
        if below >= probability:
            return count
    return total


def main() -> int:
    parser = argparse.ArgumentParser(description="Compares errors with the covariances that are stated of them.")
    parser.add_argument("program")
    parser.add_argument("--noise-stated", type=float, default=1.0, help="share of the noise that robot files claim")
    parser.add_argument("--draws", type=int, default=12, help="of each kind of robot; calibrations, clocks and slips are twice as many, straight drives four times")
    options = parser.parse_args()
    checks = OdometryChecks(options.program, options.noise_stated)
    draws = {checks.odometry: 9, checks.calibration: 2, checks.clocks: 2, checks.slip: 2, checks.straight: 4, checks.late_gyro: 2, checks.steering: 2}
    return judged(checks, {step: range(1000 * i, 1000 * i + share * options.draws) for i, (step, share) in enumerate(draws.items())})


if __name__ == "__main__":
    sys.exit(main())
