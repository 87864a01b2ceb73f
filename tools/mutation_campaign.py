#!/usr/bin/env python3
"""Runs commands on damaged files and generated recordings, and watches what the program makes of them.

    tools/mutation_campaign.py PROGRAM NUMBER [--seed SEED] [--jobs JOBS] [--keep FOLDER]

Of four cases two take the bundled sample (data/demo, shortened), one a log (generated_log.py), and damage one of the
files or the command line at random; the fourth is of a random robot and its recordings (generated_recording.py), a third
of them damaged too. Each runs one command. It fails on an exit code other than 0, 2, 3 and 4, on an error that is not one line, on a time-out, on
control characters or "nan" on the terminal, on "nan" and "inf" in a file of results, and on temporary files that are
left. The same seed gives the same cases. Cases that fail are kept in --keep (out/campaign), with their command line.
"""
import argparse
import functools
import json
import math
import multiprocessing
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections import Counter

import generated_log
import generated_recording

ROOT = pathlib.Path(__file__).resolve().parent.parent
TIMEOUT_S = 60
ROWS = 150  # of each CSV file: a case takes tens of milliseconds

TOKENS = [b"", b"0", b"-1", b"1e999", b"-1e999", b"nan", b"inf", b"1e300", b"-1e300", b"1e-300", b"1e9", b"1e12", b"65536",
          b"4294967296", b"9223372036854775807", b"18446744073709551616", b"0x10", b"1,2", b"\"", b"''", b"#", b"[", b"[[",
          b"{", b"}", b"\n", b"\r\n", b"\t", b"\0", b"\x1b[31m", b"\xff\xfe", b"\xc3\xa9", b"=", b",", b";", b".", b"null",
          b"true", b"[]", b"{}", b"a" * 300]

COMMANDS = [
    "info run --robot robot.toml --json",
    "info run",
    "odometry run --robot robot.toml -o out/t.csv",
    "odometry run --robot robot.toml -o out/t.tum --start 1,2,3",
    "slip run --robot robot.toml -o out/slip.csv --corrected out/c.csv",
    "slip run --robot robot.toml -o out/slip.csv --method published",
    "slam run --robot robot.toml -o out/slam --particles 5",
    "slam run --robot robot.toml -o out/slam --filter ekf",
    "slam run --robot robot.toml -o out/slam --filter ekf --resume state",
    "localize run --robot robot.toml --map map.csv -o out/t.csv --start 0,0,0",
    "evaluate run/reference.csv truth.csv --align se2",
    "calibrate run other --robot robot.toml -o out/calibrated.toml --quiet",
    "umbmark sheet.csv --robot sheet_robot.toml -o out/calibrated.toml",
    "simulate scenario.toml -o out/simulated",
    "report results -o out/report.html",
    "live --robot robot.toml --json",
    "live --robot robot.toml --checkpoint out/state",
]
LOGS = ["drive.bag", "bz2.bag", "drive.mcap", "drive.db3", "drive.wpilog", "drive.bin", "drive.ulg"]
ON_LOGS = [
    "info {}",
    "info {} --json",
    "info {} --recording map.toml --robot two_wheels.toml --json",
    "init {} -o out/draft",
    "init {} --urdf robot.urdf -o out/draft --json",
    "init {} --controller controller.yaml -o out/draft",
    "odometry {} --recording map.toml --robot two_wheels.toml -o out/t.csv",
    "calibrate {} --recording map.toml --robot two_wheels.toml -o out/calibrated.toml --json",
    "run {} --recording map.toml --robot two_wheels.toml -o out/all",
]
ON_GENERATED = [
    "info run --robot robot.toml",
    "info other --robot robot.toml --json",
    "odometry run --robot robot.toml -o out/t.csv",
    "slip run --robot robot.toml -o out/slip.csv --corrected out/c.csv",
    "slip run --robot robot.toml -o out/slip.csv --method published",
    "slam run --robot robot.toml -o out/slam --particles 5",
    "slam run --robot robot.toml -o out/slam --filter ekf --smooth",
    "slam run --robot robot.toml -o out/slam --filter ekf --unknown-ids",
    "localize run --robot robot.toml --map map.csv -o out/t.csv",
    "localize run --robot robot.toml --map map.csv -o out/t.csv --start 0,0,0 --filter particles",
    "evaluate run truth.csv --align se2 --json",
    "calibrate run other --robot robot.toml -o out/calibrated.toml",
    "calibrate run --robot robot.toml -o out/calibrated.toml --landmarks",
    "umbmark run other --robot robot.toml --side-m 1 -o out/calibrated.toml",
    "live --robot robot.toml --json",
    "run run --robot robot.toml -o out/all --particles 5",
]


