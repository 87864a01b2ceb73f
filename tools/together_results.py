#!/usr/bin/env python3
"""What robots that drive in one world give together, against each alone.

usage: tools/together_results.py [PROGRAM [DATA [OUT]]] > docs/results/together.md

The five robots of MRCLAM 6, their landmark sensors calibrated from their own sightings (calibrate --landmarks --free
sensor --learn-noise): path, NEES and map of each alone (--smooth), of all together, of all together without
sightings of robots, and of all together when one robot's sightings of landmarks are removed. Errors are against the
motion capture, metres rms, SE(2)-aligned: alone each by itself; together also by the one alignment of the common map.
"""
import csv
import json
import math
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from map_error import read  # noqa: E402

ROBOTS = range(1, 6)
MARKER_SIGMAS = [0.0, 0.02, 0.04, 0.06, 0.08, 0.1]


def alignment(points, truth):
    """(turn, shift) of the plane as complex numbers, least squares."""
    middle, true_middle = sum(points) / len(points), sum(truth) / len(truth)
    turn = sum((p - middle).conjugate() * (t - true_middle) for p, t in zip(points, truth))
    turn /= abs(turn)
    return turn, true_middle - turn * middle


def rms(errors):
    squares = [abs(error) ** 2 for error in errors]
    return math.sqrt(sum(squares) / len(squares))


def scale_between(points, truth):
    """By what all distances of points are too long, least squares, and what is left then [m rms]."""
    turn, shift = alignment(points, truth)
    middle = sum(truth) / len(truth)
    placed, true = [turn * p + shift - middle for p in points], [t - middle for t in truth]
    scale = sum((p.conjugate() * t).real for p, t in zip(placed, true)) / sum(abs(p) ** 2 for p in placed)
    return 1 / scale - 1, rms(scale * p - t for p, t in zip(placed, true))


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def moved_trajectory(source, target, turn, shift):
    """The path in the frame of the reference: positions alone."""
    with open(target, "w") as file:
        file.write("time_s,x_m,y_m,heading_rad\n")
        angle = math.atan2(turn.imag, turn.real)
        for row in rows_of(source):
            p = turn * complex(float(row["x_m"]), float(row["y_m"])) + shift
            file.write(f"{row['time_s']},{p.real},{p.imag},{float(row['heading_rad']) + angle}\n")


