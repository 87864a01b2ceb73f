#!/usr/bin/env python3
"""What `trundle` says of the mistakes that people make in robot.toml and recording.toml, as a table.

usage: tools/mistakes.py PROGRAM [MISTAKES.md] [--only WORDS] [--keep FOLDER] [--jobs N]

Robots whose truth is known drive: the differential one of data/demo, and four that are simulated here. Their logs are
described by a robot file and a recording.toml that are right but for one mistake; `trundle run` calibrates on all runs
but one and takes that one through every stage. A mistake is

  named            a sentence printed says what is wrong: what it must say is written beside the mistake
  estimated away   nobody names it, and the calibrated robot is right all the same
  undetectable     nothing measured shows it, and that is said: the numbers that are wrong were held, not estimated
  uncertain        nobody names it, but the error bars that are stated hold the truth (three sigmas of the worst number)
  SILENT           numbers are wrong, and nothing is said

Right are the counts that a wheel makes as the robot rolls a metre or turns a radian, the angle that a steering's reading
stands for, and the scale of the gyro, to within 1 % or 0.01 rad; of a mistake about landmarks, the map to within 0.1 m.
With MISTAKES.md what is neither named nor estimated away is written between the marks in it, and the whole table beside
it, MISTAKES.csv. The exit code is 1 where a mistake is silent, or the program fails.
"""
import argparse
import cmath
import concurrent.futures
import copy
import csv
import json
import math
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- mistakes: begin -->", "<!-- mistakes: end -->"
RIGHT = 0.01  # of the truth; without a mistake 0.002 is left
RIGHT_MAP_M = 0.1
# A refusal that names a parameter where the runs fit none.
NO_CAUSE = re.compile(r"they do not determine it|the search does not settle|nothing can be estimated")
STREAMS = ("wheels", "gyro", "reference", "sightings")

PACE = """
steering = "odometry"
whole_intervals = false
[pace]
forward_m_s = 0.3
turn_rad_s = 0.8
rest_s = 0.7
[encoders]
rate_hz = 10
[gyro]
rate_hz = 20
"""

OMNI = """
[[wheel]]
name = "a"
x_m = 0.1
y_m = 0.1732050807568877
direction_deg = 150
[[wheel]]
name = "b"
x_m = -0.2
direction_deg = -90
[[wheel]]
name = "c"
x_m = 0.1
y_m = -0.1732050807568877
direction_deg = 30
[gyro]
[noise]
wheel_per_sqrt_m = 0.001
""".replace("[[wheel]]\n", '[[wheel]]\nkind = "omni"\ndiameter_m = 0.06\nticks_per_revolution = 1000\ntick_bits = 16\n')

REFERENCE = """
[truth.gyro]
bias_rad_s = 0.01
scale = 1.005
[reference]
rate_hz = 5
position_sigma_m = 0.001
heading_sigma_deg = 0.1
"""

TOUR = REFERENCE + """
[[run]]
name = "tour"
repeat = 4
[[run.path]]
drive = "pause"
duration_s = 3
[[run.path]]
drive = "tour"
length_m = 20
box_x_m = 5
box_y_m = 5
"""

OMNI_DRIVES = PACE + """
[truth.wheel.a]
diameter_m = 0.0606
[truth.wheel.b]
x_m = -0.204
[truth.wheel.c]
diameter_m = 0.0596
""" + TOUR + "sideways = true\n"

TRICYCLE = """
[[wheel]]
name = "front"
x_m = 0.4
diameter_m = 0.2
ticks_per_revolution = 1000
tick_bits = 16
steered = true
[[wheel]]
name = "left"
y_m = 0.2
passive = true
[[wheel]]
name = "right"
y_m = -0.2
passive = true
[gyro]
[noise]
wheel_per_sqrt_m = 0.002
"""

TRICYCLE_DRIVES = PACE.replace("= 0.3", "= 0.6") + """
[truth.wheel.front]
x_m = 0.404
diameter_m = 0.2012
steering_zero_deg = 0.8
steering_scale = 1.01
""" + TOUR

CAR = """
[[wheel]]
name = "left"
y_m = 0.2
diameter_m = 0.2
ticks_per_revolution = 1000
tick_bits = 16
[[wheel]]
name = "right"
y_m = -0.2
diameter_m = 0.2
ticks_per_revolution = 1000
tick_bits = 16
[[wheel]]
name = "front"
x_m = 0.4
passive = true
steered = true
steering_ticks_per_revolution = 4096
[gyro]
[noise]
wheel_per_sqrt_m = 0.002
"""

CAR_DRIVES = PACE.replace("= 0.3", "= 0.6").replace("odometry", "truth") + """
[steered_wheels]
unit = "ticks"
[truth]
track_m = 0.404
[truth.wheel.left]
diameter_m = 0.2012
[truth.wheel.right]
diameter_m = 0.1994
[truth.wheel.front]
x_m = 0.404
steering_zero_deg = 0.8
steering_scale = 1.01
""" + REFERENCE + """
[[run]]
name = "tour"
repeat = 4
[[run.path]]
drive = "pause"
duration_s = 3
[[run.path]]
drive = "straight"
length_m = 2
[[run.path]]
drive = "figure_eight"
radius_m = 0.4
[[run.path]]
drive = "figure_eight"
radius_m = 1
[[run.path]]
drive = "figure_eight"
radius_m = 0.4
[[run.path]]
drive = "arc"
length_m = 2
angle_deg = -60
[[run.path]]
drive = "straight"
length_m = -2
[[run.path]]
drive = "arc"
length_m = -2
angle_deg = -60
"""

TAPE_DRIVES = PACE + """
[truth]
track_m = 0.306
[truth.wheel.left]
diameter_m = 0.1007
[truth.wheel.right]
diameter_m = 0.0998
[truth.gyro]
bias_rad_s = 0.012
scale = 1.008
[partial_reference]
end_pose = true
[[run]]
name = "square_ccw"
repeat = 2
[[run.path]]
drive = "pause"
duration_s = 2
[[run.path]]
drive = "square"
side_m = 2
[[run]]
name = "square_cw"
repeat = 2
[[run.path]]
drive = "pause"
duration_s = 2
[[run.path]]
drive = "square"
side_m = 2
turn = "cw"
[[run]]
name = "straight"
[run.partial_reference]
end_pose = false
distance = true
[[run.path]]
drive = "pause"
duration_s = 2
[[run.path]]
drive = "straight"
length_m = 5
[[run]]
name = "turns"
[run.partial_reference]
end_pose = false
turns = true
[[run.path]]
drive = "pause"
duration_s = 2
[[run.path]]
drive = "circle"
radius_m = 0.2
turns = 5
"""


