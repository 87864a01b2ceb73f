#!/usr/bin/env python3
"""Lays recording folders over real recordings in which wheels slip, without rewriting them.

usage: tools/slip_recordings.py DATA OUT

OUT/kobuki_slip/{nonfaulty_1, nonfaulty_2, left_faulty, right_faulty}: the recording without slip is cut in two
halves, one to learn from and one to judge. The gyro's stamps are TIME_OFFSET_S late, by cross-correlation of the two
turns over 0.5 s; its driver has already taken the bias off.
"""
import sys
from pathlib import Path

TIME_OFFSET_S = -0.06


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
    half_s = 37.5
    write(target / "nonfaulty_1/recording.toml", kobuki_run(source / "nonfaulty", end_s=half_s))
    write(target / "nonfaulty_2/recording.toml", kobuki_run(source / "nonfaulty", start_s=half_s))
    for name in ("left_faulty", "right_faulty"):
        write(target / name / "recording.toml", kobuki_run(source / name))


def main():
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    for lay_out in (kobuki_slip,):
        lay_out(data, out)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
