#!/usr/bin/env python3
"""Lays recording folders over real recordings in which wheels slip, without rewriting them.

usage: tools/slip_recordings.py DATA OUT

OUT/kobuki_slip/{nonfaulty_1, nonfaulty_2, left_faulty, right_faulty}: the recording without slip is cut in two
halves, one to learn from and one to judge. The gyro's stamps are TIME_OFFSET_S late, by cross-correlation of the two
turns over 0.5 s; its driver has already taken the bias off.

OUT/kobuki_injected/<n> and OUT/omni3_injected/<run>: real logs without slip whose counts of one wheel at a time are
made to slip, truth_slip.csv says when. The three omni wheels of optiodom_omni3 have a gyro emulated from the
reference's smoothed heading (see real_recordings.py); OUT/omni3_clean are the same runs untouched.
"""
import csv
import math
import random
import sys
from pathlib import Path

from real_recordings import gyro_of, omni3_wheels

TIME_OFFSET_S = -0.06
HALF_S = 37.5  # of the recording without slip


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def kobuki_robot():
    text = 'name = "kobuki"\n\n'
    for name, y in (("left", 0.115), ("right", -0.115)):
        text += (f'[[wheel]]\nname = "{name}"\ny_m = {y}\ndiameter_m = 0.0704\nticks_per_revolution = 2578.33\n'
                 f'tick_bits = 16\n\n')
    return text + f'[gyro]\nnoise_rad_s_sqrt_hz = 0.0005\nbias_sigma_rad_s = 0.001\ntime_offset_s = {TIME_OFFSET_S}\n'


def kobuki_run(folder, start_s=None, end_s=None):
    cut = "".join(f"{key} = {value}\n" for key, value in (("start_s", start_s), ("end_s", end_s)) if value is not None)
    return (f'time_origin = "first"\n\n[wheels]\nfile = "{folder}/core.csv"\n{cut}'
            'columns.time_s = "stamp_ns"\ntime_unit = "ns"\n'
            'columns.left_ticks = "left_ticks"\ncolumns.right_ticks = "right_ticks"\n\n'
            f'[gyro]\nfile = "{folder}/imu.csv"\ntime_unit = "ns"\ncolumns.time_s = "stamp_ns"\n'
            'columns.yaw_rate_rad_s = "gz_rads"\n\n'
            f'[commands]\nfile = "{folder}/cmd.csv"\ntime_unit = "ns"\ncolumns.time_s = "bag_time_ns"\n'
            'columns.forward_m_s = "v"\ncolumns.yaw_rate_rad_s = "w"\n')


def kobuki_slip(data, out):
    source, target = (data / "kobuki_slip").resolve(), out / "kobuki_slip"
    write(target / "robot.toml", kobuki_robot())
    write(target / "nonfaulty_1/recording.toml", kobuki_run(source / "nonfaulty", end_s=HALF_S))
    write(target / "nonfaulty_2/recording.toml", kobuki_run(source / "nonfaulty", start_s=HALF_S))
    for name in ("left_faulty", "right_faulty"):
        write(target / name / "recording.toml", kobuki_run(source / name))


def unwrapped(counts, bits=16):
    """Counts since the first row."""
    total, result = 0, [0]
    for a, b in zip(counts, counts[1:]):
        total += (b - a + 2**(bits - 1)) % 2**bits - 2**(bits - 1)
        result.append(total)
    return result


def bursts_of(time, ticks, rng, count=3):
    """Bursts of single wheels where these turn: start, end, wheel, factor. None within a second of another."""
    rate = {w: max(abs(b - a) for a, b in zip(t, t[1:])) for w, t in ticks.items()}
    found = []
    for _ in range(10000):
        if len(found) == count:
            break
        wheel = rng.choice(sorted(ticks))
        start = rng.uniform(time[0] + 3.0, time[-1] - 2.0)
        end = start + rng.uniform(0.25, 1.0)
        factor = rng.uniform(1.3, 2.0) if rng.random() < 0.5 else rng.uniform(0.0, 0.7)
        rows = [i for i in range(1, len(time)) if start - 0.5 < time[i] <= end]
        turns = all(abs(ticks[wheel][i] - ticks[wheel][i - 1]) > 0.2 * rate[wheel] for i in rows)
        if turns and rows and all(end + 1.0 < s or e + 1.0 < start for s, e, _, _ in found):
            found.append((start, end, wheel, factor))
    return sorted(found)


