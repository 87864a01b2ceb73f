#!/usr/bin/env python3
"""What calibration makes of real robots with steered wheels: two tables in Markdown.

usage: tools/steered_results.py [PROGRAM [DATA [OUT [PAGE.md]]]]

optiodom_tricyc: calibrated on all squares and circles, on each session, and on circles alone; errors of the free runs,
aligned at the start. Victoria Park: a truck's speed and steering, calibrated from GPS positions on one half of the drive or
on all of it; errors of the odometry of each part, and of SLAM without names, SE(2)-aligned. The tables are printed, and written
between the marks in PAGE.md, with the date and this command.
"""
import datetime
import json
import math
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
BEGIN, END = "<!-- steered: begin -->", "<!-- steered: end -->"


class Program:
    def __init__(self, path):
        self.path = path

    def json(self, *arguments):
        done = subprocess.run([self.path, *map(str, arguments), "--json"], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr}")
        return json.loads(done.stdout)


def runs_below(folder):
    return sorted(path.parent for path in folder.rglob("recording.toml"))


def parameter(document, name):
    return next(one for one in document["parameters"] if one["name"] == name)


def with_sigma(one, digits=4):
    """Of an angle in degrees."""
    if not one["observable"]:
        return "as given"
    factor = math.degrees(1.0) if one["unit"] == "rad" else 1.0
    return f"{one['value'] * factor:.{digits}f} ± {one['sigma_total'] * factor:.{digits}f}"


def tricycle(program, out):
    base = out / "optiodom_tricyc"
    free = [base / f"free/{session}/run-01" for session in ("140120211508", "140120211525")]
    trainings = [("all squares and circles", runs_below(base / "square") + runs_below(base / "circular"))]
    trainings += [(f"{session.parent.name}/{session.name}", runs_below(session))
                  for kind in ("square", "circular") for session in sorted((base / kind).iterdir())]
    trainings += [("all circles", runs_below(base / "circular"))]
    yield "| calibrated on | runs | zero of the steering, degrees | wheelbase, m | " + " | ".join(
        f"{run.parent.name}: rms, worst point, m" for run in free) + " | said |"
    yield "|---" * (5 + len(free)) + "|"
    for name, training in trainings:
        document = program.json("calibrate", *training, "--robot", base / "robot.toml", "--hold-out", *free, "-o",
                                out / "calibrated.toml")
        held = [run for run in document["runs"] if run["hold_out"]]
        if name == trainings[0][0]:
            yield "| nothing | 0 | 0 | 0.15 | " + " | ".join(error_of(run["before"]) for run in held) + " | |"
        said = "; ".join(words.split(" from these runs")[0] for words in document["cannot_tell"])
        yield (f"| {name} | {len(training)} | {with_sigma(parameter(document, 'front.steering_zero'), 2)} | "
               f"{with_sigma(parameter(document, 'front.x'))} | " +
               " | ".join(error_of(run["after"]) for run in held) + f" | {said} |")


def error_of(errors):
    return f"{errors['position_rms_m']:.4f}, {errors['position_max_m']:.4f}"


def park(program, out):
    base, given = out / "slam/victoria_park_steered", out / "slam/victoria_park"
    parts = ("whole", "first", "second")

    def rms(folder, robot, part):
        program.json("odometry", folder, "--robot", robot, "-o", out / "odometry.csv")
        return program.json("evaluate", out / "odometry.csv", base / part, "--align", "se2")["position_m"]["rms"]

    def slam(folder, robot):
        program.json("slam", folder, "--robot", robot, "-o", out / "slam_result")
        return program.json("evaluate", out / "slam_result/trajectory.csv", base / "whole", "--align", "se2")["position_m"]["rms"]

    yield "| robot | odometry, m rms: " + " | ".join(parts) + " | SLAM, whole, m rms |"
    yield "|---" * (2 + len(parts)) + "|"
    robots = [("speed and turn of the middle of the axle, as it is usually computed", None), ("wheel and steering as given", base / "robot.toml")]
    for training in parts:
        calibrated = out / f"park_{training}.toml"
        document = program.json("calibrate", base / training, "--robot", base / "robot.toml", "--free", "front.steering_zero", "-o",
                                calibrated)
        zero = with_sigma(parameter(document, "front.steering_zero"), 2)
        robots.append((f"calibrated on {training}: zero {zero}°", calibrated))
    for name, robot in robots:
        if robot is None:
            cells = [f"{rms(given, given / 'robot.toml', 'whole'):.1f}", "–", "–"]
            found = slam(given, given / "robot.toml")
        else:
            cells = [f"{rms(base / part, robot, part):.1f}" for part in parts]
            found = slam(base / "whole", robot)
        yield f"| {name} | " + " | ".join(cells) + f" | {found:.2f} |"


def main():
    given = sys.argv[1:] + ["build/trundle", "../shared/data", "out/steered"][len(sys.argv) - 1:]
    program, data, out = Program(Path(given[0]).absolute()), Path(given[1]).absolute(), Path(given[2]).absolute()
    subprocess.run([sys.executable, HERE / "real_recordings.py", data, out], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([sys.executable, HERE / "slam_recordings.py", data, out / "slam"], check=True, stdout=subprocess.DEVNULL)
    lines = []
    for table in (tricycle(program, out), park(program, out)):
        for line in table:
            print(line, flush=True)
            lines.append(line)
        lines.append("")
        print()
    if len(given) > 3:
        page = Path(given[3])
        before, _, rest = page.read_text().partition(BEGIN)
        _, _, after = rest.partition(END)
        stamp = f"By `tools/steered_results.py build/trundle ../shared/data out`, {datetime.date.today()}."
        page.write_text(before + "\n".join([BEGIN, "", *lines, stamp, "", END]) + after)


if __name__ == "__main__":
    main()
