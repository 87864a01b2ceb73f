#!/usr/bin/env python3
"""What the landmark sensors of real robots err by, from their sightings alone, and what knowing it is worth.

usage: tools/sensor_from_sightings.py [PROGRAM [DATA [OUT]]]

Of each robot of MRCLAM 6 and of lost_in_the_woods: calibrates the sensor and all noises from its sightings
(--landmarks --free sensor --learn-noise), without a reference, and prints what was found; then path and map error
[m, rms, SE(2)-aligned] and NEES of the smoother with the robot file as it was and as it is now, and the online
errors of three filters with the latter. Then the same learned from the first half of each log, without its reference
and with it (--with-reference), and the second half smoothed with both. docs/results/landmark-sensor.md.
"""
import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FOUND = ["range_offset", "depth_share", "bearing_offset", "x", "y", "time_offset"]
FILTERS = ["ekf", "fastslam2", "smoother"]


def stamp(line):
    """The first number of a row of data; nothing of another line."""
    try:
        return float(line.replace(",", " ").split()[0])
    except (IndexError, ValueError):
        return None


def halved(folder, timed, halves):
    """The log in `folder` as two: rows of the files named in `timed` before and after its middle, all others in both."""
    files = {file.name: file.read_text().splitlines(keepends=True) for file in folder.iterdir() if file.is_file()}
    stamps = [time for name in timed for time in map(stamp, files[name]) if time is not None]
    middle = (min(stamps) + max(stamps)) / 2
    for half, belongs in zip(halves, (lambda time: time < middle, lambda time: time >= middle)):
        half.mkdir(parents=True, exist_ok=True)
        for name, lines in files.items():
            kept = [line for line in lines if name not in timed or stamp(line) is None or belongs(stamp(line))]
            (half / name).write_text("".join(kept))


def main():
    given = sys.argv[1:] + ["build/trundle", "../shared/data", "out/sensor"][len(sys.argv) - 1:]
    trundle, data, out = (Path(path).absolute() for path in given)
    subprocess.run([sys.executable, HERE / "slam_recordings.py", data, out], check=True)

    def run(*arguments):
        done = subprocess.run([trundle, *map(str, arguments), "--json"], check=True, capture_output=True, text=True)
        return json.loads(done.stdout)

    def errors(path, reference, landmarks):
        evaluation = run("evaluate", path, reference, "--align", "se2")
        map_m = subprocess.run([sys.executable, HERE / "map_error.py", path.parent / "landmarks.csv", landmarks, "--align"],
                               check=True, capture_output=True, text=True).stdout
        nees = evaluation.get("nees") or {}
        return evaluation["position_m"]["rms"], nees.get("mean", float("nan")), float(map_m)

    def row(name, recording, robot, reference, landmarks):
        calibrated = out / f"{name}.toml"
        found = run("calibrate", *recording, "--robot", robot, "--landmarks", "--free", "sensor", "--learn-noise", "-o",
                    calibrated)
        print(f"\n## {name}")
        for parameter in found["parameters"]:
            if parameter["name"].removeprefix("sensor.") in FOUND:
                print(f"{parameter['name']:24s} {parameter['value']:9.4f} ± {parameter['sigma_within']:.4f} {parameter['unit']}")
        for note in found["notes"]:
            if "smoother's residuals" in note:
                print(note.split(",")[0])
        for what, file in (("before", robot), ("after", calibrated)):
            result = out / "result"
            run("slam", *recording, "--robot", file, "--filter", "ekf", "--smooth", "-o", result)
            path_m, nees, map_m = errors(result / "trajectory.csv", reference, landmarks)
            print(f"smoothed, {what:6s} path {path_m:.3f}  NEES {nees:.2f}  map {map_m:.3f}")
            online = []
            for method in FILTERS:
                run("slam", *recording, "--robot", file, "--filter", method, "-o", result)
                online.append(f"{method} {errors(result / 'trajectory.csv', reference, landmarks)[0]:.3f}")
            print(f"online,   {what:6s} " + "  ".join(online), flush=True)

    def halves_row(name, folder, timed, robot, landmarks, options=()):
        first, second = halves = [out / "halves" / name / part for part in ("first", "second")]
        halved(folder, timed, halves)
        print(f"\n## {name}, learned from the first half")
        for what, with_reference in (("sightings", []), ("with reference", ["--with-reference"])):
            calibrated = out / f"{name}-{what.replace(' ', '-')}.toml"
            found = run("calibrate", first, *options, "--robot", robot, "--landmarks", "--free", "sensor", "--learn-noise",
                        *with_reference, "-o", calibrated)
            for parameter in found["parameters"]:
                if parameter["name"] in ("sensor.range_scale", "velocity.forward_scale"):
                    print(f"{what:14s} {parameter['name']:24s} {parameter['value']:.4f} ± {parameter['sigma_within']:.4f}")
            result = out / "result"
            run("slam", second, *options, "--robot", calibrated, "--filter", "ekf", "--smooth", "-o", result)
            recorded = out / "mrclam" / f"Robot{options[1]}" if options else second
            path_m, nees, map_m = errors(result / "trajectory.csv", recorded, landmarks)
            print(f"{what:14s} second half: path {path_m:.3f}  NEES {nees:.2f}  map {map_m:.3f}", flush=True)

    for number in range(1, 6):
        halves_row(f"mrclam-{number}", data / "mrclam" / "MRCLAM_Dataset6",
                   [f"Robot{n}_{kind}.dat" for n in range(1, 6) for kind in ("Odometry", "Measurement", "Groundtruth")],
                   out / "mrclam" / "robot.toml", out / "mrclam" / "landmarks.csv", ["--robot-number", number])
    halves_row("lost_in_the_woods", out / "lost_in_the_woods", ["velocity.csv", "sightings.csv", "reference.csv"],
               out / "lost_in_the_woods" / "robot.toml", out / "lost_in_the_woods" / "landmarks.csv")

    for number in range(1, 6):
        folder = out / "mrclam"
        row(f"mrclam-{number}", [data / "mrclam" / "MRCLAM_Dataset6", "--robot-number", number], folder / "robot.toml",
            folder / f"Robot{number}", folder / "landmarks.csv")
    woods = out / "lost_in_the_woods"
    row("lost_in_the_woods", [woods], woods / "robot.toml", woods, woods / "landmarks.csv")


if __name__ == "__main__":
    main()