def inject(time, ticks, bursts, metres_per_tick):
    """The counts with the bursts in them, and truth_slip.csv."""
    injected = {w: [float(t[0])] for w, t in ticks.items()}
    excess = [0.0] * len(bursts)
    for i in range(1, len(time)):
        for w, t in ticks.items():
            step = t[i] - t[i - 1]
            more = 0.0
            for k, (start, end, wheel, factor) in enumerate(bursts):
                if wheel == w and start < time[i] <= end:
                    more = (factor - 1.0) * step
                    excess[k] += more * metres_per_tick
            injected[w].append(injected[w][-1] + step + more)
    truth = "start_s,end_s,wheel,kind,excess_m,confidence\n" + "".join(
        f"{start:.6f},{end:.6f},{wheel},{'spin' if factor > 1 else 'skid'},{e:.6f},1\n"
        for (start, end, wheel, factor), e in zip(bursts, excess))
    return injected, truth


def wheels_csv(time, ticks):
    names = list(ticks)
    lines = ["time_s," + ",".join(f"{w}_ticks" for w in names)]
    lines += [f"{t!r}," + ",".join(str(round(ticks[w][i])) for w in names) for i, t in enumerate(time)]
    return "\n".join(lines) + "\n"


def kobuki_injected(data, out, count=20):
    source, target = data / "kobuki_slip/nonfaulty", out / "kobuki_injected"
    with open(source / "core.csv", newline="") as lines:
        core = list(csv.DictReader(lines))
    with open(source / "imu.csv", newline="") as lines:
        imu = list(csv.DictReader(lines))
    origin = int(core[0]["stamp_ns"])
    time = [(int(row["stamp_ns"]) - origin) / 1e9 for row in core]
    ticks = {w: unwrapped([int(row[f"{w}_ticks"]) for row in core]) for w in ("left", "right")}
    gyro = "time_s,yaw_rate_rad_s\n" + "".join(
        f"{(int(row['stamp_ns']) - origin) / 1e9!r},{row['gz_rads']}\n" for row in imu)
    first = next(i for i, t in enumerate(time) if t >= HALF_S)
    time, ticks = time[first:], {w: t[first:] for w, t in ticks.items()}
    write(target / "robot.toml", kobuki_robot().replace("tick_bits = 16", "tick_bits = 0"))
    for name, bursts in [("clean", [])] + [(f"{n:02d}", bursts_of(time, ticks, random.Random(n))) for n in range(count)]:
        injected, truth = inject(time, ticks, bursts, math.pi * 0.0704 / 2578.33)
        write(target / name / "wheels.csv", wheels_csv(time, injected))
        write(target / name / "gyro.csv", gyro)
        write(target / name / "truth_slip.csv", truth)


def omni3_injected(data, out):
    robot = 'name = "optiodom_omni3"\n\n' + omni3_wheels(3) + "[gyro]\nnoise_rad_s_sqrt_hz = 0.003\nbias_sigma_rad_s = 0.0\n"
    for kind in ("omni3_clean", "omni3_injected"):
        write(out / kind / "robot.toml", robot)
    for n, file in enumerate(sorted((data / "optiodom_omni3").glob("*/*/*_run-*.csv"))):
        with open(file, newline="") as lines:
            rows = [[float(cell) for cell in row] for row in csv.reader(lines)]
        time = [row[0] for row in rows]
        ticks = {f"w{i}": [0.0] for i in range(3)}
        for row in rows[1:]:
            for i in range(3):
                ticks[f"w{i}"].append(ticks[f"w{i}"][-1] + row[4 + i])
        reference = "time_s,x_m,y_m,heading_rad\n" + "".join(f"{r[0]!r},{r[1]!r},{r[2]!r},{r[3]!r}\n" for r in rows)
        run = f"{file.parts[-3]}/{file.parts[-2]}/{file.stem[-6:]}"
        for kind, bursts in (("omni3_clean", []), ("omni3_injected", bursts_of(time, ticks, random.Random(1000 + n)))):
            injected, truth = inject(time, ticks, bursts, math.pi * 0.102 / 12288)
            folder = out / kind / run
            write(folder / "wheels.csv", wheels_csv(time, injected))
            write(folder / "gyro.csv", gyro_of(file))
            write(folder / "reference.csv", reference)
            write(folder / "truth_slip.csv", truth)


def main():
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    for lay_out in (kobuki_slip, kobuki_injected, omni3_injected):
        lay_out(data, out)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
