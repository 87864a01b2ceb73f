"""Random robots and recordings of them, sound and faulty: what tools/mutation_campaign.py runs commands on."""
import math

KINDS = ("differential", "differential", "skid", "omni3", "mecanum", "pods", "velocity", "anything")


def wheels_of(kind, rng):
    """Rows of [[wheel]]: x, y, direction and kind of each."""
    side, length = rng.uniform(0.05, 0.4), rng.uniform(0.05, 0.4)
    if kind in ("differential", "skid"):
        what = "fixed" if kind == "differential" else "skid"
        return [(0, side, 0, what), (0, -side, 0, what)]
    if kind == "omni3":
        return [(side * math.cos(math.radians(a)), side * math.sin(math.radians(a)), (a + 90 + 180) % 360 - 180, "omni")
                for a in (60, 180, -60)]
    if kind == "mecanum":
        return [(x, y, 0, "mecanum") for x in (length, -length) for y in (side, -side)]
    if kind == "pods":
        return [(0, side, 0, "omni"), (0, -side, 0, "omni"), (-length, 0, 90, "omni")]
    if kind == "velocity":
        return []
    return [(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-180, 180), rng.choice(("fixed", "omni", "skid")))
            for _ in range(rng.randint(1, 8))]


class Robot:
    def __init__(self, rng):
        self.kind = rng.choice(KINDS)
        self.wheels = wheels_of(self.kind, rng)
        self.diameter = rng.choice((0.05, 0.1, 0.3))
        self.ticks = rng.choice((0, 12, 360, 4096, -1024))
        self.bits = rng.choice((0, 0, 16, 8))
        self.gyro = rng.random() < 0.6
        self.sensor = rng.random() < 0.7
        self.offset = rng.choice((0.0, 0.0, 0.3))

    def toml(self, rng):
        lines = []
        for i, (x, y, direction, kind) in enumerate(self.wheels):
            lines += ["[[wheel]]", f'name = "w{i}"', f"x_m = {x:.4f}", f"y_m = {y:.4f}", f"direction_deg = {direction:.3f}",
                      f'kind = "{kind}"', f"diameter_m = {self.diameter * rng.choice((1, 1, 1.03))}"]
            if kind == "mecanum":
                lines.append(f"roller_deg = {-45 if x * y > 0 else 45}")
            if self.ticks:
                lines += [f"ticks_per_revolution = {self.ticks}", f"tick_bits = {self.bits}"]
        if self.gyro:
            lines += ["[gyro]", f"scale = {rng.choice((1, 1, -1))}"]
        if self.sensor:
            lines += ["[landmark_sensor]", f"range_sigma_m = {rng.choice((0.001, 0.05, 3))}",
                      f"time_offset_s = {rng.choice((0, 0, 0.2))}"]
        if rng.random() < 0.5:
            lines += ["[noise]", f"wheel_per_sqrt_m = {rng.choice((0, 1e-4, 0.01, 1))}",
                      f"lateral_per_sqrt_m = {rng.choice((0, 1e-3, 1))}"]
        if rng.random() < 0.3:
            lines += ["[reference_sensor]", f"x_m = {self.offset}"]
        return "\n".join(lines) + "\n"


def drive(rng):
    """Poses along a random drive: time, x, y, heading, and the twist that leads to each."""
    step = rng.choice((0.01, 0.05, 0.1))
    time, x, y, heading = rng.choice((0.0, 0.0, 1.7e9, -5.0)), 0.0, 0.0, 0.0
    forward = turn = 0.0
    for k in range(rng.choice((1, 2, 3, 30, 120, 120))):
        if k % 15 == 0:
            forward, turn = rng.choice(((0.0, 0.0), (0.5, 0.0), (0.3, 0.7), (0.0, -1.5), (-0.4, 0.2)))
        yield time, x, y, heading, (forward * step, turn * step)
        time, heading = time + step, heading + turn * step
        x, y = x + forward * step * math.cos(heading), y + forward * step * math.sin(heading)


def wheel_rows(robot, poses, rng):
    unit = rng.choice(("ticks", "ticks", "rad", "m", "rad_s")) if robot.ticks else rng.choice(("rad", "m", "rad_s"))
    sums = [0.0] * len(robot.wheels)
    rows = []
    for k, (time, *_, (forward, turn)) in enumerate(poses):
        cells = []
        for i, (x, y, direction, kind) in enumerate(robot.wheels):
            c, s = math.cos(math.radians(direction)), math.sin(math.radians(direction))
            roll = c * (forward - turn * y) + s * turn * x
            if kind == "mecanum":
                roll = forward - turn * (y + math.copysign(x, x * y) * (1 if y > 0 else -1))
            sums[i] += roll
            angle = 2 * sums[i] / robot.diameter
            ticks = round(angle / (2 * math.pi) * (robot.ticks or 1))
            cells.append({"ticks": ticks % (1 << robot.bits) if robot.bits else ticks, "rad": angle, "m": sums[i],
                          "rad_s": 2 * roll / robot.diameter / 0.05 if k else 0.0}[unit])
        rows.append([time, *cells])
    return ["time_s", *(f"w{i}_{unit}" for i in range(len(robot.wheels)))], rows