# ---- TOML and CSV -------------------------------------------------------------------------------------------------


def value_text(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {value_text(one)}" for key, one in value.items()) + " }"
    return json.dumps(value)  # text, numbers and booleans look alike


def toml_of(document):
    simple = [f"{key} = {value_text(value)}" for key, value in document.items() if not isinstance(value, (dict, list))]
    for key, value in document.items():
        for table in value if isinstance(value, list) else [value] if isinstance(value, dict) else []:
            simple += [f"[[{key}]]" if isinstance(value, list) else f"[{key}]"]
            for name, one in table.items():
                if name == "columns":
                    simple += [f"columns.{column} = {value_text(source)}" for column, source in one.items()]
                else:
                    simple.append(f"{name} = {value_text(one)}")
    return "\n".join(simple) + "\n"


def read_table(path):
    """Columns by name; numbers, but for the names of landmarks."""
    with open(path, newline="") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return {name: [row[name] if name == "landmark" else float(row[name] or "nan") for row in rows] for name in rows[0]}


def text_of(cell):
    return "" if cell != cell else str(int(cell)) if isinstance(cell, float) and cell.is_integer() else str(cell)


def csv_of(table, header=True):
    lines = [",".join(table)] if header else []
    return "\n".join(lines + [",".join(map(text_of, row)) for row in zip(*table.values())]) + "\n"


# ---- Robots and what they recorded --------------------------------------------------------------------------------


class Case:
    """A robot file, how recording.toml reads the logs, and the logs of each run."""

    def __init__(self, robot, truth, folders, subject):
        self.robot, self.truth, self.subject = robot, truth, subject
        self.landmarks = None
        self.usual = None  # what is said without a mistake
        self.with_sightings = False  # the map costs time, and only mistakes about it need it
        self.logs, self.partial, self.maps, self.texts, self.changes = {}, {}, {}, {}, {}
        for folder in folders:
            self.logs[folder.name] = {name: read_table(folder / f"{name}.csv") for name in STREAMS
                                      if (folder / f"{name}.csv").exists()}
            said = tomllib.loads((folder / "recording.toml").read_text())
            self.partial[folder.name] = said.get("reference", {})
            for name, table in self.logs[folder.name].items():
                self.maps.setdefault(name, {"columns": {column: column for column in table}})
            if (folder / "landmarks.csv").exists():
                self.landmarks = read_table(folder / "landmarks.csv")

    def wheel(self, index):
        return self.robot["wheel"][index]

    def each(self, stream):
        return [log[stream] for log in self.logs.values() if stream in log]

    def change(self, stream, column, function):
        self.changes.setdefault(column, []).append(function)
        for table in self.each(stream):
            table[column] = [function(value) for value in table[column]]

    def write(self, folder):
        (folder / "runs").mkdir(parents=True)
        (folder / "robot.toml").write_text(toml_of(self.robot))
        for run, log in self.logs.items():
            target = folder / ("subject" if run == self.subject else "runs") / run
            target.mkdir(parents=True)
            document = {"session": "one"}
            for name, table in log.items():
                if name == "sightings" and not self.with_sightings:
                    continue
                document[name] = {"file": f"log_{name}.csv", **copy.deepcopy(self.maps[name])}
                text = csv_of(table, document[name].get("header", True) or "named" in document[name])
                document[name].pop("named", None)
                (target / f"log_{name}.csv").write_text(self.texts.get(name, lambda same: same)(text))
            document.setdefault("reference", {}).update(self.partial[run])
            if not document["reference"]:
                del document["reference"]
            (target / "recording.toml").write_text(toml_of(document))
        return folder / "runs", folder / "subject" / self.subject


def robots(program, folder):
    """Each with its logs, right in everything."""
    demo = ROOT / "data/demo"
    session = demo / "session_01"
    truth = tomllib.loads((session / "truth.toml").read_text())
    yield "differential", Case(tomllib.loads((demo / "robot.toml").read_text()), truth,
                               sorted(path for path in session.iterdir() if path.is_dir()), "tour")
    tape = (demo / "robot.toml").read_text().split("[landmark_sensor]")[0]
    for name, robot, drives, subject in (("omni-3", OMNI, OMNI_DRIVES, "tour_04"), ("tape", tape, TAPE_DRIVES, "square_cw_02"),
                                         ("tricycle", TRICYCLE, TRICYCLE_DRIVES, "tour_04"), ("car", CAR, CAR_DRIVES, "tour_04")):
        place = folder / name
        place.mkdir(parents=True)
        (place / "robot.toml").write_text(robot)
        (place / "scenario.toml").write_text('name = "one"\nrobot = "robot.toml"\nseed = 3\n' + drives)
        subprocess.run([program, "simulate", place / "scenario.toml", "-o", place / "logs", "--quiet"], check=True)
        truth = tomllib.loads(next((place / "logs").rglob("truth.toml")).read_text())
        runs = sorted(path.parent for path in (place / "logs").rglob("wheels.csv"))
        yield name, Case(tomllib.loads(robot), truth, runs, subject)


# ---- Mistakes -----------------------------------------------------------------------------------------------------

MISTAKES = []
DIFFERENTIAL = ("differential", "tape")
STEERED = ("tricycle", "car")
UNSTEERED = ("differential", "omni-3", "tape")
USUAL = UNSTEERED + ("tricycle",)
TWO_ENCODERS = UNSTEERED + ("car",)  # and more
REFERENCED = ("differential", "omni-3", "tricycle")
SEEING = ("differential",)


def mistake(words, sentence, on=USUAL, file="robot.toml"):
    """A function that makes it; what a sentence that names it must match."""
    def add(make):
        MISTAKES.append((file, words, make, re.compile(sentence), on))
        return make
    return add


def robot_mistake(words, sentence, make, **options):
    mistake(words, sentence, **options)(make)


