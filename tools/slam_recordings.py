#!/usr/bin/env python3
"""Lays recording folders with sightings over the real recordings.

usage: tools/slam_recordings.py DATA OUT

OUT/mrclam/robot.toml, OUT/mrclam/landmarks.csv (where they were measured to be) and
OUT/mrclam/Robot<N>/reference.csv: the layout itself is read as it is, with --robot-number.
OUT/victoria_park: velocity.csv (of the rear axle's middle), sightings.csv without names, reference.csv (GPS fixes that are
sane), robot.toml. OUT/victoria_park_steered/whole, /first, /second: the same as it was measured, wheels.csv of the rear left
wheel's rate and the steering's angle, and its halves.
OUT/lost_in_the_woods: velocity.csv, sightings.csv, reference.csv, landmarks.csv, robot.toml. The noise settings are one set
for all robots and filters; those of mrclam were chosen on robots 1 and 2. Sigmas of sightings are several times what
single readings scatter by, because readings that follow each other err alike; those of victoria_park are a trunk's
radius and the laser's step.
"""
import csv
import math
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

VICTORIA_SENSOR = """
[landmark_sensor]
x_m = 3.78
y_m = 0.5
range_sigma_m = 0.1
bearing_sigma_deg = 0.5
max_range_m = 80
"""

VICTORIA_ROBOT = f"""name = "victoria_park"
{VICTORIA_SENSOR}
[noise]
wheel_per_sqrt_m = 0.1
lateral_per_sqrt_m = 0.03
turn_per_sqrt_m = 0.01
turn_per_sqrt_rad = 0.02
"""

# One front wheel stands for both. The speed is that of the left rear wheel: of a diameter of 2 m, 1 rad/s is 1 m/s.
VICTORIA_STEERED = f"""name = "victoria_park"

[[wheel]]
name = "rear_left"
y_m = 0.76
diameter_m = 2.0

[[wheel]]
name = "front"
passive = true
steered = true
x_m = 2.83
{VICTORIA_SENSOR}
[noise]
wheel_per_sqrt_m = 0.1
lateral_per_sqrt_m = 0.03
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


def is_sane(fixes, i):
    """The truck drives at most 8 m/s; a fix stands beside both its neighbours, and not behind a gap."""
    for a, b in ((fixes[i - 1], fixes[i]), (fixes[i], fixes[i + 1])):
        if b[0] - a[0] > 2.0 or math.dist(a[1:], b[1:]) > 1.0 + 8.0 * (b[0] - a[0]):
            return False
    return True


def victoria_park(data, out):
    wheelbase, encoder_offset = 2.83, 0.76
    write(out / "robot.toml", VICTORIA_ROBOT)

    def rows_of(name):
        return [[float(x) for x in line.split()] for line in (data / name).read_text().splitlines() if line.strip()]

    velocity = []
    inputs = rows_of("inputs.dat")
    for time, speed, steering in inputs:
        forward = speed / (1.0 - math.tan(steering) * encoder_offset / wheelbase)
        velocity.append([repr(time), repr(forward), repr(forward * math.tan(steering) / wheelbase)])
    sightings = [[repr(time), "", repr(distance), repr(bearing - math.pi / 2)]
                 for time, distance, bearing, _ in rows_of("measurements.dat")]
    fixes = rows_of("gps.dat")
    sane = [[repr(x) for x in fixes[i]] for i in range(1, len(fixes) - 1) if is_sane(fixes, i)]
    write(out / "velocity.csv", table("time_s,forward_m_s,yaw_rate_rad_s", velocity))
    write(out / "sightings.csv", table("time_s,landmark,range_m,bearing_rad", sightings))
    write(out / "reference.csv", table("time_s,x_m,y_m", sane))

    steered = out.with_name("victoria_park_steered")
    write(steered / "robot.toml", VICTORIA_STEERED)
    middle = (inputs[0][0] + inputs[-1][0]) / 2
    for part, start, end in (("whole", -math.inf, math.inf), ("first", -math.inf, middle), ("second", middle, math.inf)):
        def within(rows):
            return [row for row in rows if start <= float(row[0]) < end]
        write(steered / part / "wheels.csv", table("time_s,rear_left_rad_s,front_steering_rad", [map(repr, row) for row in within(inputs)]))
        write(steered / part / "sightings.csv", table("time_s,landmark,range_m,bearing_rad", within(sightings)))
        write(steered / part / "reference.csv", table("time_s,x_m,y_m", within(sane)))


def main():
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    mrclam(data / "mrclam", out / "mrclam")
    victoria_park(data / "victoria_park", out / "victoria_park")
    lost_in_the_woods(data / "lost_in_the_woods", out / "lost_in_the_woods")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
