#!/usr/bin/env python3
"""Lays recording folders over the real recordings, without rewriting them.

usage: tools/real_recordings.py DATA OUT

For every run of DATA (see docs/results/real-recordings.md) a folder OUT/<set>/<kind>/<session>/<run>/recording.toml maps the foreign
CSV file onto Trundle's streams; OUT/<set>/robot.toml is the robot as its owners assumed it. OUT/<set>_pods are
the omni robots again as two measuring wheels and a gyro, OUT/<set>_gyro as all their wheels and a gyro, which they have
not: gyro.csv is computed from the reference's heading, smoothed, without bias or noise.
"""
import csv
import math
import sys
from pathlib import Path


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def wheel(name, x, y, direction_deg, kind, diameter, ticks, extra=""):
    return (f'[[wheel]]\nname = "{name}"\nx_m = {x!r}\ny_m = {y!r}\ndirection_deg = {direction_deg!r}\n'
            f'kind = "{kind}"\ndiameter_m = {diameter!r}\nticks_per_revolution = {ticks!r}\n{extra}\n')


def csv_run(file, wheels, revolutions=False):
    """recording.toml of a headerless CSV: time, x, y, heading, then the wheels' increments in column 5, 6, ..., counts or
    revolutions."""
    columns = "".join(f'columns.{name}_rad = {{ column = {column}, unit = "rev" }}\n' if revolutions else
                      f"columns.{name}_ticks = {column}\n" for name, column in wheels.items())
    return (f'[wheels]\nfile = "{file}"\nheader = false\nincrements = true\ncolumns.time_s = 1\n{columns}\n'
            f'[reference]\nfile = "{file}"\nheader = false\ncolumns.time_s = 1\ncolumns.x_m = 2\ncolumns.y_m = 3\n'
            f'columns.heading_rad = 4\n')


def optiodom(data, out, name, robot, wheels, as_name=None):
    revolutions = name == "optiodom_omni4"
    target = out / (as_name or name)
    write(target / "robot.toml", robot)
    for file in sorted((data / name).glob("*/*/*_run-*.csv")):
        kind, session, run = file.parts[-3], file.parts[-2], file.stem[-6:]
        write(target / kind / session / run / "recording.toml", csv_run(file.resolve(), wheels, revolutions))


def optiodom_diff(data, out):
    robot = 'name = "optiodom_diff"\n\n' + wheel("left", 0.0, 0.1, 0.0, "fixed", 0.084, 2796.8) + wheel(
        "right", 0.0, -0.1, 0.0, "fixed", 0.084, 2796.8)
    optiodom(data, out, "optiodom_diff", robot, {"left": 6, "right": 5})


def omni3_wheels(count):
    """Rolling clockwise around the centre, at a lever of -0.195 m."""
    text = ""
    for i, direction in enumerate((-150.0, -30.0, 90.0)[:count]):
        a = math.radians(direction)
        text += wheel(f"w{i}", -0.195 * math.sin(a), 0.195 * math.cos(a), direction, "omni", 0.102, 12288)
    return text


def optiodom_omni3(data, out):
    robot = 'name = "optiodom_omni3"\n\n' + omni3_wheels(3)
    optiodom(data, out, "optiodom_omni3", robot, {"w0": 5, "w1": 6, "w2": 7})


PODS_SMOOTHING_S = 0.24  # to either side: the reference's heading trembles by a degree or so


def unwrapped(angles):
    result = angles[:1]
    for angle in angles[1:]:
        result.append(result[-1] + math.remainder(angle - result[-1], 2 * math.pi))
    return result


def smoothed(values, widest):
    """Moving average, shorter towards the ends, so that a constant rate keeps its value."""
    means = []
    for i in range(len(values)):
        half = min(widest, i, len(values) - 1 - i)
        means.append(sum(values[i - half:i + half + 1]) / (2 * half + 1))
    return means


def gyro_of(file):
    """gyro.csv from the heading of a headerless CSV: the rates at the stamps whose trapezoids sum to the heading."""
    with open(file, newline="") as lines:
        rows = [[float(cell) for cell in row[:4]] for row in csv.reader(lines)]
    time = [row[0] for row in rows]
    step_s = (time[-1] - time[0]) / (len(time) - 1)
    heading = smoothed(unwrapped([row[3] for row in rows]), round(PODS_SMOOTHING_S / step_s))
    text = "time_s,yaw_rate_rad_s\n"
    for i in range(len(time)):
        a, b = max(i - 1, 0), min(i + 1, len(time) - 1)
        text += f"{time[i]!r},{(heading[b] - heading[a]) / (time[b] - time[a])!r}\n"
    return text