def map_mistake(words, sentence, make, **options):
    mistake(words, sentence, file="recording.toml", **options)(make)


def all_wheels(key, factor):
    def make(case):
        for wheel in case.robot["wheel"]:
            if key in wheel:
                wheel[key] *= factor
    return make


def places(factor):
    return lambda case: (all_wheels("x_m", factor)(case), all_wheels("y_m", factor)(case))


def one_wheel(index, **keys):
    return lambda case: case.wheel(index).update(keys)


def set_in(section, **keys):
    return lambda case: case.robot.setdefault(section, {}).update(keys)


def seeing(make):
    def with_sightings(case):
        case.with_sightings = True
        make(case)
    return with_sightings


def scaled(stream, factor, *columns):
    return lambda case: [case.change(stream, column, lambda value: value * factor) for column in columns]


def later(stream, seconds):
    return lambda case: case.change(stream, "time_s", lambda t: t + seconds)


def negate_counts(case, index):
    case.wheel(index)["ticks_per_revolution"] *= -1


def swapped(stream, one, other):
    def make(case):
        columns = case.maps[stream]["columns"]
        columns[one], columns[other] = columns[other], columns[one]
    return make


def wheel_columns(case):
    return [column for column in case.maps["wheels"]["columns"] if column != "time_s" and "_steering_" not in column]


def steering_column(case):
    return next(column for column in case.maps["wheels"]["columns"] if "_steering_" in column)


def steered(case):
    return next(wheel for wheel in case.robot["wheel"] if wheel.get("steered"))


def steered_keys(**keys):
    return lambda case: steered(case).update(keys)


def steered_times(key, factor):
    return lambda case: steered(case).update({key: factor * steered(case)[key]})


def steering_reads(function):
    return lambda case: case.change("wheels", steering_column(case), function)


def steering_swapped(case):
    swapped("wheels", steering_column(case), wheel_columns(case)[0])(case)


def steering_later(case):
    for table in case.each("wheels"):
        angles = table[steering_column(case)]
        table[steering_column(case)] = [angles[max(row - 2, 0)] for row in range(len(angles))]  # rows of 0.1 s


def mapped(stream, **keys):
    return lambda case: case.maps[stream].update(keys)


def unit(stream, column, symbol):
    return lambda case: case.maps[stream]["columns"].update({column: {"column": column, "unit": symbol}})


def differences(case):
    for table in case.each("wheels"):
        for column in wheel_columns(case):
            values = table[column]
            steps = [(now - before + 32768) % 65536 - 32768 for before, now in zip(values, values[1:])]
            table[column] = [0.0] + steps


def as_increments(case):
    differences(case)


def garbage(stream, number):
    def make(case):
        for table in case.each(stream):
            for column, values in table.items():
                values[0] = values[0] if column in ("time_s", "landmark") else number
    return make


def reference_at(x, y):
    """The marker is not where the robot file says: x ahead, y to the left."""
    def make(case):
        for table in case.each("reference"):
            for i, heading in enumerate(table["heading_rad"]):
                table["x_m"][i] += x * math.cos(heading) - y * math.sin(heading)
                table["y_m"][i] += x * math.sin(heading) + y * math.cos(heading)
    return make


def of_headings(function):
    return lambda case: case.change("reference", "heading_rad", function)


def mirrored(case):
    case.change("reference", "y_m", lambda y: -y)
    case.change("reference", "heading_rad", lambda h: -h)


def compass(case):
    """Heading clockwise from north, where x points east and y north."""
    case.change("reference", "heading_rad", lambda h: math.pi / 2 - h)


def partial(run, key, function):
    def make(case):
        for name, said in case.partial.items():
            if name.startswith(run):
                said[key] = function(said[key])
    return make


def partial_set(run, **keys):
    return lambda case: [case.partial[name].update(keys) for name in case.partial if name.startswith(run)]


SIZE = r"diameter|track|y_m|reference moves|expected metres|which no wheel has|times as far as the wheels"
PLACE = r"x_m|front\.x comes out|wheelbase"
COUNTS = r"ticks_per_revolution|times as far"
CLOCK = r"stamps|time_unit|time_offset|never at the same time|time zone"
TURN = r"turns|heading|deg"

# The robot file: lengths.
robot_mistake("diameter in mm", SIZE, all_wheels("diameter_m", 1000))
robot_mistake("diameter in cm", SIZE, all_wheels("diameter_m", 100))
robot_mistake("diameter in inches", SIZE, all_wheels("diameter_m", 1 / 0.0254))
robot_mistake("radius for diameter", SIZE, all_wheels("diameter_m", 0.5))
robot_mistake("circumference for diameter", SIZE, all_wheels("diameter_m", math.pi))
robot_mistake("places of the wheels in mm", SIZE + "|" + PLACE, places(1000))
robot_mistake("places of the wheels in cm", SIZE + "|" + PLACE, places(100))
robot_mistake("places of the wheels in inches", SIZE + "|" + PLACE, places(1 / 0.0254))
robot_mistake("track for y_m, which is half of it", SIZE + "|" + PLACE, places(2))
robot_mistake("a quarter for half of the track", SIZE + "|" + PLACE, places(0.5))
robot_mistake("y to the right", "swapped|upside down|y_m", all_wheels("y_m", -1))
robot_mistake("y_m of one wheel forgotten", "in one place|track|y_m", lambda case: case.wheel(1).pop("y_m"), on=DIFFERENTIAL)
robot_mistake("both wheels on the left", "in one place", lambda case: case.wheel(1).update(y_m=0.15), on=DIFFERENTIAL)
# Counts.
robot_mistake("gear ratio of 30 forgotten", COUNTS, all_wheels("ticks_per_revolution", 1 / 30))
robot_mistake("gear ratio of 30 taken twice", COUNTS, all_wheels("ticks_per_revolution", 30))
robot_mistake("lines for edges of a quadrature encoder (x 1/4)", COUNTS, all_wheels("ticks_per_revolution", 0.25))
robot_mistake("edges counted twice (x 4)", COUNTS, all_wheels("ticks_per_revolution", 4))
robot_mistake("gear ratio forgotten of one wheel (x 1/2)", COUNTS + "|diameter", lambda case: case.wheel(0).update(
    ticks_per_revolution=case.wheel(0)["ticks_per_revolution"] / 2))
