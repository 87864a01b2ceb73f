#!/usr/bin/env python3
"""Odometry of a skid-steer robot on asphalt, gravel and ice against lidar, over windows of 2 s.

usage: tools/warthog_results.py PROGRAM WARTHOG   (WARTHOG: the folder that tools/warthog_recordings.py wrote)

Everything is learned on the training half of a surface and judged on the other half. 'plain': the wheels with the
owners' dimensions. 'effective track': the wheels, diameters and track fitted. 'ours': the gyro fused in, effective
track, noise learned from the training windows. A gyro whose sign `info` finds wrong is turned around first.
"""
import json
import math
import subprocess
import sys
from pathlib import Path
from statistics import median

SURFACES = ("asphalt", "gravel", "ice")
ELLIPSE_95 = 5.991465


def run(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def gyro_is_upside_down(program, surface, robot):
    """Whether most windows that can tell say so."""
    document = json.loads(run(program, "info", surface, "--robot", robot, "--json"))
    warned = sum(any(p["kind"] == "gyro sign" for p in r["problems"]) for r in document["recordings"])
    return warned, len(document["recordings"])


def calibrated(program, surface, robot, output):
    run(program, "calibrate", surface / "train", "--robot", robot, "--learn-noise", "-o", output)
    return output


def rows_of(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")][1:]
    return [[float(cell) for cell in line.split(",")] for line in lines]


def misses(program, surface, robot, scratch):
    """Per window: error of position [m] and heading [rad] at the last lidar pose, its covariance."""
    found = []
    for window in sorted((surface / "test").iterdir()):
        run(program, "odometry", window, "--robot", robot, "-o", scratch, "--quiet")
        truth = rows_of(window / "reference.csv")[-1]
        at = min(rows_of(scratch), key=lambda row: abs(row[0] - truth[0]))
        found.append((at[1] - truth[1], at[2] - truth[2], math.remainder(at[3] - truth[3], 2 * math.pi), at[4], at[5], at[7]))
    return found


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def inside(ex, ey, xx, xy, yy):
    return (yy * ex * ex - 2 * xy * ex * ey + xx * ey * ey) / (xx * yy - xy * xy) <= ELLIPSE_95


def largest_semi_axis(xx, xy, yy):
    return math.sqrt(ELLIPSE_95 * (0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)))


def report(program, warthog, surface):
    folder = warthog / surface
    wheels, robot = warthog / "wheels_only.toml", warthog / "robot.toml"
    warned, windows = gyro_is_upside_down(program, folder, robot)
    print(f"{surface}: gyro sign found wrong in {warned} of {windows} windows by info")
    if warned > 0.1 * windows:
        turned = warthog / "turned.toml"
        turned.write_text(robot.read_text().replace("[gyro]\n", "[gyro]\nscale = -1.0\n"))
        robot = turned
    robots = {
        "plain": wheels,
        "effective track": calibrated(program, folder, wheels, warthog / f"{surface}_wheels.toml"),
        "ours": calibrated(program, folder, robot, warthog / f"{surface}_ours.toml"),
    }
    plain = None
    for name, file in robots.items():
        found = misses(program, folder, file, warthog / "scratch.csv")
        distance = [math.hypot(m[0], m[1]) for m in found]
        heading = [math.degrees(m[2]) for m in found]
        plain = plain or (rms(heading), median(map(abs, heading)))
        print(f"  {name:<16} displacement rms {rms(distance):.3f} m, median {median(distance):.3f} m; heading rms "
              f"{rms(heading):6.2f}° ({plain[0] / rms(heading):.1f}x), median {median(map(abs, heading)):6.2f}° "
              f"({plain[1] / median(map(abs, heading)):.1f}x)")
        if name == "ours":
            share = sum(inside(m[0], m[1], *m[3:]) for m in found) / len(found)
            axes = [largest_semi_axis(*m[3:]) for m in found]
            print(f"    95 % ellipse holds {100 * share:.1f} % of {len(found)} windows; median semi-axis {median(axes):.2f} m, "
                  f"{median(axes) / rms(distance):.2f} of the rms error")


def main():
    program, warthog = sys.argv[1], Path(sys.argv[2])
    for surface in SURFACES:
        report(program, warthog, surface)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
