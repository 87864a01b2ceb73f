#!/usr/bin/env python3
"""What real recordings say of `scrub`: a table in Markdown.

usage: tools/scrub_results.py PROGRAM DATA OUT [PAGE.md]

Lays recording folders over DATA (tools/*_recordings.py), calibrates every robot without and with `--free scrub` on its
training runs and compares the position error of runs held out. Robots of two fixed wheels are given skid wheels. The
table is printed, and written between the marks in PAGE.md, with the date and this command.
"""
import datetime
import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def lay_out(data, out, *kinds):
    """OUT/<kind> by tools/<kind>_recordings.py."""
    for kind in kinds:
        subprocess.run([sys.executable, HERE / f"{kind}_recordings.py", data, out / kind], check=True, stdout=subprocess.DEVNULL)


def runs_below(folder):
    """The folders of recordings, in order."""
    return sorted({path.parent for name in ("recording.toml", "wheels.csv") for path in folder.rglob(name)})


def skidding(robot):
    """The same robot with wheels that may scrub."""
    text = robot.read_text()
    target = robot.with_name("skidding.toml")
    fixed = 'kind = "fixed"\n'
    target.write_text(text.replace(fixed, 'kind = "skid"\n') if fixed in text
                      else text.replace("[[wheel]]\n", '[[wheel]]\nkind = "skid"\n'))
    return target


def jobs(out):
    """What to call it, its robot, the runs to learn from and those to judge by."""
    base = out / "warthog"
    for surface in ("asphalt", "gravel", "ice"):
        runs = runs_below(base / surface / "train"), runs_below(base / surface / "test")
        yield (f"warthog_drive/{surface}", base / "robot.toml", *runs)
        yield (f"warthog_drive/{surface}, without gyro", base / "wheels_only.toml", *runs)
    base = out / "real/ese650_skidsteer"
    yield "ese650_skidsteer", base / "robot.toml", runs_below(base), []
    base = out / "real/optiodom_diff"
    for kind in ("square", "circular"):
        runs = runs_below(base / kind)
        yield f"optiodom_diff/{kind}", skidding(base / "robot.toml"), runs[::2], runs[1::2]
    base = out / "slip/kobuki_slip"
    yield "kobuki_slip/nonfaulty", skidding(base / "robot.toml"), [base / "nonfaulty_1", base / "nonfaulty_2"], []


def calibrated(program, robot, runs, held_out, out, *options):
    """calibration.json; nothing where the runs do not determine anything."""
    command = [program, "calibrate", *runs, "--robot", robot, "-o", out / "calibrated.toml", "--quiet", *options]
    if held_out:
        command += ["--hold-out", *held_out]
    if subprocess.run(list(map(str, command)), capture_output=True).returncode != 0:
        return None
    return json.loads((out / "calibration.json").read_text())


def held_out_error(document):
    errors = (document.get("errors") or {}).get("hold_out") or {}
    return (errors.get("after") or {}).get("position_rms_m")


def number(value):
    return "–" if value is None else f"{value:.4f}"


def row(program, out, parameter, digits, name, robot, runs, held_out):
    plain = calibrated(program, robot, runs, held_out, out)
    free = calibrated(program, robot, runs, held_out, out, "--free", parameter)
    if not plain or not free:
        return f"| {name} | {len(runs)} | no answer | no | – | – |"
    found = next((p for p in free["parameters"] if p["name"] == parameter), None)
    if not found or not found["observable"]:
        return f"| {name} | {len(runs)} | not observable | no | {number(held_out_error(plain))} | – |"
    shown = f"{found['value']:.{digits}f} ± {found['sigma_within']:.{digits}f}"
    offer = next((o for o in plain.get("offers", []) if o["name"] == parameter), None)
    offered = f"yes: +{offer['log_likelihood_gain']:.1f}" if offer else "no"
    return f"| {name} | {len(runs)} | {shown} | {offered} | {number(held_out_error(plain))} | {number(held_out_error(free))} |"


def tell(parameter, jobs, digits=3):
    """The table of one parameter, by the script that was called: PROGRAM DATA OUT [PAGE.md]."""
    program, out = sys.argv[1], Path(sys.argv[3])
    lines = [f"| recordings | runs learned from | {parameter} | offered: gain | held out, without [m] | with [m] |",
             "|---|---|---|---|---|---|"]
    lines += [row(program, out, parameter, digits, *job) for job in jobs]
    table = (f"Made on {datetime.date.today()} by `tools/{Path(sys.argv[0]).name}`; position errors are rms, start-aligned.\n\n"
             + "\n".join(lines))
    print(table)
    if len(sys.argv) == 5:
        page = Path(sys.argv[4])
        begin, end = f"<!-- {parameter}: begin -->", f"<!-- {parameter}: end -->"
        head, rest = page.read_text().split(begin)
        page.write_text(f"{head}{begin}\n{table}\n{end}{rest.split(end)[1]}")


def main():
    data, out = Path(sys.argv[2]), Path(sys.argv[3])
    lay_out(data, out, "real", "warthog", "slip")
    tell("scrub", jobs(out))


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    main()