robot_mistake("first wheel counts backwards", "counts backwards", lambda case: negate_counts(case, 0))
robot_mistake("second wheel counts backwards", "counts backwards", lambda case: negate_counts(case, 1), on=TWO_ENCODERS)
robot_mistake("third wheel counts backwards", "counts backwards", lambda case: negate_counts(case, 2), on=("omni-3",))
robot_mistake("all wheels count backwards", "counts backwards", all_wheels("ticks_per_revolution", -1))
robot_mistake("tick_bits forgotten", "tick_bits|wraps", all_wheels("tick_bits", 0))
robot_mistake("tick_bits of another counter (15 for 16)", "tick_bits", lambda case: [w.update(tick_bits=15) for w in case.robot["wheel"]])
robot_mistake("tick_bits of another counter (32 for 16)", "tick_bits", lambda case: [w.update(tick_bits=32) for w in case.robot["wheel"]])
# Directions and kinds.
robot_mistake("directions in radians", r"direction|carry each other|carries the signal|expected",
              lambda case: [w.update(direction_deg=math.radians(w.get("direction_deg", 0.0))) for w in case.robot["wheel"]], on=("omni-3",))
robot_mistake("one wheel's direction the other way round", "backwards", lambda case: case.wheel(1).update(
    direction_deg=case.wheel(1).get("direction_deg", 0.0) + 180), on=TWO_ENCODERS)
robot_mistake("directions of the axles for those of rolling", r"direction|sideways|carr", lambda case: [
    w.update(direction_deg=w.get("direction_deg", 0.0) - 90) for w in case.robot["wheel"]], on=UNSTEERED)
robot_mistake("kind = skid for wheels that do not", "skid", lambda case: [w.update(kind="skid") for w in case.robot["wheel"]], on=DIFFERENTIAL)
robot_mistake("kind = omni for wheels that do not slide", "kind|sideways|omni", lambda case: [w.update(kind="omni") for w in case.robot["wheel"]], on=DIFFERENTIAL)
robot_mistake("kind = fixed for omni wheels", "kind|fixed|contradict|slide", lambda case: [w.update(kind="fixed") for w in case.robot["wheel"]], on=("omni-3",))
robot_mistake("two wheels' names exchanged", "swapped|upside down", lambda case: (
    case.wheel(0).update(name="?"), case.wheel(0).update(name=case.wheel(1)["name"]),
    case.wheel(1).update(name=wheel_columns(case)[0].removesuffix("_ticks"))), on=TWO_ENCODERS)
# Steering.
STEERING_SIZE = r"steering_scale|steering_ticks_per_revolution|a steering"
STEERING = r"steering_zero_deg = |steering of '|_steering_|steering_scale|steering_ticks|a steering"
robot_mistake("wheelbase in mm", PLACE, steered_times("x_m", 1000), on=STEERED)
robot_mistake("wheelbase in cm", PLACE, steered_times("x_m", 100), on=STEERED)
robot_mistake("wheelbase in inches", PLACE, steered_times("x_m", 1 / 0.0254), on=STEERED)
robot_mistake("half the wheelbase", PLACE, steered_times("x_m", 0.5), on=STEERED)
robot_mistake("steered wheel's x with the wrong sign", PLACE + "|steering_scale = -1", steered_times("x_m", -1), on=STEERED)
robot_mistake("track of the rear wheels for y_m, which is half of it", SIZE, all_wheels("y_m", 2), on=("car",))
robot_mistake("steered = true forgotten", "steered", lambda case: steered(case).pop("steered"), on=STEERED)
robot_mistake("steered wheel's direction the other way round", "backwards|direction", steered_keys(direction_deg=180.0), on=STEERED)
robot_mistake("steered wheel's direction that of its axle", "direction|" + STEERING, steered_keys(direction_deg=90.0), on=STEERED)
robot_mistake("rear axle left out", "sideways|no wheel|not measured|cannot|passive", lambda case: case.robot.update(
    wheel=[steered(case)]), on=("tricycle",))
robot_mistake("steering_zero_deg off by 5°", STEERING, steered_keys(steering_zero_deg=5.0), on=STEERED)
robot_mistake("steering_zero_deg off by 90°", STEERING, steered_keys(steering_zero_deg=90.0), on=STEERED)
robot_mistake("steering_zero_deg in radians of 5°", STEERING, lambda case: (
    steered_keys(steering_zero_deg=math.radians(5.0))(case), steering_reads(lambda reading: reading + math.radians(5.0))(case)), on=("tricycle",))
robot_mistake("steering_scale the wrong way round (2 for 1/2)", STEERING_SIZE, lambda case: (
    steered_keys(steering_scale=2.0)(case), steering_reads(lambda reading: 2 * reading)(case)), on=("car",))
robot_mistake("steering_sigma_deg in radians", STEERING, steered_keys(steering_sigma_deg=0.0087), on=STEERED)
robot_mistake("steering_time_offset_s in ms", STEERING, steered_keys(steering_time_offset_s=20.0), on=("tricycle",))
robot_mistake("steering_ticks_per_revolution forgotten", STEERING, lambda case: steered(case).pop("steering_ticks_per_revolution"), on=("car",))
robot_mistake("steering_ticks_per_revolution of lines, not edges (x 1/4)", STEERING_SIZE, steered_times("steering_ticks_per_revolution", 0.25), on=("car",))
robot_mistake("steering_ticks_per_revolution of the motor (x 30)", STEERING, steered_times("steering_ticks_per_revolution", 30), on=("car",))
# The gyro and the place of the reference.
robot_mistake("gyro upside down", "upside down|scale = -1", lambda case: case.change("gyro", "yaw_rate_rad_s", lambda w: -w))
robot_mistake("[gyro] forgotten", r"\[gyro\]|gyro", lambda case: case.robot.pop("gyro"))
robot_mistake("gyro bias in deg/s", "bias", set_in("gyro", bias_rad_s=0.69))
robot_mistake("gyro scale the wrong way round (57)", "gyro", set_in("gyro", scale=57.2958))
robot_mistake("reference's place in cm", "reference|x_m", set_in("reference_sensor", x_m=10.0), on=REFERENCED)
robot_mistake("reference's place with the wrong sign", "reference", lambda case: (
    reference_at(0.1, 0)(case), set_in("reference_sensor", x_m=-0.1)(case)), on=REFERENCED)