def shortened(path, rows=ROWS):
    lines = path.read_bytes().splitlines(keepends=True)
    return b"".join(lines[:rows])


def run(program, line, folder, stdin=None):
    return subprocess.run([program, *line], cwd=folder, stdin=stdin or subprocess.DEVNULL, capture_output=True,
                          timeout=TIMEOUT_S)


def must_run(program, line, folder):
    done = run(program, line.split(), folder)
    if done.returncode != 0:
        sys.exit(f"{line}: {done.stderr.decode()}")


def live_lines(recording):
    lines = []
    for name, key in (("wheels.csv", "wheels"), ("gyro.csv", "gyro")):
        head, *rows = [r.split(",") for r in (recording / name).read_text().splitlines()]
        for row in rows:
            values = [float(cell) for cell in row]
            reading = dict(zip(head[1:], values[1:])) if key == "wheels" else values[1]
            lines.append((values[0], json.dumps({"time_s": values[0], key: reading})))
    return "".join(line + "\n" for _, line in sorted(lines, key=lambda line: line[0]))


def make_sample(program, folder):
    """The inputs of all commands, small."""
    demo = ROOT / "data/demo"
    for name, source in (("run", demo / "slip"), ("other", demo / "session_01/square_cw_01")):
        (folder / name).mkdir(parents=True)
        for file in source.glob("*.csv"):
            if not file.name.startswith("truth"):
                (folder / name / file.name).write_bytes(shortened(file))
    (folder / "robot.toml").write_bytes((demo / "robot.toml").read_bytes())
    (folder / "map.csv").write_bytes((demo / "slip/landmarks.csv").read_bytes())
    (folder / "truth.csv").write_bytes(shortened(demo / "slip/reference.csv", 40))
    (folder / "sheet.csv").write_bytes((ROOT / "data/umbmark/sheet.csv").read_bytes())
    (folder / "sheet_robot.toml").write_bytes((ROOT / "data/umbmark/robot.toml").read_bytes())
    scenario = (demo / "slip.toml").read_text().replace("length_m = 20", "length_m = 2").replace("start_s = ", "start_s = 0.")
    (folder / "scenario.toml").write_text(scenario)
    (folder / "run/recording.toml").write_text(
        'session = "s"\n[wheels]\nfile = "wheels.csv"\ncolumns.time_s = "time_s"\ncolumns.left_ticks = 2\n'
        'columns.right_ticks = { column = "right_ticks", sign = 1 }\n[reference]\nposition_sigma_m = 0.001\n')
    (folder / "readings.jsonl").write_text(live_lines(folder / "run"))
    must_run(program, "run run --robot robot.toml -o results --quiet", folder)
    must_run(program, "slam run --robot robot.toml -o unused --filter ekf --checkpoint state", folder)
    shutil.rmtree(folder / "unused")
    (folder / "results/report.html").unlink()


def make_logs(program, folder):
    """For each format a folder with its log, the log's map, and what is known of the robot."""
    whole = folder / "whole"
    whole.mkdir(parents=True)
    generated_log.write(whole)
    for log in LOGS:
        (folder / log).mkdir()
        for name in (log, "two_wheels.toml", "robot.urdf", "controller.yaml"):
            (folder / log / name).hardlink_to(whole / name)
        must_run(program, f"init {log} -o draft --quiet", folder / log)
        (folder / log / "map.toml").write_text((folder / log / "draft/recording.toml").read_text().replace("../", ""))
        shutil.rmtree(folder / log / "draft")
        must_run(program, f"odometry {log} --recording map.toml --robot two_wheels.toml -o t.csv --quiet", folder / log)
        (folder / log / "t.csv").unlink()


def other_number(number, rng):
    try:
        return b"%.12g" % (float(number) * rng.choice((-1, 0, 0.5, 2, 10, 1e3, 1e-3, 1e6, 1e-9)) + rng.choice((0, 0, 1, -1)))
    except ValueError:
        return b"0"


def with_other_bytes(content, at, rng):
    """A binary number in place of what stands at a place, of which any may be out of range."""
    form, value = rng.choice((
        *(("<d", value) for value in (math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-300, 0.0, 1e12)),
        *(("<f", value) for value in (math.nan, math.inf, 3e38, 0.0)),
        *(("<Q", value) for value in (0, 1, 2**31, 2**32, 2**63, 2**64 - 1)),
        *(("<I", value) for value in (0, 1, 2**16, 2**31, 2**32 - 1)), *(("<H", value) for value in (0, 2**15, 2**16 - 1))))
    number = struct.pack(form, value)
    return content[:at] + number + content[at + len(number):]