def main():
    given = sys.argv[1:] + ["build/trundle", "../shared/data", "out/together"][len(sys.argv) - 1:]
    trundle, data, out = (Path(path).absolute() for path in given)
    subprocess.run([sys.executable, HERE / "slam_recordings.py", data, out], check=True)
    folder, truth = data / "mrclam" / "MRCLAM_Dataset6", read(out / "mrclam" / "landmarks.csv")

    def run(*arguments):
        done = subprocess.run([trundle, *map(str, arguments), "--json"], check=True, capture_output=True, text=True)
        return json.loads(done.stdout)

    def position(path, robot, align):
        evaluation = run("evaluate", path, out / "mrclam" / f"Robot{robot}", "--align", align)
        return evaluation["position_m"]["rms"], (evaluation.get("nees") or {}).get("mean", math.nan)

    def map_and_truth(path):
        found = read(path)
        names = sorted(found.keys() & truth.keys())
        return [found[n] for n in names], [truth[n] for n in names]

    def map_fit(path):
        points, true_points = map_and_truth(path)
        turn, shift = alignment(points, true_points)
        return rms(turn * p + shift - t for p, t in zip(points, true_points)), turn, shift

    robot_files = []
    for robot in ROBOTS:
        robot_files.append(out / f"mrclam-{robot}.toml")
        run("calibrate", folder, "--robot-number", robot, "--robot", out / "mrclam" / "robot.toml", "--landmarks", "--free",
            "sensor", "--learn-noise", "-o", robot_files[-1])

    def alone(robot):
        result = out / f"alone-{robot}"
        run("slam", folder, "--robot-number", robot, "--robot", robot_files[robot - 1], "--filter", "smoother", "--smooth",
            "-o", result)
        return *position(result / "trajectory.csv", robot, "se2"), map_fit(result / "landmarks.csv")[0]

    def without(kept, name):
        """The data set with those rows of each measurement file alone for which kept(robot, subject)."""
        copy = out / name
        copy.mkdir(parents=True, exist_ok=True)
        subject = {row.split()[1]: int(row.split()[0]) for row in (folder / "Barcodes.dat").read_text().splitlines()
                   if row.strip() and not row.startswith("#")}
        for file in folder.iterdir():
            number = re.match(r"Robot(\d)_Measurement", file.name)
            lines = file.read_text().splitlines()
            if number:
                lines = [line for line in lines if line.startswith("#") or not line.strip() or
                         kept(int(number[1]), subject.get(line.split()[1], 0))]
            (copy / file.name).write_text("\n".join(lines) + "\n")
        return copy

    def together(recording, name, sigma_m):
        result = out / name
        robots = [argument for file in robot_files for argument in ("--robot", file)]
        document = run("slam", recording, "--together", *robots, "--marker-sigma", sigma_m, "-o", result)
        error_m, turn, shift = map_fit(result / "landmarks.csv")
        rows = []
        for robot, said in zip(ROBOTS, document["robots"]):
            path = result / said["name"] / "trajectory.csv"
            moved_trajectory(path, out / "moved.csv", turn, shift)
            rows.append((*position(path, robot, "se2"), position(out / "moved.csv", robot, "none")[0], said))
        return error_m, rows, document

    each_alone = [alone(robot) for robot in ROBOTS]
    by_sigma = {sigma_m: together(folder, f"all-{sigma_m}", sigma_m) for sigma_m in MARKER_SIGMAS}

    def robot_nis(result):
        return sorted(row[3]["robot_nis"] for row in result[1])[len(result[1]) // 2]

    chosen_m = min(MARKER_SIGMAS, key=lambda sigma_m: abs(math.log(robot_nis(by_sigma[sigma_m]) / 1.386)))
    all_map, all_rows, document = by_sigma[chosen_m]
    apart_map, apart_rows, _ = together(without(lambda robot, subject: subject > 5, "no-robots"), "apart", chosen_m)
    print("""# Several robots, one map

What do robots that drive in one world give together, against each alone? Made by `tools/together_results.py` on the five robots
of UTIAS MRCLAM, data set 6; errors against the motion capture, metres rms. The landmark sensors are calibrated from each
robot's own sightings, as in [landmark-sensor.md](landmark-sensor.md); no reference is used. How to:
[together](../together.md); method: [theory](../theory/together.md).

## Each alone, and all together

Paths SE(2)-aligned each by itself, and (*in the map's frame*) by the one alignment of the common map with the surveyed
landmarks; NEES is 3 where a covariance is right.

| robot | alone: path | NEES | map | together: path | NEES | in the map's frame | without sightings of robots: path | NEES | in the map's frame |
|---|---|---|---|---|---|---|---|---|---|""")
    for robot, a, t, s in zip(ROBOTS, each_alone, all_rows, apart_rows):
        print(f"| {robot} | {a[0]:.3f} | {a[1]:.1f} | {a[2]:.3f} | {t[0]:.3f} | {t[1]:.1f} | {t[2]:.3f} "
              f"| {s[0]:.3f} | {s[1]:.1f} | {s[2]:.3f} |")
    smoother = document["smoother"]
    metres = ", ".join(f"{100 * row[3]['metre']['share']:+.2f} ± {100 * row[3]['metre']['sigma']:.2f} %" for row in all_rows)
    longer, left_m = scale_between(*map_and_truth(out / f"all-{chosen_m}" / "landmarks.csv"))
    print(f"""
The one map: **{all_map:.3f} m** with robots that see each other, **{apart_map:.3f} m** without. Together
{smoother['poses']} poses and {smoother['sightings']} sightings, of which {smoother['outliers']} are outliers; cost over
degrees of freedom {smoother['cost'] / smoother['degrees_of_freedom']:.2f}. Of robots there are
{sum(row[3]['robot_sightings'] for row in all_rows)} sightings, {sum(row[3]['robot_outliers'] for row in all_rows)} of them outliers.

## Whose metre is longer

What ranges of each are too long by, beside all ([theory](../theory/together.md), eq. 27a): {metres}. What all are too long by in common
nobody sees: all distances of the map are {100 * longer:.1f} % too long against the survey, and without that {left_m:.3f} m rms would be left.

## Where on its marker a robot is seen

`--marker-sigma` is what sightings of robots scatter by beside the sensor's noise. The one of these with which their median NIS,
of the middle robot, is nearest to 1.39 is used above and below: {chosen_m} m. No reference tells it.

| `--marker-sigma` | NIS of sightings of robots | map | path of each robot, in the map's frame |
|---|---|---|---|""")
    for sigma_m, result in by_sigma.items():
        paths = ", ".join(f"{row[2]:.3f}" for row in result[1])
        print(f"| {sigma_m} m | {robot_nis(result):.2f} | {result[0]:.3f} | {paths} |")
    print("""
## A robot that sees no landmark

One robot's sightings of landmarks are removed: the others, and what it sees of them, place it.

| robot without landmarks | its path, in the map's frame | its path, SE(2)-aligned | NEES | largest ± at its end | map |
|---|---|---|---|---|---|""")
    for robot in ROBOTS:
        blind = without(lambda who, subject: subject <= 5 or who != robot, f"blind-{robot}")
        map_m, rows, document = together(blind, f"result-blind-{robot}", chosen_m)
        last = rows_of(out / f"result-blind-{robot}" / rows[robot - 1][3]["name"] / "trajectory.csv")[-1]
        sigma = math.sqrt(max(float(last["var_xx"]), float(last["var_yy"])))
        aligned, nees, in_frame, _ = rows[robot - 1]
        print(f"| {robot} | {in_frame:.3f} | {aligned:.3f} | {nees:.1f} | {sigma:.3f} m | {map_m:.3f} |", flush=True)


if __name__ == "__main__":
    main()