# The landmark sensor.
robot_mistake("landmark sensor's place in cm", "landmark|innovations|x_m|lost", seeing(set_in("landmark_sensor", x_m=10.0)), on=SEEING)
robot_mistake("landmark sensor looks backwards", "landmark|innovations|lost|bearing", seeing(set_in("landmark_sensor", heading_deg=180)), on=SEEING)
robot_mistake("max_range_m in mm", "max_range", seeing(set_in("landmark_sensor", max_range_m=4000)), on=SEEING)
robot_mistake("max_range_m in km", "max_range", seeing(set_in("landmark_sensor", max_range_m=0.004)), on=SEEING)
robot_mistake("range_sigma_m in mm", "range_sigma|innovations", seeing(set_in("landmark_sensor", range_sigma_m=30)), on=SEEING)
robot_mistake("bearing_sigma_deg in radians", "innovations|sigma", seeing(set_in("landmark_sensor", bearing_sigma_deg=0.026)), on=SEEING)

# recording.toml: stamps.
for name, factor in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
    map_mistake(f"all stamps in {name}, no time_unit", CLOCK, lambda case, factor=factor: [
        later_scaled(case, stream, factor) for stream in STREAMS])
map_mistake("stamps of the gyro in ms", CLOCK, lambda case: later_scaled(case, "gyro", 1e3))
map_mistake("stamps of the reference in ms", CLOCK, lambda case: later_scaled(case, "reference", 1e3), on=REFERENCED)
map_mistake("time_unit = ms for stamps in seconds", CLOCK, lambda case: [m.update(time_unit="ms") for m in case.maps.values()])
map_mistake("rate_hz twice the true one", "rate_hz|stamps|time|times as far|never", lambda case: [
    (m["columns"].pop("time_s"), m.update(rate_hz=rate)) for m, rate in ((case.maps["wheels"], 20.0),)])
for seconds in (0.05, 0.5, 5.0):
    map_mistake(f"gyro's clock {seconds:g} s late", CLOCK, later("gyro", seconds))
    map_mistake(f"reference's clock {seconds:g} s late", CLOCK, later("reference", seconds), on=REFERENCED)
map_mistake("landmark sensor's clock 0.5 s late", CLOCK, seeing(later("sightings", 0.5)), on=SEEING)
map_mistake("reference in another time zone (1 h)", CLOCK, later("reference", 3600.0), on=REFERENCED)
map_mistake("gyro in another time zone (2 h)", CLOCK, later("gyro", -7200.0))
# Columns.
map_mistake("two wheels' columns swapped", "swapped|upside down", lambda case: swapped("wheels", *wheel_columns(case)[:2])(case), on=TWO_ENCODERS)
map_mistake("one wheel's column for two", "same|alike|carries|straight|never|column", lambda case: case.maps["wheels"]["columns"].update(
    {wheel_columns(case)[1]: wheel_columns(case)[0]}), on=TWO_ENCODERS)
map_mistake("counts since the row before, no increments = true", "increments = true", as_increments)
map_mistake("increments = true for counters that go on", "increments", mapped("wheels", increments=True))
map_mistake("counts read as radians", SIZE + "|_rad|ticks", lambda case: rename_wheel_columns(case, "_rad"))
map_mistake("counts read as metres", SIZE + "|_m|ticks", lambda case: rename_wheel_columns(case, "_m"))
map_mistake("header = false", "header", lambda case: case.maps["wheels"].update(
    header=False, named=True, columns={c: i + 1 for i, c in enumerate(case.maps["wheels"]["columns"])}))
map_mistake("no header = false", "header", lambda case: case.texts.update(wheels=lambda text: text.split("\n", 1)[1]))
map_mistake("decimal commas, semicolons", "delimiter|decimal", lambda case: case.texts.update(
    wheels=lambda text: text.replace(",", ";").replace(".", ",")))
map_mistake("first row garbage: counts 0", "jump|starts again|first|row", garbage("wheels", 0.0))
map_mistake("first row garbage: counts 10^6", "jump|starts again|first|row", garbage("wheels", 1e6))
map_mistake("first row garbage: reference at 100, 100", "jump|left out|first", garbage("reference", 100.0), on=REFERENCED)
# Steering.
map_mistake("steering in degrees, no unit", STEERING, steering_reads(math.degrees), on=("tricycle",))
map_mistake("unit = deg for a steering in radians", STEERING, unit("wheels", "front_steering_rad", "deg"), on=("tricycle",))
map_mistake("steering's counts read as radians", STEERING, lambda case: case.maps["wheels"]["columns"].update(
    front_steering_rad=case.maps["wheels"]["columns"].pop("front_steering_ticks")), on=("car",))
map_mistake("steering clockwise", STEERING, steering_reads(lambda reading: -reading), on=STEERED)
map_mistake("steering of a column geared 2 : 1, no scale", STEERING, steering_reads(lambda reading: 2 * reading), on=STEERED)
map_mistake("steering wheel's angle (15 : 1) for the road wheel's", STEERING, steering_reads(lambda reading: 15 * reading), on=STEERED)
map_mistake("steering from 0 to 360°, not to both sides", STEERING, lambda case: steering_reads(
    lambda reading: reading % steered(case).get("steering_ticks_per_revolution", 2 * math.pi))(case), on=STEERED)
