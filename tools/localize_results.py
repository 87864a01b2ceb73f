#!/usr/bin/env python3
"""Localization on the true map of real recordings, from nowhere: the figures of docs/results/localization.md.

usage: tools/localize_results.py PROGRAM DATA OUT   (OUT: what tools/slam_recordings.py wrote)

Poses are compared with the reference as they are, in the map's frame. Of each run: when the pose became known [s after
the reference begins], how much of the time from then on it was, the errors of what was claimed, how much of that was off
by more than a metre, and by more than a metre and three of its own sigmas, and in how many pieces the pose was known.
"""
import bisect
import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

FAR_M = 1.0
LARGEST_GAP_S = 0.5


def rows_of(path):
    with open(path, newline="") as file:
        table = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{key: float(cell) for key, cell in row.items() if cell and key != "landmark"} for row in table]


def localize(program, arguments, out):
    result = subprocess.run([program, "localize", *map(str, arguments), "--json", "-o", str(out)],
                            capture_output=True, text=True)
    if result.returncode == 4:
        return None
    result.check_returncode()
    return json.loads(result.stdout)


def errors_of(poses, reference):
    """Distance and turn [m, rad] between each pose and the reference, interpolated, and the distance's own sigma [m]."""
    stamps = [row["time_s"] for row in reference]
    errors = []
    for pose in poses:
        after = bisect.bisect_left(stamps, pose["time_s"])
        if not 0 < after < len(stamps) or stamps[after] - stamps[after - 1] > LARGEST_GAP_S:
            continue
        a, b = reference[after - 1], reference[after]
        u = (pose["time_s"] - a["time_s"]) / (b["time_s"] - a["time_s"])
        x = a["x_m"] + u * (b["x_m"] - a["x_m"])
        y = a["y_m"] + u * (b["y_m"] - a["y_m"])
        turn = math.remainder(b["heading_rad"] - a["heading_rad"], 2.0 * math.pi)
        heading = a["heading_rad"] + u * turn
        errors.append((math.hypot(pose["x_m"] - x, pose["y_m"] - y),
                       abs(math.remainder(pose["heading_rad"] - heading, 2.0 * math.pi)),
                       math.sqrt(pose["var_xx"] + pose["var_yy"])))
    return errors


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def line_of(document, poses, reference):
    errors = errors_of(poses, reference)
    distances = [distance for distance, _, _ in errors]
    known_s = sum(stretch["end_s"] - stretch["start_s"] for stretch in document["known"])
    start_s = document["known"][0]["start_s"]
    last_s = max(reference[-1]["time_s"], poses[-1]["time_s"])
    far = sum(distance > FAR_M for distance in distances) / len(distances)
    unsaid = sum(distance > max(FAR_M, 3.0 * sigma) for distance, _, sigma in errors) / len(errors)
    return (f"{start_s - reference[0]['time_s']:7.0f} s {100 * known_s / (last_s - start_s):6.1f} % "
            f"{rms(distances):7.3f} m {sorted(distances)[len(distances) // 2]:7.3f} m {max(distances):7.2f} m "
            f"{math.degrees(rms([turn for _, turn, _ in errors])):6.1f}° {100 * far:6.1f} % {100 * unsaid:6.1f} % {len(document['known']):4}")


def main(program, data, out):
    runs = [(f"mrclam 6, robot {robot}",
             [data / "mrclam/MRCLAM_Dataset6", "--robot-number", robot, "--robot", out / "mrclam/robot.toml",
              "--map", out / "mrclam/landmarks.csv"], out / f"mrclam/Robot{robot}/reference.csv")
            for robot in range(1, 6)]
    lost = out / "lost_in_the_woods"
    runs.append(("lost_in_the_woods", [lost, "--robot", lost / "robot.toml", "--map", lost / "landmarks.csv"],
                 lost / "reference.csv"))
    print(f"{'':48} {'known after':>9} {'known':>8} {'rms':>9} {'median':>9} {'largest':>9} {'heading':>7} {'> 1 m':>8} {'> 3 σ':>8} "
          f"{'pieces':>6}")
    with tempfile.TemporaryDirectory() as folder:
        trajectory = Path(folder) / "trajectory.csv"
        for name, arguments, reference in runs:
            for options in ([], ["--unknown-ids"]):
                for kind in ("particles", "ekf"):
                    document = localize(program, arguments + options + ["--filter", kind], trajectory)
                    label = f"{name}, {kind}, {'no names' if options else 'names'}"
                    line = line_of(document, rows_of(trajectory), rows_of(reference)) if document else "never known"
                    print(f"{label:48} {line}", flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