def with_gyro(data, out, name, wheels_of, count, as_name):
    """A robot of `name` again with its first `count` wheels and a gyro."""
    robot = f'name = "{as_name}"\n\n' + wheels_of(count) + "[gyro]\nnoise_rad_s_sqrt_hz = 0.0003\n"
    optiodom(data, out, name, robot, {f"w{i}": 5 + i for i in range(count)}, as_name=as_name)
    for file in sorted((data / name).glob("*/*/*_run-*.csv")):
        write(out / as_name / file.parts[-3] / file.parts[-2] / file.stem[-6:] / "gyro.csv", gyro_of(file))


def optiodom_omni3_with_gyro(data, out):
    with_gyro(data, out, "optiodom_omni3", omni3_wheels, 2, "optiodom_omni3_pods")
    with_gyro(data, out, "optiodom_omni3", omni3_wheels, 3, "optiodom_omni3_gyro")


def omni4_wheels(count):
    """Four mecanum wheels, known here by the direction that each of them senses; recorded in revolutions."""
    text = ""
    for i, direction in enumerate((-45.0, -135.0, 45.0, 135.0)[:count]):
        a = math.radians(direction)
        text += wheel(f"w{i}", -0.146 * math.sin(a), 0.146 * math.cos(a), direction, "omni", 0.045, 0)
    return text


def optiodom_omni4(data, out):
    robot = 'name = "optiodom_omni4"\n\n' + omni4_wheels(4)
    optiodom(data, out, "optiodom_omni4", robot, {f"w{i}": 5 + i for i in range(4)})


def optiodom_omni4_with_gyro(data, out):
    with_gyro(data, out, "optiodom_omni4", omni4_wheels, 2, "optiodom_omni4_pods")
    with_gyro(data, out, "optiodom_omni4", omni4_wheels, 4, "optiodom_omni4_gyro")


def optiodom_tricyc(data, out):
    """The angle is that in the interval before its stamp, of 0.05 s."""
    target = out / "optiodom_tricyc"
    write(target / "robot.toml",
          'name = "optiodom_tricyc"\n\n' + wheel("front", 0.15, 0.0, 0.0, "fixed", 0.065, 1600) +
          "steered = true\nsteering_time_offset_s = -0.025\n\n" +
          '[[wheel]]\nname = "rear"\npassive = true\nx_m = 0.0\ny_m = 0.0\n')
    for file in sorted((data / "optiodom_tricyc").glob("*/*/*_run-*.csv")):
        kind, session, run = file.parts[-3], file.parts[-2], file.stem[-6:]
        write(target / kind / session / run / "recording.toml",
              f'[wheels]\nfile = "{file.resolve()}"\nheader = false\nincrements = true\n'
              "columns = { time_s = 1, front_ticks = 5, front_steering_rad = 6 }\n"
              f'[reference]\nfile = "{file.resolve()}"\nheader = false\n'
              "columns = { time_s = 1, x_m = 2, y_m = 3, heading_rad = 4 }\n")


def censi(data, out):
    folder = out / "censi_calibration"
    write(folder / "robot.toml",
          'name = "khepera"\n\n' + wheel("left", 0.0, 0.045, 0.0, "fixed", 0.042, 0) +
          wheel("right", 0.0, -0.045, 0.0, "fixed", 0.042, 0) +
          '[reference_sensor]\nx_m = 0.0\ny_m = 0.0\nheading_deg = -90.0\n')
    for file in sorted((data / "censi_calibration").glob("*.tuple")):
        write(folder / file.stem / "recording.toml", f'[relative_motion]\ntuple_file = "{file.resolve()}"\n')


def ese650(data, out):
    folder = out / "ese650_skidsteer"
    # Tracks 311.15 and 476.25 mm: their mean, left and right alike; 360 counts of a 0.254 m wheel.
    robot = 'name = "ese650"\n\n'
    for name, x, y in (("fl", 0.165, 0.197), ("fr", 0.165, -0.197), ("rl", -0.165, 0.197), ("rr", -0.165, -0.197)):
        robot += wheel(name, x, y, 0.0, "skid", 0.254, 360)
    write(folder / "robot.toml", robot + "[gyro]\nnoise_rad_s_sqrt_hz = 0.001\n")
    for file in sorted((data / "ese650_skidsteer").glob("encoders*.csv")):
        imu = file.with_name(file.name.replace("encoders", "imu"))
        write(folder / file.stem / "recording.toml",
              f'[wheels]\nfile = "{file.resolve()}"\nincrements = true\ncolumns.time_s = "t_unix_s"\n'
              'columns.fr_ticks = "FR"\ncolumns.fl_ticks = "FL"\ncolumns.rr_ticks = "RR"\ncolumns.rl_ticks = "RL"\n\n'
              f'[gyro]\nfile = "{imu.resolve()}"\ncolumns.time_s = "t_unix_s"\n'
              'columns.yaw_rate_rad_s = "yaw_gyro_rads"\n')


def main():
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    for lay_out in (optiodom_diff, optiodom_omni3, optiodom_omni3_with_gyro, optiodom_omni4,
                    optiodom_omni4_with_gyro, optiodom_tricyc, censi, ese650):
        lay_out(data, out)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