map_mistake("columns of the steering and of a wheel swapped", STEERING, steering_swapped, on=STEERED)
map_mistake("a column for the steering that stays 0", STEERING, steering_reads(lambda reading: 0.0), on=STEERED)
map_mistake("steering 0.2 s late", r"steering_time_offset_s|the steering is read", steering_later, on=STEERED)
# The gyro.
map_mistake("gyro in deg/s, no unit", "deg/s", scaled("gyro", math.degrees(1), "yaw_rate_rad_s"))
map_mistake("unit = deg/s for a gyro in rad/s", "deg/s", unit("gyro", "yaw_rate_rad_s", "deg/s"))
map_mistake("gyro in mrad/s", "gyro", scaled("gyro", 1e3, "yaw_rate_rad_s"))
map_mistake("gyro in rpm", "gyro", scaled("gyro", 60 / (2 * math.pi), "yaw_rate_rad_s"))
map_mistake("another axis of the gyro", "gyro", scaled("gyro", 0.01, "yaw_rate_rad_s"))
map_mistake("the gyro's angle for its rate", "gyro", lambda case: [integrate(table) for table in case.each("gyro")])
# The reference.
for name, factor in (("mm", 1e3), ("cm", 1e2), ("inches", 1 / 0.0254), ("feet", 1 / 0.3048), ("km", 1e-3)):
    map_mistake(f"reference in {name}, no unit", "reference moves", scaled("reference", factor, "x_m", "y_m"), on=REFERENCED)
map_mistake("reference's heading in degrees, no unit", "deg", scaled("reference", math.degrees(1), "heading_rad"), on=REFERENCED)
map_mistake("unit = deg for a reference's heading in radians", "deg", unit("reference", "heading_rad", "deg"), on=REFERENCED)
map_mistake("reference's x and y swapped", r"x_m and y_m|sign = -1|mirror|left-handed", swapped("reference", "x_m", "y_m"), on=REFERENCED)
map_mistake("reference's y counted to the right", r"x_m and y_m|sign = -1|mirror|left-handed", lambda case: case.change("reference", "y_m", lambda y: -y), on=REFERENCED)
map_mistake("left-handed reference (y and heading)", r"mirror|left-handed|clockwise|sign = -1", mirrored, on=REFERENCED)
map_mistake("reference's heading clockwise", r"clockwise|sign = -1|heading", of_headings(lambda h: -h), on=REFERENCED)
map_mistake("reference's heading clockwise from north", r"clockwise|sign = -1|heading", compass, on=REFERENCED)
map_mistake("reference's heading from another axis (90°)", r"reference.heading|heading", of_headings(lambda h: h + math.pi / 2), on=REFERENCED)
map_mistake("reference's heading from another axis (5°)", r"reference.heading|heading", of_headings(lambda h: h + math.radians(5)), on=REFERENCED)
map_mistake("reference of a point 0.1 m ahead", r"reference.x|reference_sensor", reference_at(0.1, 0.0), on=REFERENCED)
map_mistake("reference of a point 0.1 m to the left", r"reference.y|reference_sensor", reference_at(0.0, 0.1), on=REFERENCED)
map_mistake("reference of the front axle's middle", r"reference.x|reference_sensor", reference_at(0.4, 0.0), on=STEERED)
# By tape.
TAPE = ("tape",)
map_mistake("distance_m in mm", "distance|reference", partial("straight", "distance_m", lambda d: d * 1e3), on=TAPE)
map_mistake("distance_m in cm", "distance|reference", partial("straight", "distance_m", lambda d: d * 1e2), on=TAPE)
map_mistake("distance_m in feet", "distance|reference", partial("straight", "distance_m", lambda d: d / 0.3048), on=TAPE)
map_mistake("turns in degrees", "turns", partial("turns", "turns", lambda t: t * 360), on=TAPE)
map_mistake("turns in radians", "turns", partial("turns", "turns", lambda t: t * 2 * math.pi), on=TAPE)
map_mistake("turns clockwise", "turns", partial("turns", "turns", lambda t: -t), on=TAPE)
map_mistake("turns one too few", "turns", partial("turns", "turns", lambda t: t - 1), on=TAPE)
map_mistake("end_x_m and end_y_m in cm", "end|reference", lambda case: [
    partial("square", key, lambda d: d * 1e2)(case) for key in ("end_x_m", "end_y_m")], on=TAPE)
map_mistake("end_y_m to the right", "end_y|mirror|pulls|chi|fit", partial("square", "end_y_m", lambda y: -y), on=TAPE)
map_mistake("closed = true of a run that does not close", "closed|pulls", lambda case: (
    case.partial["straight"].clear(), case.partial["straight"].update(closed=True)), on=TAPE)
# Sightings.
map_mistake("bearings in degrees, no unit", "deg", seeing(scaled("sightings", math.degrees(1), "bearing_rad")), on=SEEING)
map_mistake("bearings to the right", r"bearing|sign", seeing(scaled("sightings", -1, "bearing_rad")), on=SEEING)
map_mistake("ranges in mm", "range", seeing(scaled("sightings", 1e3, "range_m")), on=SEEING)
map_mistake("ranges in cm", "range", seeing(scaled("sightings", 1e2, "range_m")), on=SEEING)
map_mistake("ranges in feet", "range", seeing(scaled("sightings", 1 / 0.3048, "range_m")), on=SEEING)
map_mistake("range and bearing swapped", "range|bearing|valid", seeing(swapped("sightings", "range_m", "bearing_rad")), on=SEEING)
map_mistake("map in cm", "landmark|map|lost|range", seeing(lambda case: case.landmarks.update(
    x_m=[100 * x for x in case.landmarks["x_m"]], y_m=[100 * y for y in case.landmarks["y_m"]])), on=SEEING)
map_mistake("map with y to the right", "landmark|map|lost|bearing", seeing(lambda case: case.landmarks.update(
    y_m=[-y for y in case.landmarks["y_m"]])), on=SEEING)


def later_scaled(case, stream, factor):
    if stream in case.maps:
        case.change(stream, "time_s", lambda t: t * factor)


def rename_wheel_columns(case, ending):
    columns = case.maps["wheels"]["columns"]
    for column in wheel_columns(case):
        columns[column.removesuffix("_ticks") + ending] = columns.pop(column)


def integrate(table):
    angle, angles = 0.0, []
    for i, rate in enumerate(table["yaw_rate_rad_s"]):
        angle += rate * (table["time_s"][i] - table["time_s"][i - 1]) if i else 0.0
        angles.append(angle)
    table["yaw_rate_rad_s"] = angles


# ---- What came of it ----------------------------------------------------------------------------------------------


def counts_of(wheel, factor=1.0):
    """Counts of a wheel for a metre ahead, a metre to the left, a radian counter-clockwise."""
    direction = math.radians(wheel.get("direction_deg", 0.0))
    x, y = wheel.get("x_m", 0.0), wheel.get("y_m", 0.0)
    per_m = factor * wheel["ticks_per_revolution"] / (math.pi * wheel["diameter_m"])
    return [per_m * math.cos(direction), per_m * math.sin(direction), per_m * (x * math.sin(direction) - y * math.cos(direction))]