def sighting_rows(poses, landmarks, named):
    rows = []
    for time, x, y, heading, _ in poses[::5]:
        for i, (lx, ly) in enumerate(landmarks):
            if (distance := math.hypot(lx - x, ly - y)) < 5:
                rows.append([time, f"l{i}" if named else "", distance, math.atan2(ly - y, lx - x) - heading])
    return ["time_s", "landmark", "range_m", "bearing_rad"], rows


def streams(robot, rng):
    """Name -> header and rows of each file of a recording."""
    poses = list(drive(rng))
    noisy = lambda value, sigma: value + rng.gauss(0, sigma)
    result = {}
    if robot.wheels:
        result["wheels.csv"] = wheel_rows(robot, poses, rng)
    else:
        result["velocity.csv"] = (["time_s", "forward_m_s", "yaw_rate_rad_s"],
                                  [[p[0], p[4][0] / 0.05, p[4][1] / 0.05] for p in poses])
    if rng.random() < 0.7:
        result["gyro.csv"] = (["time_s", "yaw_rate_rad_s"], [[p[0], noisy(p[4][1] / 0.05 + 0.01, 0.002)] for p in poses])
    if rng.random() < 0.7:
        kept = rng.choice((3, 4, 4))
        result["reference.csv"] = (["time_s", "x_m", "y_m", "heading_rad"][:kept],
                                   [[p[0], noisy(p[1], 0.001), noisy(p[2], 0.001), p[3]][:kept] for p in poses[::2]])
    if rng.random() < 0.2:
        result["relative.csv"] = (["start_s", "end_s", "dx_m", "dy_m", "dheading_rad"],
                                  [[p[0], q[0], 0.02, 0.0, q[3] - p[3]] for p, q in zip(poses[::3], poses[3::3])])
    landmarks = [(rng.uniform(-4, 4), rng.uniform(-4, 4)) for _ in range(rng.choice((1, 3, 8)))]
    if rng.random() < 0.7:
        result["sightings.csv"] = sighting_rows(poses, landmarks, rng.random() < 0.7)
    if rng.random() < 0.6:
        result["landmarks.csv"] = (["landmark", "x_m", "y_m"], [[f"l{i}", *place] for i, place in enumerate(landmarks)])
    return result


def number_in_column(head, rng):
    return rng.choice([i for i, name in enumerate(head) if name != "landmark"])


def damage(head, rows, rng):
    """A fault as sensors and loggers have them."""
    column = number_in_column(head, rng)
    some = range(0, len(rows), rng.choice((1, 1, 2, 7, 50)))
    fault = rng.choice(("scale", "empty", "constant", "value", "jump", "swap", "gap", "repeat", "cut", "noise", "reset"))
    if fault == "gap" and len(rows) > 4:
        at = rng.randrange(len(rows))
        del rows[at:at + rng.choice((2, 20, 100))]
    elif fault == "cut":
        del rows[rng.choice((0, 1, 2, 10)):]
    elif fault == "swap" and len(rows) > 1:
        at = rng.randrange(len(rows) - 1)
        rows[at], rows[at + 1] = rows[at + 1], rows[at]
    else:
        value = rng.choice((0, -1, 1e9, 1e12, 1e300, 1e-300, "nan", "inf", 65535, 8.8))
        scale, start = rng.choice((1000, 57.3, -1, 1e-3, 1e6, 1e-12)), rng.randrange(len(rows) + 1)
        for k in some:
            cell = rows[k][column]
            number = cell if isinstance(cell, (int, float)) else 0.0
            rows[k][column] = {"scale": number * scale, "empty": "", "constant": rows[0][column], "value": value,
                               "jump": number + (1e6 if k >= start else 0), "repeat": rows[k - 1][column],
                               "noise": rng.gauss(0, 1), "reset": number if k < start else 0.0}.get(fault, cell)


def text_of(head, rows):
    cells = lambda row: ",".join(f"{cell:.13g}" if isinstance(cell, float) else str(cell) for cell in row)
    return "".join(line + "\n" for line in (",".join(head), *map(cells, rows)))


def write(folder, rng):
    """robot.toml, two recordings `run` and `other`, map.csv and truth.csv."""
    robot = Robot(rng)
    (folder / "robot.toml").write_text(robot.toml(rng))
    for name in ("run", "other"):
        (folder / name).mkdir()
        files = streams(robot, rng)
        for _ in range(rng.choice((0, 1, 1, 2, 3))):
            damage(*rng.choice(list(files.values())), rng)
        for file, table in files.items():
            (folder / name / file).write_text(text_of(*table))
        for source, copy in (("landmarks.csv", "map.csv"), ("reference.csv", "truth.csv")):
            if source in files:
                (folder / copy).write_text(text_of(*files[source]))
