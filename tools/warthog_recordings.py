#!/usr/bin/env python3
"""Recording folders from the windows of the Warthog skid-steer robot on asphalt, gravel and ice.

usage: tools/warthog_recordings.py DATA OUT

For each window of 2 s in DATA/warthog_drive/warthog_wheels_*.csv a folder OUT/<surface>/<half>/<window> with wheels.csv,
gyro.csv and reference.csv (lidar). Every second command of the robot, with its three windows, is in the half 'train', the
others in 'test'. OUT/robot.toml is the robot as its owners configured it, OUT/wheels_only.toml the same without gyro.
The lidar's pose comes at 10 Hz and is repeated in between: repeated rows are left out.
"""
import csv
import sys
from pathlib import Path

WHEELS = 'name = "warthog"\n' + "".join(
    f'\n[[wheel]]\nname = "{name}"\ny_m = {y}\nkind = "skid"\ndiameter_m = 0.6\n'
    for name, y in (("left", 0.54), ("right", -0.54)))
GYRO = "\n[gyro]\nnoise_rad_s_sqrt_hz = 0.002\n"


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def write_window(folder, rows):
    wheels, gyro, reference = ["time_s,left_rad_s,right_rad_s"], ["time_s,yaw_rate_rad_s"], ["time_s,x_m,y_m,heading_rad"]
    pose = None
    for row in rows:
        t = row["t_s"]
        wheels.append(f"{t},{row['left_wheel_rads']},{row['right_wheel_rads']}")
        gyro.append(f"{t},{row['imu_yaw_rate_rads']}")
        seen = (row["icp_x_m"], row["icp_y_m"], row["icp_yaw_rad"])
        if seen != pose:
            reference.append(",".join((t, *seen)))
        pose = seen
    for name, lines in (("wheels", wheels), ("gyro", gyro), ("reference", reference)):
        write(folder / f"{name}.csv", "\n".join(lines) + "\n")


def main():
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    write(out / "wheels_only.toml", WHEELS)
    write(out / "robot.toml", WHEELS + GYRO)
    for file in sorted((data / "warthog_drive").glob("warthog_wheels_*.csv")):
        surface = file.stem.split("_")[2]
        windows = {}
        with open(file, newline="") as lines:
            for row in csv.DictReader(lines):
                windows.setdefault((row["calib_step"], row["window"]), []).append(row)
        for (step, window), rows in windows.items():
            half = "train" if int(float(step)) % 2 == 0 else "test"
            write_window(out / surface / half / f"{int(window):03}", rows)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