def counts_by_column(robot, columns):
    """The wheel whose counts a column of the log holds; what is read in other units is taken for those counts."""
    result = {}
    for wheel in robot["wheel"]:
        for key, source in columns.items():
            name, _, ending = key.rpartition("_")
            if name != wheel["name"] or wheel.get("passive"):
                continue
            factor = {"ticks": 1.0, "rad": 2 * math.pi / wheel["ticks_per_revolution"],
                      "m": math.pi * wheel["diameter_m"] / wheel["ticks_per_revolution"]}[ending]
            result[source if isinstance(source, str) else key] = counts_of(wheel, factor)
    return result


def radians_of(wheel, column):
    return 2 * math.pi / wheel.get("steering_ticks_per_revolution", 1) if column.endswith("_ticks") else 1.0


def steering_errors(case, robot):
    """Of a steered wheel: of the direction of its axle, in radians, where it points straight on and to both sides; of its
    place, as a share of the wheelbase; of its counts, and whether they count up or down."""
    true = next((wheel for wheel in case.truth["wheel"] if wheel.get("steered")), None)
    mine = next((wheel for wheel in robot["wheel"] if true and wheel["name"] == true["name"]), None)
    if mine is None:
        return []
    column = steering_column(case)
    source = case.maps["wheels"]["columns"][column]
    recorded = next(name for name in case.logs[case.subject]["wheels"] if "_steering_" in name)
    direction = math.radians(mine.get("direction_deg", 0.0))
    places = [complex(wheel.get("x_m", 0.0), wheel.get("y_m", 0.0)) for wheel in (mine, true)]
    side = math.copysign(1.0, places[0].real * places[1].real)  # steered the other way round behind the axle it turns the robot alike
    turned = []  # too far
    for angle in (-0.5, 0.0, 0.5):
        reading = (angle / true["steering_scale"] + math.radians(true["steering_zero_deg"])) / radians_of(true, recorded)
        for change in case.changes.get(recorded, []):
            reading = change(reading)
        reading *= radians_of(mine, column) * (math.radians(1) if isinstance(source, dict) else 1.0)
        scale, beside_zero = mine.get("steering_scale", 1.0), reading - math.radians(mine.get("steering_zero_deg", 0.0))
        if abs(abs(scale) - 1.0) < 0.1:  # on the steering's own axis 350° are -10°: docs/robot.md
            beside_zero = math.remainder(beside_zero, 2 * math.pi)
        steered_by = scale * beside_zero
        turned.append(side * (direction + (steered_by if mine.get("steered") else 0.0)) - angle)
    axle = max(abs(cmath.phase(cmath.rect(1, 2 * angle))) / 2 for angle in turned)
    errors = [(1.0 if source in wheel_columns(case) else axle, "steering"),
              (abs(side * places[0] - places[1]) / abs(places[1]), f"{true['name']}.x")]
    counts = counts_by_column(robot, case.maps["wheels"]["columns"]).get(f"{true['name']}_ticks")
    if counts:
        ahead = complex(*counts[:2]) * cmath.rect(1, turned[1] - direction)
        errors.append((abs(math.copysign(abs(ahead), ahead.real) / math.hypot(*counts_of(true)[:2]) - 1), "diameter"))
    return errors


def wrong_by(case, robot):
    """The largest error of a wheel's counts, the steering or the gyro's scale, as a share of the truth; and of what."""
    truth = {f"{wheel['name']}_ticks": counts_of(wheel) for wheel in case.truth["wheel"]
             if not wheel.get("passive") and not wheel.get("steered")}
    found = counts_by_column(robot, case.maps["wheels"]["columns"])
    errors = steering_errors(case, robot)
    for column, right in truth.items():
        mine = found.get(column)
        if mine is None:
            continue
        rolled, turned = math.hypot(*right[:2]), abs(right[2])
        errors.append((math.hypot(mine[0] - right[0], mine[1] - right[1]) / rolled, "diameter"))
        errors.append((abs(mine[2] - right[2]) / turned, "track"))
    if "gyro" in robot and "gyro" in case.truth and case.logs[case.subject].get("gyro"):
        said = case.maps["gyro"]["columns"]["yaw_rate_rad_s"]
        factor = math.radians(1) if isinstance(said, dict) else 1.0
        errors.append((abs(robot["gyro"].get("scale", 1.0) * factor * case.gyro_factor / case.truth["gyro"]["scale"] - 1), "gyro"))
    return max(errors)


def sigma_of(result, what):
    """The share that the calibration leaves open, 1 sigma, of what wrong_by() found; 0 of what it does not state."""
    document = read_json(result / "calibration.json")
    def largest(*kinds):
        shares = [(one["sigma_total"] or one["sigma_within"] or 0.0) / (1.0 if one["unit"] == "rad" else abs(one["value"]))
                  for one in (document or {}).get("parameters", [])
                  if {one["name"], one["name"].split(".")[-1]} & set(kinds) and (one["value"] or one["unit"] == "rad")]
        return max(shares, default=0.0)
    if what == "gyro":
        return largest("scale")
    if what == "steering":
        return math.hypot(largest("steering_zero"), 0.5 * largest("steering_scale"))  # at 0.5 rad to a side
    if what.endswith(".x"):
        return largest(what)
    # Counts for a radian follow from lever and diameter.
    return largest("diameter") if what == "diameter" else math.hypot(largest("track", "lever"), largest("diameter"))


def read_json(path):
    return json.loads(path.read_text()) if path.exists() else None


def map_error_m(case, path):
    """rms of the landmarks from the true ones, laid on them."""
    true = dict(zip(case.true_landmarks["landmark"], map(complex, case.true_landmarks["x_m"], case.true_landmarks["y_m"])))
    found = read_table(path)
    pairs = [(complex(x, y), true[name]) for name, x, y in zip(found["landmark"], found["x_m"], found["y_m"]) if name in true]
    if len(pairs) < 3:
        return math.inf
    a, b = (sum(side) / len(pairs) for side in zip(*pairs))
    turn = sum((one - a).conjugate() * (other - b) for one, other in pairs)
    turn = cmath.rect(1, cmath.phase(turn))
    return math.sqrt(sum(abs(turn * (one - a) - (other - b)) ** 2 for one, other in pairs) / len(pairs))


