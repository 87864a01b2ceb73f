#!/usr/bin/env python3
"""What the ready-made velocities of real robots err by, from sightings alone, and what knowing it is worth.

usage: tools/velocity_from_sightings.py [PROGRAM [DATA [OUT]]]

Of each robot of MRCLAM 6 and of lost_in_the_woods: calibrates velocity, landmark sensor and all noises from its
sightings (--landmarks --free sensor --learn-noise), without a reference, and prints what was found; then the error of the
odometry alone [m, rms], laid on the reference at its start and as well as can be, and of the smoother with its NEES, with the
robot file as it was and as it is now. docs/results/velocity.md is what it prints.
"""
import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
VELOCITY = ["forward_scale", "yaw_scale", "yaw_per_forward", "yaw_bias"]


def main():
    given = sys.argv[1:] + ["build/trundle", "../shared/data", "out/velocity"][len(sys.argv) - 1:]
    trundle, data, out = (Path(path).absolute() for path in given)
    subprocess.run([sys.executable, HERE / "slam_recordings.py", data, out], check=True)

    def run(*arguments):
        done = subprocess.run([trundle, *map(str, arguments), "--json"], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(map(str, arguments))}: {done.stderr}")
        return json.loads(done.stdout)

    def errors(path, reference, align):
        evaluation = run("evaluate", path, reference, "--align", align)
        return evaluation["position_m"]["rms"], (evaluation.get("nees") or {}).get("mean", float("nan"))

    def row(name, recording, robot, reference):
        calibrated = out / f"{name}.toml"
        found = run("calibrate", *recording, "--robot", robot, "--landmarks", "--free", "sensor", "--learn-noise", "-o", calibrated)
        print(f"\n### {name}\n\n| parameter | found |\n|---|---|")
        for parameter in found["parameters"]:
            if parameter["name"].removeprefix("velocity.") in VELOCITY:
                text = f"{parameter['value']:.4f} ± {parameter['sigma_within']:.4f} {parameter['unit']}"
                print(f"| `{parameter['name']}` | {text if parameter['observable'] else 'held: ' + text} |")
        for note in found["notes"]:
            if note.startswith("velocity.lag_s"):
                print(f"| `velocity.lag_s` | {note.split(' ', 1)[1].split(' s (')[0]} s |")
        print("\n| robot file | odometry, start-aligned | SE(2)-aligned | smoothed, SE(2)-aligned | its NEES |\n|---|---|---|---|---|")
        for what, file in (("as given", robot), ("calibrated", calibrated)):
            path = out / "odometry.csv"
            run("odometry", *recording, "--robot", file, "-o", path)
            at_start, laid = errors(path, reference, "start")[0], errors(path, reference, "se2")[0]
            result = out / "result"
            run("slam", *recording, "--robot", file, "--filter", "ekf", "--smooth", "-o", result)
            smoothed = errors(result / "trajectory.csv", reference, "se2")
            print(f"| {what} | {at_start:.3f} m | {laid:.3f} m | {smoothed[0]:.3f} m | {smoothed[1]:.1f} |", flush=True)

    for number in range(1, 6):
        folder = out / "mrclam"
        row(f"mrclam-{number}", [data / "mrclam" / "MRCLAM_Dataset6", "--robot-number", number], folder / "robot.toml",
            folder / f"Robot{number}")
    woods = out / "lost_in_the_woods"
    row("lost_in_the_woods", [woods], woods / "robot.toml", woods)


if __name__ == "__main__":
    main()
