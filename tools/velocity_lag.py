#!/usr/bin/env python3
"""Whether robots follow what they are told with a lag, by their motion capture alone and by nothing of the program.

usage: /usr/bin/python3 tools/velocity_lag.py [DATA]

For each robot of MRCLAM 6: the slope of the turn that motion capture saw over the turn that was commanded, in intervals of
0.25 to 20 s, with travel and time as further regressors; once with the clocks apart by what fits best, once with a first-order
lag besides. Without the lag the slope grows with the interval; with it it does not.
"""
import sys
from pathlib import Path

import numpy as np

STEP_S = 0.02
LONGEST_GAP_S = 0.1
INTERVALS_S = (0.25, 1.0, 2.0, 8.0, 20.0)
DELAYS_S = np.arange(-0.1, 0.5, STEP_S)
LAGS_S = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)


def load(folder, number):
    told = np.loadtxt(folder / f"Robot{number}_Odometry.dat")
    seen = np.loadtxt(folder / f"Robot{number}_Groundtruth.dat")
    time_s = np.arange(max(told[0, 0], seen[0, 0]) + 1.0, min(told[-1, 0], seen[-1, 0]) - 1.0, STEP_S)
    row = np.searchsorted(told[:, 0], time_s, side="right") - 1
    after = np.searchsorted(seen[:, 0], time_s)
    is_seen = seen[after, 0] - seen[after - 1, 0] < LONGEST_GAP_S
    return told[row, 1], told[row, 2], np.interp(time_s, seen[:, 0], np.unwrap(seen[:, 3])), is_seen


def followed(told, lag_s):
    if lag_s == 0.0:
        return told
    share, motion, now = 1.0 - np.exp(-STEP_S / lag_s), np.empty_like(told), told[0]
    for i, command in enumerate(told):
        now += share * (command - now)
        motion[i] = now
    return motion


def slope(forward, yaw, heading, is_seen, interval_s, delay_s, lag_s):
    """And the root mean square of what is left [rad]."""
    steps, late = round(interval_s / STEP_S), round(delay_s / STEP_S)
    way, turn = (np.roll(np.cumsum(followed(told, lag_s)) * STEP_S, late) for told in (forward, yaw))
    unseen = np.concatenate([[0], np.cumsum(~is_seen)])
    start = np.arange(max(late, 0) + 1, len(yaw) - steps - 30, max(steps // 4, 1))
    start = start[unseen[start + steps + 1] == unseen[start]]
    design = np.c_[turn[start + steps] - turn[start], way[start + steps] - way[start], np.full(len(start), interval_s)]
    seen = heading[start + steps] - heading[start]
    near = np.abs(seen - design[:, 0]) < 1.0  # where motion capture took something else for the robot it jumps
    found = np.linalg.lstsq(design[near], seen[near], rcond=None)[0]
    return found[0], np.sqrt(np.mean((seen[near] - design[near] @ found) ** 2))


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data") / "mrclam" / "MRCLAM_Dataset6"
    print("| robot | lag | clocks apart | left over 0.25 s | " + " | ".join(f"{s:g} s" for s in INTERVALS_S) + " |\n" + "|---" * (4 + len(INTERVALS_S)) + "|")
    for number in range(1, 6):
        robot = load(folder, number)
        for lags in ((0.0,), LAGS_S):
            left, delay, lag = min((slope(*robot, INTERVALS_S[0], delay, lag)[1], delay, lag) for lag in lags for delay in DELAYS_S)
            slopes = " | ".join(f"{slope(*robot, interval, delay, lag)[0]:.3f}" for interval in INTERVALS_S)
            print(f"| {number} | {lag:g} s | {delay:.2f} s | {left:.4f} rad | {slopes} |", flush=True)


if __name__ == "__main__":
    main()
