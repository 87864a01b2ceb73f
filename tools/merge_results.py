#!/usr/bin/env python3
"""What merging the maps of robots that drove in one world gives: a table in Markdown.

usage: tools/merge_results.py [PROGRAM [DATA [OUT [PAGE.md]]]]

Each of the five robots of MRCLAM 6 makes its map alone (--smooth), its sensor calibrated from its own sightings; the five
maps, each in a frame of its own, are merged with names and without. Errors: of the merged map against the survey, SE(2)-aligned,
and of the frames, which the survey and each map tell too. The table is printed, and written between the marks in PAGE.md.
"""
import datetime
import json
import math
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from map_error import read  # noqa: E402
from together_results import alignment, rms  # noqa: E402

ROBOTS = range(1, 6)
BEGIN, END = "<!-- merge: begin -->", "<!-- merge: end -->"


def laid_on(survey, found):
    """(turn, shift) that lays a map on the survey, and what is left, rms."""
    names = sorted(found.keys() & survey.keys())
    points, truth = [found[n] for n in names], [survey[n] for n in names]
    turn, shift = alignment(points, truth)
    return turn, shift, rms(turn * p + shift - t for p, t in zip(points, truth))


def main():
    given = sys.argv[1:] + ["build/trundle", "../shared/data", "out/merge"][len(sys.argv) - 1:]
    trundle, data, out = (Path(path).absolute() for path in given[:3])
    subprocess.run([sys.executable, HERE / "slam_recordings.py", data, out], check=True)
    folder, survey = data / "mrclam" / "MRCLAM_Dataset6", read(out / "mrclam" / "landmarks.csv")

    def run(*arguments):
        """The document; or why there is no answer."""
        done = subprocess.run([trundle, *map(str, arguments), "--json"], capture_output=True, text=True)
        if done.returncode not in (0, 4):
            sys.exit(done.stderr)
        return json.loads(done.stdout) if done.returncode == 0 else done.stderr.strip().splitlines()[-1]

    maps = []
    for robot in ROBOTS:
        robot_file = out / f"mrclam-{robot}.toml"
        run("calibrate", folder, "--robot-number", robot, "--robot", out / "mrclam" / "robot.toml", "--landmarks", "--free",
            "sensor", "--learn-noise", "-o", robot_file)
        maps.append(out / f"alone-{robot}")
        run("slam", folder, "--robot-number", robot, "--robot", robot_file, "--smooth", "-o", maps[-1])
    laid = [laid_on(survey, read(one / "landmarks.csv")) for one in maps]

    def frame_error(frame, turn, shift):
        """Of a map's frame in the first one's, against what the survey says of both: metres, degrees."""
        first_turn, first_shift, _ = laid[0]
        place = (shift - first_shift) / first_turn
        heading = math.degrees(math.remainder(frame["heading_rad"], 2 * math.pi))
        off = math.remainder(heading - math.degrees(math.atan2((turn / first_turn).imag, (turn / first_turn).real)), 360)
        return abs(complex(frame["x_m"], frame["y_m"]) - place), off

    lines = ["| maps | landmarks merged | map, m rms | frames: m, degrees, longer than the first by | said |", "|---|---|---|---|---|"]
    for name, options in (("with names", []), ("names hidden", ["--unknown-ids"])):
        result = out / "merged"
        answer = run("merge", *maps, *options, "-o", result)
        if isinstance(answer, str):
            lines.append(f"| {name} | – | – | – | {answer} |")
            continue
        frames = "; ".join("{:.2f}, {:+.1f}, {:+.1f} ± {:.1f} %".format(
            *frame_error(frame, *one[:2]), 100 * frame["metre"]["share"], 100 * frame["metre"]["sigma"])
            for frame, one in zip(answer["frames"][1:], laid[1:]))
        _, _, left = laid_on(survey, {k.split("/")[-1]: v for k, v in read(result / "landmarks.csv").items()})
        cost = f"cost over degrees of freedom {answer['cost'] / answer['degrees_of_freedom']:.2f}"
        lines.append(f"| {name} | {answer['landmarks']} | {left:.3f} | {frames} | {cost} |")
    lines += ["", "Each map alone, m rms: " + ", ".join(f"{one[2]:.3f}" for one in laid) + "."]
    print("\n".join(lines))
    if len(given) > 3:
        page = Path(given[3])
        before, _, rest = page.read_text().partition(BEGIN)
        _, _, after = rest.partition(END)
        stamp = f"By `tools/merge_results.py build/trundle ../shared/data out`, {datetime.date.today()}."
        page.write_text(before + "\n".join([BEGIN, "", *lines, "", stamp, "", END]) + after)


if __name__ == "__main__":
    main()
