#!/usr/bin/env python3
"""End errors of held-out runs, every session in turn being the one that is learned from.

usage: tools/pods_results.py PROGRAM REAL   (REAL: the folder that tools/real_recordings.py wrote)

A robot is calibrated on one session alone; the runs of all others are integrated with the result from the reference's
first pose on. The error is the distance of the last odometry pose from the last reference pose, in percent of the
path that the reference saw. Robots with a gyro here have one that was computed from the reference's heading: their
figures measure translation only.
"""
import json
import math
import subprocess
import sys
from pathlib import Path
from statistics import median

# Robot, and what is held out where it has several sessions; a single session is split run by run.
ROBOTS = {
    "optiodom_omni3_pods": "wheels 0 and 1, yaw from the reference: translation only",
    "optiodom_omni3_gyro": "all three wheels, yaw from the reference: translation only",
    "optiodom_omni3": "all three wheels, yaw from them",
    "optiodom_omni4_pods": "wheels 0 and 1, yaw from the reference: translation only",
    "optiodom_omni4_gyro": "all four wheels, yaw from the reference: translation only",
    "optiodom_omni4": "all four wheels, yaw from them",
}


def sessions_of(folder):
    sessions = sorted(path.parent for path in folder.glob("*/*/run-01"))
    if len(sessions) > 1:
        return {session.name: [session] for session in sessions}
    runs = sorted(sessions[0].iterdir())
    return {"odd runs": runs[0::2], "even runs": runs[1::2]}


def calibrate(program, folder, training, hold_out):
    command = [program, "calibrate", *map(str, training), "--hold-out", *map(str, hold_out), "--robot",
               str(folder / "robot.toml"), "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def percent_of_path(error):
    return 100.0 * math.hypot(error["end_x_m"], error["end_y_m"]) / error["path_m"]


def report(program, folder):
    sessions = sessions_of(folder)
    before, after = [], []
    for name, training in sessions.items():
        others = [path for other, paths in sessions.items() if other != name for path in paths]
        result = calibrate(program, folder, training, others)
        runs = [run for run in result["runs"] if run["hold_out"] and "after" in run and run["after"]]
        ends = sorted(percent_of_path(run["after"]) for run in runs)
        before += [percent_of_path(run["before"]) for run in runs]
        after += ends
        nees = median(run["nees"] for run in runs if run["nees"])
        print(f"  learned from {name:<14} {len(ends):3} runs held out: end error / path median {median(ends):.2f} %, "
              f"mean {sum(ends) / len(ends):.2f} %, 95th percentile {ends[int(0.95 * (len(ends) - 1))]:.2f} %, "
              f"worst run {ends[-1]:.2f} %; NEES {nees:.1f}")
        for warning in result["warnings"]:
            if "converge" in warning:
                print(f"      warning: {warning}")
        groups = {}
        for run in runs:
            groups.setdefault(run["session"], []).append(percent_of_path(run["after"]))
        print("      " + ", ".join(f"{session}: median {median(ends):.2f} worst {max(ends):.2f}" for session, ends in groups.items()))
    print(f"  all: median {median(after):.2f} %, worst {max(after):.2f} %; nominal robot: median {median(before):.2f} %")


def main():
    program, real = sys.argv[1], Path(sys.argv[2])
    for name, what in ROBOTS.items():
        print(f"{name}: {what}")
        report(program, real / name)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