def sentences_of(done, record, folder):
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    for stage in (record or {}).get("stages", []):
        lines += [remark for remark in stage["remarks"]]
        if stage["status"] == "failed":
            lines.append(stage["message"])
    return [line.replace(str(folder) + "/", "") for line in lines]  # which is named after the mistake


def held_words(result):
    return (json.loads(path.read_text())["cannot_tell"] if (path := result / "calibration.json").exists() else [])


def short(sentence):
    sentence = re.sub(r"^(warning|note): ", "", sentence)
    return re.sub(r"^\S*/", "", sentence).replace("|", "/")


def judge(case, pattern, done, sentences, usual, result):
    """Verdict, sentence, error."""
    unknown = held_words(result)  # what they say names no mistake
    lines = [line for line in sentences if line not in usual and not any(words in line for words in unknown)
             and (pattern.search("time_offset") or "corrected: gyro.time_offset" not in line and "gyro's stamps" not in line)]
    if done.returncode not in (0, 3, 4):
        return "FAILED", " ".join(lines[:1]), ""
    sentence = next((line for line in lines if pattern.search(line) and not NO_CAUSE.search(line)), "")
    robot = result / "calibrated.toml"
    share = what = None
    if done.returncode == 0 and robot.exists():
        share, what = wrong_by(case, tomllib.loads(robot.read_text()))
    error = "" if share is None else f"{100 * share:.2g} % ({what})"
    right = share is None or share < RIGHT
    landmarks = result / "slam/landmarks.csv"
    if case.with_sightings and done.returncode == 0:
        off_m = map_error_m(case, landmarks) if landmarks.exists() else None
        error += "" if off_m is None else f"; map {off_m:.2g} m"
        right = right and (off_m is None or off_m < RIGHT_MAP_M)
    if sentence:
        return "named", short(sentence), error
    if done.returncode != 0 or share is None:
        return "refused", short(lines[0]) if lines else "", error
    if right:
        return "estimated away", "", error
    held = [words for words in held_words(result) if what in words or pattern.search(words)]
    if held:
        return "undetectable", held[0], error
    sigma = sigma_of(result, what)
    if share < 3 * sigma:
        return "uncertain", "", f"{error} of ± {100 * sigma:.2g} %"
    return "SILENT", "; ".join(map(short, lines)), error


def examine(program, base, name, row, root):
    """A line of the table."""
    file, words, make, pattern, _ = row
    case = copy.deepcopy(base)
    before = case.logs[case.subject].get("gyro", {}).get("yaw_rate_rad_s")
    case.true_landmarks = copy.deepcopy(case.landmarks)
    make(case)
    case.gyro_factor = 1.0
    if before:  # what one unit of the changed log is of the true one
        after = case.logs[case.subject]["gyro"]["yaw_rate_rad_s"]
        largest = max(range(len(before)), key=lambda i: abs(before[i]))
        case.gyro_factor = after[largest] / before[largest]
    folder = root / re.sub(r"\W+", "_", f"{name} {words}")
    runs, subject = case.write(folder)
    if case.with_sightings and case.landmarks:
        (subject / "landmarks.csv").write_text(csv_of(case.landmarks))
    result = folder / "out"
    done = subprocess.run([program, "run", subject, "--robot", folder / "robot.toml", "--calibrate-on", runs, "-o", result,
                           "--quiet"], capture_output=True, text=True)
    record = json.loads((result / "run.json").read_text()) if (result / "run.json").exists() else None
    sentences = sentences_of(done, record, folder)
    (folder / "said.txt").write_text(f"exit {done.returncode}\n" + "\n".join(sentences) + "\n")
    if case.usual is None:
        base.usual = set(sentences)
    verdict, sentence, error = judge(case, pattern, done, sentences, case.usual or set(), result)
    return [file, words, name, str(done.returncode), verdict, error, sentence]


HEAD = ["file", "mistake", "robot", "exit", "verdict", "error", "what is said"]


def table_of(rows):
    lines = [HEAD[1:6], ["---"] * 5] + [row[1:6] for row in rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def write_csv(path, rows):
    with open(path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([HEAD] + rows)


def put(path, text):
    page = path.read_text()
    head, rest = page.split(BEGIN)
    path.write_text(head + BEGIN + "\n\n" + text + "\n" + END + rest.split(END)[1])


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("program", type=lambda text: Path(text).resolve())
    options.add_argument("page", nargs="?", type=Path)
    options.add_argument("--only", default="", help="mistakes whose words match")
    options.add_argument("--keep", type=Path, help="leave what was written here")
    options.add_argument("--jobs", type=int, default=2)
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        root = asked.keep.resolve() if asked.keep else Path(scratch)
        everything_right = ("none", "no mistake", lambda case: None, re.compile(r"$^"), UNSTEERED + STEERED)
        cases_right = [(case, name, everything_right) for name, case in robots(asked.program, root)]
        jobs = [(case, name, row) for case, name, _ in cases_right for row in MISTAKES
                if name in row[4] and re.search(asked.only, row[1])]
        with concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
            def table(jobs):
                return list(pool.map(lambda job: examine(asked.program, *job, root), jobs))
            rows = table(cases_right) + table(jobs)
    order = {words: i for i, (_, words, *_) in enumerate([everything_right] + MISTAKES)}
    rows.sort(key=lambda row: order[row[1]])
    counts = {}
    for row in rows:
        counts[row[4]] = counts.get(row[4], 0) + 1
    text = ", ".join(f"{count} {verdict}" for verdict, count in sorted(counts.items()))
    harmless = ("named", "estimated away")
    text += f". All but {' and '.join(harmless)}:\n\n" + table_of([row for row in rows if row[4] not in harmless])
    print(text)
    if asked.page:
        put(asked.page, text)
        write_csv(asked.page.with_suffix(".csv"), rows)
    sys.exit(1 if {"SILENT", "FAILED"} & set(counts) else 0)


if __name__ == "__main__":
    main()
