#!/usr/bin/env python3
"""Lays recording folders with sightings over the real recordings.

usage: tools/slam_recordings.py DATA OUT

OUT/mrclam/robot.toml, OUT/mrclam/landmarks.csv (where they were measured to be) and
OUT/mrclam/Robot<N>/reference.csv: the layout itself is read as it is, with --robot-number.
OUT/lost_in_the_woods: velocity.csv, sightings.csv, reference.csv, landmarks.csv, robot.toml. The noise settings are one set
for all robots and filters; those of mrclam were chosen on robots 1 and 2. Sigmas of sightings are several times what
single readings scatter by, because readings that follow each other err alike.
"""
import csv
import sys
from pathlib import Path

MRCLAM_ROBOT = """name = "mrclam"
[landmark_sensor]
range_sigma_m = 0.5
bearing_sigma_deg = 2.5
[noise]
wheel_per_sqrt_m = 0.05
lateral_per_sqrt_m = 0.02
turn_per_sqrt_m = 0.05
turn_per_sqrt_rad = 0.1
"""

LOST_ROBOT = """name = "lost_in_the_woods"
[landmark_sensor]
x_m = 0.219016267
range_sigma_m = 0.03
bearing_sigma_deg = 1.5
[noise]
wheel_per_sqrt_m = 0.06
lateral_per_sqrt_m = 0.03
turn_per_sqrt_m = 0.06
turn_per_sqrt_rad = 0.1
"""


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def table(header, rows):
    return "\n".join([header] + [",".join(row) for row in rows]) + "\n"


def columns(path):
    return [line.split() for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")]


def mrclam(data, out):
    folder = data / "MRCLAM_Dataset6"
    write(out / "robot.toml", MRCLAM_ROBOT)
    write(out / "landmarks.csv",
          table("landmark,x_m,y_m", [row[:3] for row in columns(folder / "Landmark_Groundtruth.dat")]))
    for robot in range(1, 6):
        write(out / f"Robot{robot}" / "reference.csv",
              table("time_s,x_m,y_m,heading_rad", columns(folder / f"Robot{robot}_Groundtruth.dat")))


def lost_in_the_woods(data, out):
    write(out / "robot.toml", LOST_ROBOT)
    with open(data / "dataset2.csv", newline="") as file:
        rows = list(csv.reader(file))[1:]
    with open(data / "landmarks.csv", newline="") as file:
        landmarks = [[str(i), *row] for i, row in enumerate(csv.reader(file))][1:]
    seen = [[row[0], str(i + 1), row[7 + i], row[24 + i]]
            for row in rows for i in range(17) if float(row[7 + i]) > 0]
    write(out / "velocity.csv", table("time_s,forward_m_s,yaw_rate_rad_s", [row[:3] for row in rows]))
    write(out / "sightings.csv", table("time_s,landmark,range_m,bearing_rad", seen))
    write(out / "reference.csv",
          table("time_s,x_m,y_m,heading_rad", [[row[0], *row[3:6]] for row in rows if row[6] == "1"]))
    write(out / "landmarks.csv", table("landmark,x_m,y_m", landmarks))


def main():
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    mrclam(data / "mrclam", out / "mrclam")
    lost_in_the_woods(data / "lost_in_the_woods", out / "lost_in_the_woods")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
