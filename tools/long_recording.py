#!/usr/bin/env python3
"""Writes a long recording of a two-wheeled robot, to measure what a row costs in time and memory.

    tools/long_recording.py OUT [--hours 8] [--rate 500]

OUT becomes a recording (wheels.csv and gyro.csv at the rate, reference.csv at 10 Hz) with its robot.toml. The
robot drives the same lap of a minute again and again: five seconds at rest, then straight on, left and right.
Only its gyro and its reference are noisy.
"""

import argparse
import math
import pathlib
import random

LAP_S = 60
REST_S = 5
TRACK_M = 0.30
DIAMETER_M = 0.1
TICKS_PER_REVOLUTION = 4096
GYRO_DENSITY = 0.0003  # rad/s/√Hz
REFERENCE_EVERY_S = 0.1
REFERENCE_SIGMA_M = 0.005
REFERENCE_SIGMA_RAD = 0.002
NOISE_VALUES = 99991  # prime: never in step with the laps

ROBOT = f"""\
name = "long"

[[wheel]]
name = "left"
y_m = {TRACK_M / 2}
diameter_m = {DIAMETER_M}
ticks_per_revolution = {TICKS_PER_REVOLUTION}
tick_bits = 16

[[wheel]]
name = "right"
y_m = {-TRACK_M / 2}
diameter_m = {DIAMETER_M}
ticks_per_revolution = {TICKS_PER_REVOLUTION}
tick_bits = 16

[gyro]
noise_rad_s_sqrt_hz = {GYRO_DENSITY}
bias_walk_rad_s_sqrt_s = 1e-5

[noise]
wheel_per_sqrt_m = 0.001
lateral_per_sqrt_m = 0.0005
"""


def velocity(time_s):
    """Forwards [m/s] and yaw rate [rad/s] at a time of the lap."""
    if time_s < REST_S:
        return 0.0, 0.0
    phase = 2 * math.pi * (time_s - REST_S) / (LAP_S - REST_S)
    return 0.3 * (1 - math.cos(phase)), 0.4 * math.sin(3 * phase) + 0.05 * math.sin(phase) ** 2


class Lap:
    """What one lap adds up to after each of its rows: both wheels' travel, yaw rate and pose."""

    def __init__(self, rate_hz):
        self.rows = LAP_S * rate_hz
        self.left, self.right, self.rate, self.pose = [0.0], [0.0], [0.0], [(0.0, 0.0, 0.0)]
        for row in range(self.rows):
            forward, yaw_rate = velocity((row + 0.5) / rate_hz)
            travel, turn = forward / rate_hz, yaw_rate / rate_hz
            x, y, heading = self.pose[-1]
            middle = heading + turn / 2
            self.pose.append((x + travel * math.cos(middle), y + travel * math.sin(middle), heading + turn))
            self.left.append(self.left[-1] + travel - turn * TRACK_M / 2)
            self.right.append(self.right[-1] + travel + turn * TRACK_M / 2)
            self.rate.append(yaw_rate)


def write_wheels(path, lap, laps, rate_hz):
    per_m = TICKS_PER_REVOLUTION / (math.pi * DIAMETER_M)
    with open(path, "w") as file:
        file.write("time_s,left_ticks,right_ticks\n")
        for number in range(laps):
            left, right, start = number * lap.left[-1], number * lap.right[-1], number * LAP_S
            file.writelines(
                "%.3f,%d,%d\n" % (start + row / rate_hz, int((left + lap.left[row]) * per_m) & 0xFFFF,
                                  int((right + lap.right[row]) * per_m) & 0xFFFF)
                for row in range(lap.rows))


def write_gyro(path, lap, laps, rate_hz, generator):
    sigma = GYRO_DENSITY * math.sqrt(rate_hz)
    noise = [generator.gauss(0.0, sigma) for _ in range(NOISE_VALUES)]
    with open(path, "w") as file:
        file.write("time_s,yaw_rate_rad_s\n")
        for number in range(laps):
            start, first = number * LAP_S, number * lap.rows
            file.writelines(
                "%.3f,%.6f\n" % (start + row / rate_hz, lap.rate[row] + noise[(first + row) % NOISE_VALUES])
                for row in range(lap.rows))


def write_reference(path, lap, laps, rate_hz, generator):
    x, y, heading = 0.0, 0.0, 0.0
    every = max(1, round(REFERENCE_EVERY_S * rate_hz))
    with open(path, "w") as file:
        file.write("time_s,x_m,y_m,heading_rad\n")
        for number in range(laps):
            cos, sin = math.cos(heading), math.sin(heading)
            for row in range(0, lap.rows, every):
                dx, dy, turn = lap.pose[row]
                file.write("%.3f,%.6f,%.6f,%.6f\n" %
                           (number * LAP_S + row / rate_hz,
                            x + cos * dx - sin * dy + generator.gauss(0.0, REFERENCE_SIGMA_M),
                            y + sin * dx + cos * dy + generator.gauss(0.0, REFERENCE_SIGMA_M),
                            heading + turn + generator.gauss(0.0, REFERENCE_SIGMA_RAD)))
            dx, dy, turn = lap.pose[-1]
            x, y, heading = x + cos * dx - sin * dy, y + sin * dx + cos * dy, heading + turn


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--rate", type=int, default=500, help="rows per second")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    lap, laps, generator = Lap(options.rate), max(1, round(options.hours * 3600 / LAP_S)), random.Random(1)
    (options.out / "robot.toml").write_text(ROBOT)
    write_wheels(options.out / "wheels.csv", lap, laps, options.rate)
    write_gyro(options.out / "gyro.csv", lap, laps, options.rate, generator)
    write_reference(options.out / "reference.csv", lap, laps, options.rate, generator)


if __name__ == "__main__":
    main()
