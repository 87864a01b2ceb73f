#!/usr/bin/env python3
"""Whether odometry's covariance holds on days that a robot was not calibrated on, by how many sessions it was.

usage: tools/held_out.py PROGRAM REAL   (REAL: the folder that tools/real_recordings.py wrote)

A robot is calibrated on some of its sessions; the runs of all others are integrated with the result. Judged is the pose at
the end of each, in the frame of its start: its normalised error squared (NEES: of three degrees of freedom 3 in the mean,
2.37 in the median), and heading's error in sigmas. The reference's own noise, by how much it jumps from row to row against
odometry, is part of the covariance; its start is the mean of what it says before the robot has moved by 2 cm.
"""
import csv
import itertools
import math
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from statistics import mean, median

import numpy as np

ROBOTS = ("optiodom_diff", "optiodom_omni3")
MOST_CHOICES = 12  # of sessions that are learned from, evenly from all there are
MOVED_M = 0.02
ENTRIES = ("xx", "xy", "xh", "yy", "yh", "hh")


def trundle(program, *arguments):
    subprocess.run([program, *map(str, arguments)], check=True, capture_output=True)


def odometry_of(program, run, robot, folder):
    """Rows of time, x, y, heading, and the covariance at the end."""
    trundle(program, "odometry", run, "--robot", robot, "-o", folder / "odometry.csv")
    with open(folder / "odometry.csv", newline="") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    xx, xy, xh, yy, yh, hh = (float(rows[-1]["var_" + entry]) for entry in ENTRIES)
    poses = np.array([[float(row[name]) for name in ("time_s", "x_m", "y_m", "heading_rad")] for row in rows])
    poses[:, 3] = np.unwrap(poses[:, 3])
    return poses, np.array([[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]])


def reference_of(run, offset_s):
    file = tomllib.loads((run / "recording.toml").read_text())["reference"]["file"]
    with open(file, newline="") as lines:
        rows = np.array([[float(cell) for cell in row[:4]] for row in csv.reader(lines)])
    rows[:, 0] += offset_s
    rows[:, 3] = np.unwrap(rows[:, 3])
    return rows


def composed(start, poses):
    c, s = math.cos(start[2]), math.sin(start[2])
    return np.column_stack([start[0] + c * poses[:, 0] - s * poses[:, 1], start[1] + s * poses[:, 0] + c * poses[:, 1],
                            start[2] + poses[:, 2]])


def end_error(odometry, covariance, reference):
    """Normalised error squared of the pose at the end, and the heading's error in sigmas."""
    common = (reference[:, 0] >= odometry[0, 0]) & (reference[:, 0] <= odometry[-1, 0])
    reference = reference[common]
    driven = np.column_stack([np.interp(reference[:, 0], odometry[:, 0], odometry[:, k]) for k in (1, 2, 3)])
    before = max(1, int(np.argmax(np.hypot(driven[:, 0], driven[:, 1]) > MOVED_M)))
    heading = np.mean(reference[:before, 3] - driven[:before, 2])
    turned = composed((0.0, 0.0, heading), driven)
    start = (*np.mean(reference[:before, 1:3] - turned[:before, :2], axis=0), heading)
    errors = composed(start, driven) - reference[:, 1:]
    c, s = math.cos(heading), math.sin(heading)
    errors[:, :2] = errors[:, :2] @ np.array([[c, -s], [s, c]])  # in the frame of the start
    noise = np.diag(np.var(np.diff(errors, axis=0), axis=0) / 2.0)
    x, y = driven[-1, :2]
    moved = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    total = covariance + noise + moved @ noise @ moved.T / before
    return errors[-1] @ np.linalg.solve(total, errors[-1]), errors[-1, 2] / math.sqrt(total[2, 2])


def chosen(sessions, number):
    choices = list(itertools.combinations(sessions, number))
    return [choices[i * len(choices) // min(len(choices), MOST_CHOICES)] for i in range(min(len(choices), MOST_CHOICES))]


def report(program, folder, scratch):
    sessions = sorted({path.parent for path in folder.glob("*/*/run-01")})
    for number in sorted({1, 2, 3, len(sessions) - 1}):
        errors = []
        for learned in chosen(sessions, number):
            robot = scratch / "robot.toml"
            trundle(program, "calibrate", *learned, "--robot", folder / "robot.toml", "-o", robot)
            offset_s = tomllib.loads(robot.read_text()).get("reference_sensor", {}).get("time_offset_s", 0.0)
            errors += [end_error(*odometry_of(program, run, robot, scratch), reference_of(run, offset_s))
                       for session in sessions if session not in learned for run in sorted(session.iterdir())]
        nees, headings = zip(*errors)
        print(f"  learned from {number} of {len(sessions)} sessions: {len(nees):3} runs held out, NEES at the end: mean {mean(nees):.2f}, "
              f"median {median(nees):.2f}; heading {math.sqrt(mean(z * z for z in headings)):.2f} σ rms", flush=True)


def main():
    program, real = sys.argv[1], Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as scratch:
        for name in ROBOTS:
            print(name)
            report(program, real / name, Path(scratch))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
