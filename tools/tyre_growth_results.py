#!/usr/bin/env python3
"""What real recordings say of `tyre_growth`: a table in Markdown.

usage: tools/tyre_growth_results.py PROGRAM DATA OUT [PAGE.md]

Lays recording folders over DATA (tools/*_recordings.py), calibrates every robot on wheels that was recorded with a reference
without and with `--free tyre_growth` on its training runs, and compares the position error of runs held out. The table is
printed, and written between the marks in PAGE.md, with the date and this command.
"""
import sys
from pathlib import Path

from scrub_results import lay_out, runs_below, tell


def jobs(out):
    """What to call it, its robot, the runs to learn from and those to judge by."""
    for robot, kinds in (("optiodom_diff", ("square", "circular")), ("optiodom_omni3", ("square", "circular", "joystick")),
                         ("optiodom_omni4", ("circular",)), ("optiodom_tricyc", ("square", "circular"))):
        base = out / "real" / robot
        for kind in kinds:
            runs = runs_below(base / kind)
            yield f"{robot}/{kind}", base / "robot.toml", runs[::2], runs[1::2]
    base = out / "real/optiodom_omni3"
    others = runs_below(base / "square") + runs_below(base / "joystick")
    yield "optiodom_omni3/circular, judged by squares and joystick", base / "robot.toml", runs_below(base / "circular"), others
    base = out / "real/censi_calibration"
    yield "censi_calibration", base / "robot.toml", [base / f"lmov_{i}" for i in range(3)], []
    base = out / "warthog"
    for surface in ("asphalt", "gravel", "ice"):
        runs = runs_below(base / surface / "train"), runs_below(base / surface / "test")
        yield (f"warthog_drive/{surface}", base / "robot.toml", *runs)
    base = out / "slam/victoria_park_steered"
    yield "victoria_park", base / "robot.toml", [base / "whole"], []
    for learned, judged in (("first", "second"), ("second", "first")):
        yield f"victoria_park/{learned}", base / "robot.toml", [base / learned], [base / judged]


def main():
    data, out = Path(sys.argv[2]), Path(sys.argv[3])
    lay_out(data, out, "real", "warthog", "slam")
    tell("tyre_growth", jobs(out), digits=4)


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    main()
