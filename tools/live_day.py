#!/usr/bin/env python3
"""A day of `trundle live`, compared with the same day offline.

    tools/live_day.py PROGRAM [--hours 24] [--rate-hz 100]

Simulates the counts and the gyro of data/demo's robot for so long, with rests, turns and counters that wrap, gives them
to `live` line by line, and compares each of its answers with the row of `trundle odometry` on the same readings, to the
last character. Prints the lines, those that differ, and the memory of `live` each hour. Ends with 1 where a line differs
or the memory grew by more than a megabyte after the first hour.
"""
import argparse
import math
import subprocess
import sys
import tempfile
from pathlib import Path

ROBOT = Path(__file__).resolve().parent.parent / "data/demo/robot.toml"
TURN_PER_TICK = math.pi * 0.1 / 4096 / 0.3  # of one wheel of that robot [rad]
STEPS = ((0, 0), (15, 15), (22, 8), (0, 0), (-9, 9), (30, 31), (14, 21), (-12, -12))  # ticks in 10 ms, left and right
NAMES = "time_s x_m y_m heading_rad var_xx var_xy var_xh var_yy var_yh var_hh".split()
FORM = "{" + ",".join(f'"{name}":%s' for name in NAMES) + ","


def readings(count, rate_hz):
    """Stamp, counts of 16 bits, and the rate of the gyro."""
    left = right = 0
    noise = 1
    for k in range(count):
        a, b = STEPS[k // 1000 % len(STEPS)]
        if k > 0:
            left, right = left + a, right + b
        noise = noise * 1103515245 + 12345 & 0x7FFFFFFF
        rate = (b - a) * TURN_PER_TICK * rate_hz + 0.01 + 0.004 * (noise / 0x7FFFFFFF - 0.5)
        yield f"{k / rate_hz:.2f}", left & 0xFFFF, right & 0xFFFF, f"{rate:.6f}"


def write_inputs(folder, count, rate_hz):
    (folder / "day").mkdir()
    with open(folder / "day/wheels.csv", "w") as wheels, open(folder / "day/gyro.csv", "w") as gyro, \
            open(folder / "day.jsonl", "w") as lines:
        wheels.write("time_s,left_ticks,right_ticks\n")
        gyro.write("time_s,yaw_rate_rad_s\n")
        for stamp, left, right, rate in readings(count, rate_hz):
            wheels.write(f"{stamp},{left},{right}\n")
            gyro.write(f"{stamp},{rate}\n")
            lines.write(f'{{"time_s":{stamp},"wheels":{{"left":{left},"right":{right}}},"gyro":{rate}}}\n')


def rows_of(path):
    with open(path) as file:
        for line in file:
            if line[0].isdigit() or line[0] == "-":
                yield tuple(line.rstrip("\n").split(","))


def memory_kb(process):
    for line in Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    return 0


def compare(program, folder, hour):
    """Answers, how many of them differ, and the memory of `live` after each hour [kB]."""
    answers = differing = 0
    memory = []
    with open(folder / "day.jsonl") as stdin:
        live = subprocess.Popen([program, "live", "--robot", ROBOT], stdin=stdin, stdout=subprocess.PIPE, text=True)
    for row in rows_of(folder / "trajectory.csv"):
        line = live.stdout.readline()
        answers += bool(line)
        differing += not line.startswith(FORM % row)
        if answers % hour == 0 and live.poll() is None:
            memory.append(memory_kb(live))
            print(f"{answers} lines, {differing} differ, {memory[-1]} kB", flush=True)
    rest = sum(1 for _ in live.stdout)
    if live.wait() != 0:
        sys.exit(f"live: exit code {live.returncode}")
    return answers + rest, differing + rest, memory


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--hours", type=float, default=24)
    parser.add_argument("--rate-hz", type=int, default=100)
    options = parser.parse_args()
    program = options.program.resolve()
    count = round(options.hours * 3600 * options.rate_hz)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_inputs(folder, count, options.rate_hz)
        subprocess.run([program, "odometry", "day", "--robot", ROBOT, "-o", "trajectory.csv", "--quiet"], cwd=folder,
                       check=True)
        answers, differing, memory = compare(program, folder, 3600 * options.rate_hz)
    grown = max(memory) - memory[0] if memory else 0
    print(f"{options.hours:g} h: {answers} of {count} lines answered, {differing} differ from offline, "
          f"{max(memory, default=0)} kB at most, {grown} kB more than after the first hour")
    return 0 if answers == count and differing == 0 and grown <= 1024 else 1


if __name__ == "__main__":
    sys.exit(main())
