#!/usr/bin/env python3
"""Kills commands at random moments and looks at what they leave.

usage: tools/kill_campaign.py PROGRAM [--kills N] [--seed S]

Each command writes, over and over and for two different recordings in turn, into one place, in which lies a file of
somebody else. It is killed (SIGKILL), or a random limit on the size of its files stops it (SIGXFSZ). Whatever the moment:
the place holds the files of the command before or those of the new one, to the last byte, and the foreign file; a
checkpoint of `live` can be gone on from. After a command that was left alone nothing temporary is left. Ends with 1
where that does not hold. `calibrate` and `localize` write two files into a folder of others: those that were killed
between the two renames are counted, and each of their files is whole.
"""
import argparse
import hashlib
import json
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

TWO_FILES = ("calibrate", "localize")
DEMO = Path(__file__).resolve().parent.parent / "data/demo"
OUTPUT = "place/results"


def commands(folder):
    """Of each command the lines that differ in their recording alone."""
    robot = ["--robot", "robot.toml"]
    runs = {name: [f"session_01/{run}" for run in two] for name, two in {
        "run": ("tour", "straight"), "slam": ("tour", "tour"), "calibrate": ("square_cw_01", "square_ccw_01"),
        "localize": ("tour", "tour")}.items()}
    return {
        "run": [["run", r, *robot, "--particles", "20", "-o", OUTPUT] for r in runs["run"]],
        "slam": [["slam", r, *robot, "--filter", f, "--particles", "20", "-o", OUTPUT]
                 for r, f in zip(runs["slam"], ("fastslam2", "ekf"))],
        "calibrate": [["calibrate", r, "session_01/straight", *robot, "-o", f"{OUTPUT}/calibrated.toml"]
                      for r in runs["calibrate"]],
        "localize": [["localize", r, *robot, "--map", "session_01/tour/landmarks.csv", "--start", start,
                      "--steps", f"{OUTPUT}/steps.csv", "-o", f"{OUTPUT}/trajectory.csv"]
                     for r, start in zip(runs["localize"], ("0,0,0", "0.1,0,0"))],
        "live": [["live", *robot, "--checkpoint", f"{OUTPUT}/state", "--checkpoint-every-s", "0.1"]] * 2,
    }


def write_live_input(recording, file):
    rows = (recording / "wheels.csv").read_text().splitlines()
    rows = [row.split(",") for row in rows if not row.startswith("#")]
    names = [name.removesuffix("_ticks") for name in rows[0][1:]]
    with open(file, "w") as out:
        for row in rows[1:]:
            line = {"time_s": float(row[0]), "wheels": {n: float(v) for n, v in zip(names, row[1:])}}
            out.write(json.dumps(line) + "\n")


def digests(place):
    """Of all that is visible there."""
    return {str(path.relative_to(place)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(place.rglob("*"))
            if path.is_file() and ".trundle-new" not in str(path.relative_to(place))}


def temporaries(place):
    return [str(path) for path in place.rglob("*.trundle-new")]


class Campaign:
    def __init__(self, program, folder, seed):
        self.program = str(Path(program).resolve())
        self.folder = folder
        self.random = random.Random(seed)
        self.tally = Counter()
        self.faults = []

    def start(self, line, limit=None):
        def limited():
            if limit is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        return subprocess.Popen([self.program, *line], cwd=self.folder, preexec_fn=limited,
                                stdin=open(self.folder / "live.jsonl"), stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE)

    def complete(self, line):
        """The files that it writes, and how long it takes."""
        begin = time.monotonic()
        process = self.start(line)
        error = process.communicate()[1].decode()
        if process.returncode != 0:
            sys.exit(f"{' '.join(line)}: exit code {process.returncode}: {error}")
        return digests(self.folder / "place"), time.monotonic() - begin

    def begin_anew(self):
        shutil.rmtree(self.folder / "place", ignore_errors=True)
        (self.folder / OUTPUT).mkdir(parents=True)
        (self.folder / OUTPUT / "notes.txt").write_text("of somebody else")

    def stop(self, line, duration, largest):
        """Where it ended by itself: its exit code. A quarter are stopped by the size of a file."""
        if self.random.random() < 0.25:
            process = self.start(line, limit=int(largest * self.random.random() ** 2))
            process.communicate()
            self.tally["SIGXFSZ"] += 1
            return process.returncode
        process = self.start(line)
        # Half of them where the results take their place.
        moment = self.random.random() if self.random.random() < 0.5 else self.random.gauss(0.95, 0.1)
        time.sleep(max(0.0, moment * duration))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        self.tally["SIGKILL" if process.returncode < 0 else "ended before"] += 1
        return process.returncode

    def judge(self, name, kill, now, old, new):
        """Its old files or its new ones: neither is half, nor are they mixed."""
        what = f"{name}, kill {kill}"
        if now == new:
            self.tally["new results"] += 1
        elif now == old:
            self.tally["old results"] += 1
        elif name in TWO_FILES and set(now) == set(new) and all(now[n] in (old[n], new[n]) for n in now):
            self.tally["between two renames"] += 1
        else:
            names = sorted(set(now) ^ set(new) | {n for n in set(now) & set(new) if now[n] != new[n]})
            self.faults.append(f"{what}: neither the old nor the new results: {', '.join(names[:6])}")

    def resume(self, line):
        """A checkpoint is complete at each moment."""
        if not (self.folder / OUTPUT / "state").exists():
            self.tally["no checkpoint yet"] += 1
            return
        process = self.start(["live", *line[1:3], "--resume", f"{OUTPUT}/state"])
        error = process.communicate()[1].decode()
        self.tally["resumed"] += 1
        if process.returncode != 0:
            self.faults.append(f"live --resume: exit code {process.returncode}: {error}")

    def command(self, name, lines, kills):
        self.begin_anew()
        whole = [self.complete(line) for line in lines]  # each over the other's
        whole[0] = self.complete(lines[0])
        old, largest = 0, max(p.stat().st_size for p in (self.folder / OUTPUT).rglob("*") if p.is_file())
        for kill in range(kills):
            new = 1 - old
            code = self.stop(lines[new], whole[new][1], largest)
            if code not in (0, 3, -signal.SIGKILL, -signal.SIGXFSZ):
                self.faults.append(f"{name}: exit code {code}")
            if name == "live":
                self.resume(lines[new])
                continue
            now = digests(self.folder / "place")
            self.judge(name, kill, now, whole[old][0], whole[new][0])
            if now == whole[new][0]:
                old = new
            if kill % 5 == 4 or now != whole[old][0]:
                self.complete(lines[old])
                self.tidy(name)
        self.complete(lines[old])
        self.tidy(name)

    def tidy(self, name):
        if left := temporaries(self.folder):
            self.faults.append(f"{name}: left after a command that was not killed: {', '.join(left[:6])}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(DEMO / "session_01", folder / "session_01")
        shutil.copy(DEMO / "robot.toml", folder)
        write_live_input(folder / "session_01/tour", folder / "live.jsonl")
        campaign = Campaign(options.program, folder, options.seed)
        all_commands = commands(folder)
        for command, lines in all_commands.items():
            campaign.command(command, lines, -(-options.kills // len(all_commands)))
    for fault in campaign.faults:
        print(fault)
    stopped = campaign.tally["SIGKILL"] + campaign.tally["SIGXFSZ"]
    print(f"{stopped} commands stopped ({', '.join(f'{k} {v}' for k, v in sorted(campaign.tally.items()))}); "
          f"{len(campaign.faults)} faults")
    return 1 if campaign.faults else 0


if __name__ == "__main__":
    sys.exit(main())
