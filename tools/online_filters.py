#!/usr/bin/env python3
"""How good the online estimate of each filter is on the real recordings: what the default of --filter was chosen by.

usage: tools/online_filters.py [PROGRAM [DATA [OUT [SEEDS]]]]

For MRCLAM 6 (with the sensor as in slam_recordings.py, and calibrated from its sightings as in sensor_from_sightings.py),
lost_in_the_woods and Victoria Park, with names and without: position error [m, rms; SE(2)-aligned but for the woods],
and of MRCLAM mean NEES; of `fastslam2` medians over the seeds, and in brackets the worst error.
docs/results/online-filters.md.
"""
import json
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FILTERS = ["smoother", "ekf", "fastslam2"]
WITHOUT_SEEDS = FILTERS[:2]


def main():
    given = sys.argv[1:] + ["build/trundle", "../shared/data", "out/online", "5"][len(sys.argv) - 1:]
    trundle, data, out = (Path(path).absolute() for path in given[:3])
    seeds = int(given[3])
    subprocess.run([sys.executable, HERE / "slam_recordings.py", data, out], check=True)

    def run(*arguments):
        done = subprocess.run([trundle, *map(str, arguments), "--json"], check=True, capture_output=True, text=True)
        return json.loads(done.stdout)

    def figures(method, seed, recording, robot, reference, align):
        result = out / "result"
        run("slam", *recording, "--robot", robot, "--filter", method, "--seed", seed, "-o", result)
        evaluation = run("evaluate", result / "trajectory.csv", reference, "--align", align)
        return evaluation["position_m"]["rms"], (evaluation.get("nees") or {}).get("mean", 0.0)

    def row(name, recording, *rest):
        cells = []
        for method in FILTERS:
            last = 1 if method in WITHOUT_SEEDS else seeds
            runs = [figures(method, seed, recording, *rest) for seed in range(1, last + 1)]
            rms, nees = (statistics.median(column) for column in zip(*runs))
            worst = f" ({max(r[0] for r in runs):.3f})" if last > 1 else ""
            cells.append(f"{rms:.3f}{worst}" + (f"; {nees:.0f}" if "MRCLAM" in name else ""))
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)

    print("| | " + " | ".join(f"`{method}`" for method in FILTERS) + " |\n" + "|---" * (len(FILTERS) + 1) + "|")
    woods = out / "lost_in_the_woods"
    with open(woods / "reference.csv") as file:
        _, x, y, heading = file.read().splitlines()[1].split(",")
    start = f"--start={x},{y},{float(heading) * 57.29577951308232:.12g}"
    folder = data / "mrclam" / "MRCLAM_Dataset6"
    for sensor in ("by hand", "calibrated"):
        for number in range(1, 6):
            recording = [folder, "--robot-number", number]
            robot = out / "mrclam" / "robot.toml"
            if sensor == "calibrated":
                calibrated = out / f"mrclam-{number}.toml"
                if not calibrated.exists():
                    run("calibrate", *recording, "--robot", robot, "--landmarks", "--free", "sensor", "--learn-noise", "-o",
                        calibrated)
                robot = calibrated
            for names, hidden in (("with names", []), ("without", ["--unknown-ids"])):
                row(f"MRCLAM 6, robot {number}, {sensor}, {names}", recording + hidden, robot,
                    out / "mrclam" / f"Robot{number}", "se2")
    for names, hidden in (("with names", []), ("without", ["--unknown-ids"])):
        row(f"lost in the woods, {names}", [woods, start] + hidden, woods / "robot.toml", woods, "none")
    park = out / "victoria_park"
    row("Victoria Park, without", [park], park / "robot.toml", park, "se2")


if __name__ == "__main__":
    main()
