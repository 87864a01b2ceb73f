#!/usr/bin/env python3
"""What the landmark sensors of real robots err by, from their sightings alone, and what knowing it is worth.

usage: tools/sensor_from_sightings.py [PROGRAM [DATA [OUT]]]

Of each robot of MRCLAM 6 and of lost_in_the_woods: calibrates the sensor and all noises from its sightings
(--landmarks --free sensor --learn-noise), without a reference, and prints what was found; then path and map error
[m, rms, SE(2)-aligned] and NEES of the smoother with the robot file as it was and as it is now, and the online
errors of three filters with the latter. docs/results/landmark-sensor.md.
"""
import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FOUND = ["range_offset", "depth_share", "bearing_offset", "x", "y", "time_offset"]
FILTERS = ["ekf", "fastslam2", "smoother"]


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

    for number in range(1, 6):
        folder = out / "mrclam"
        row(f"mrclam-{number}", [data / "mrclam" / "MRCLAM_Dataset6", "--robot-number", number], folder / "robot.toml",
            folder / f"Robot{number}", folder / "landmarks.csv")
    woods = out / "lost_in_the_woods"
    row("lost_in_the_woods", [woods], woods / "robot.toml", woods, woods / "landmarks.csv")


if __name__ == "__main__":
    main()