def mutated(content, rng):
    binary = b"\0" in content
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        at = rng.randrange(len(content) + 1)
        end = min(len(content), at + rng.choice((1, 1, 2, 5, 20, 200)))
        kind = rng.choice((0, 1, 1, 1, 1, 2, 3, 4, 5, 6, 7))
        if binary and kind == 1:
            content = with_other_bytes(content, at, rng)
            continue
        numbers = list(re.finditer(rb"-?\d[\d.e+-]*", content)) if kind in (0, 1) else []
        lines = content.splitlines(keepends=True) if kind in (2, 3) else []
        if numbers:  # another number, or what is none
            number = rng.choice(numbers)
            token = rng.choice(TOKENS) if kind == 0 else other_number(number.group(), rng)
            content = content[:number.start()] + token + content[number.end():]
        elif lines:  # a line twice, elsewhere, or not at all
            line = lines.pop(rng.randrange(len(lines)))
            for _ in range(rng.choice((0, 1, 2))):
                lines.insert(rng.randrange(len(lines) + 1), line)
            content = b"".join(lines)
        elif kind == 4:
            content = content[:at] + rng.choice(TOKENS) + content[at:]
        elif kind == 5:
            content = content[:at] + content[end:]
        elif kind == 6:
            content = content[:at] + bytes(rng.randrange(256) for _ in range(end - at)) + content[end:]
        else:
            content = content[:at] if rng.random() < 0.5 else content[:end] + content[at:]
    return content


def mutated_line(line, rng):
    line = list(line)
    at = rng.randrange(len(line))
    kind = rng.randrange(4)
    token = rng.choice(TOKENS).replace(b"\0", b"")
    if kind == 0:
        del line[at]
    elif kind == 1:
        line[at] = token
    elif kind == 2:
        line.insert(at, rng.choice((line[at], token)))
    else:
        number = rng.choice([b"1", *TOKENS]).replace(b"\0", b"")
        option = rng.choice([b"--start", b"--seed", b"--particles", b"--probability", b"--side-m", b"--threads", b"--align",
                             b"--filter", b"--robot-number", b"--json", b"--spin-odds", b"--longest-step-s", b"--free",
                             b"--fix", b"--export", b"--checkpoint-every-s"])
        line += [option, number]
    return line


TEXT_COLUMNS = {"landmark", "wheel", "kind", "axis"}


def faults_of_csv(text):
    rows = [line.split(",") for line in text.splitlines() if line and not line.startswith("#")]
    for row in rows[1:]:
        for name, cell in zip(rows[0], row) if len(row) == len(rows[0]) else ():
            try:
                if name not in TEXT_COLUMNS and cell and not math.isfinite(float(cell)):
                    return f"{name} is {cell}"
            except ValueError:
                pass
    return None


NO_TOML_NUMBER = re.compile(r"""^[^#"'\n]*[=\[,] ?[+-]?(nan|inf)\b""", re.MULTILINE)


def faults_of_file(path):
    if ".tmp" in path.suffixes:
        return "a temporary file is left"
    text = path.read_text(errors="replace")
    if path.suffix == ".csv":
        return faults_of_csv(text)
    if path.suffix == ".tum" and re.search(r"\b(nan|inf)\b", text):
        return "not a finite number"
    if path.suffix == ".toml" and NO_TOML_NUMBER.search(text):
        return "not a finite number"
    if path.suffix == ".json":
        try:
            json.loads(text, parse_constant=lambda word: sys.exit(word))
        except (SystemExit, ValueError) as error:
            return f"no JSON: {error}"
    return None


CONTROLS = re.compile(rb"[\x00-\x09\x0b-\x1f\x7f]")
NO_NUMBER = re.compile("(± ?-?(nan|inf)\\b)|\\b(nan|inf) (m|mm|rad|deg|s|Hz|%|°)".encode())


def faults(done, folder, line):
    """What is wrong with a case, or nothing."""
    if done.returncode not in (0, 2, 3, 4):
        return f"exit code {done.returncode}: {done.stderr[-300:].decode(errors='replace')}"
    lines = done.stderr.splitlines()
    if done.returncode != 0 and not any(text.startswith(b"trundle: ") for text in lines):
        return "an exit code without an error"
    if done.returncode == 2 and len(lines) != 1:
        return "an error of several lines"
    if CONTROLS.search(done.stderr) or CONTROLS.search(done.stdout):
        return "control characters on the terminal"
    if done.returncode == 0 and NO_NUMBER.search(done.stdout):
        return "not a finite number on the terminal"
    asked_for_json = any(word == b"--json" and not before.startswith(b"-") for before, word in zip(line, line[1:]))
    if asked_for_json and done.returncode == 0 and b"--help" not in line:
        try:
            json.loads(done.stdout, parse_constant=lambda word: sys.exit(word))
        except (SystemExit, ValueError) as error:
            return f"stdout is no JSON: {error}"
    for path in sorted(folder.rglob("*")):
        fault = faults_of_file(path) if path.is_file() and ("out" in path.parts or ".tmp" in path.name) else None
        if fault:
            return f"{path.relative_to(folder)}: {fault}"
    return None


def damaged(sample, folder, commands, rng):
    """A command line on a copy of the sample, one of whose files or which itself is damaged, and the file."""
    shutil.copytree(sample, folder, copy_function=lambda a, b: pathlib.Path(b).hardlink_to(a))
    line = rng.choice(commands).encode().split()
    inputs = sorted(path for path in sample.rglob("*") if path.is_file())
    used = [path for path in inputs if any(word.decode() in (path.name, path.relative_to(sample).parts[0]) for word in line)
            or (line[0] == b"live" and path.name == "readings.jsonl")
            or (line[0] == b"simulate" and path.name == "robot.toml")]
    file = rng.choice(used).relative_to(sample)
    if rng.random() < 0.15:
        return mutated_line(line, rng), file
    (folder / file).unlink()  # a link to the sample's
    (folder / file).write_bytes(mutated((sample / file).read_bytes(), rng))
    return line, file


def generated(folder, rng):
    """A command line on a random robot and its recordings, and the file that is damaged besides."""
    folder.mkdir()
    generated_recording.write(folder, rng)
    line = rng.choice(ON_GENERATED).encode().split()
    wheels = folder / "run/wheels.csv"
    rows = [row.split(",") for row in wheels.read_text().splitlines()] if wheels.exists() else []
    names = [name.rpartition("_")[0] if not name.endswith("_rad_s") else name[:-6] for name in rows[0][1:]] if rows else []
    readings = [f'{{"time_s": {row[0]}, "wheels": {{{", ".join(f"{n!r}: {v}" for n, v in zip(names, row[1:]))}}}}}\n'
                for row in rows[1:]]
    (folder / "readings.jsonl").write_text("".join(readings).replace("'", '"'))
    if rng.random() < 2 / 3:
        return line, None
    path = rng.choice(sorted(path for path in folder.rglob("*") if path.is_file()))
    path.write_bytes(mutated(path.read_bytes(), rng))
    return line, path.relative_to(folder)


def prepared(scratch, folder, number, rng):
    """The folder of a case: its command line, and the file that is damaged."""
    if number % 4 == 3:
        return generated(folder, rng)
    if number % 4 == 1:
        log = rng.choice(LOGS)
        return damaged(scratch / "logs" / log, folder, [line.format(log) for line in ON_LOGS], rng)
    return damaged(scratch / "sample", folder, COMMANDS, rng)


def case(program, scratch, keep, seed, number):
    """Runs it: its exit code, and what is wrong with it."""
    rng = random.Random(seed * 1_000_003 + number)
    folder = scratch / f"case_{os.getpid()}"
    line, file = prepared(scratch, folder, number, rng)
    code = None
    try:
        readings = folder / "readings.jsonl"
        with open(readings if readings.exists() else os.devnull, "rb") as stdin:
            done = run(program, line, folder, stdin)
        code, fault = done.returncode, faults(done, folder, line)
    except subprocess.TimeoutExpired:
        fault = "does not end"
    if fault:
        kept = keep / f"{seed}_{number}"
        shutil.rmtree(kept, ignore_errors=True)
        shutil.copytree(folder, kept)
        text = b" ".join(line) + f"\n{file}: {fault}\n".encode()
        (kept / "COMMAND").write_bytes(text)
        fault = f"{kept}: {text.decode(errors='replace')!r}"
    shutil.rmtree(folder)
    return code, fault


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("number", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("out/campaign"))
    options = parser.parse_args()
    program = options.program.resolve()
    codes, failed = Counter(), 0
    with tempfile.TemporaryDirectory(dir="/dev/shm" if pathlib.Path("/dev/shm").is_dir() else None) as name:
        scratch = pathlib.Path(name)
        make_sample(program, scratch / "sample")
        make_logs(program, scratch / "logs")
        one = functools.partial(case, program, scratch, options.keep.resolve(), options.seed)
        with multiprocessing.Pool(options.jobs) as pool:
            for done, (code, fault) in enumerate(pool.imap_unordered(one, range(options.number), chunksize=20), 1):
                codes[code] += 1
                if fault:
                    failed += 1
                    print(fault, flush=True)
                if done % 1000 == 0:
                    print(f"{done} cases, {failed} failed", flush=True)
    print(f"{options.number} cases, {failed} failed; exit codes " +
          ", ".join(f"{code}: {count}" for code, count in sorted(codes.items(), key=str)))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
