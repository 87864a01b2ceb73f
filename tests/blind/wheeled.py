"""Robots on wheels, simulated from what docs/ says of their sensors: what `blind_odometry.py` drives.

In steps of 1 ms and with none of the program's own code: chassis of many kinds, how they drive, and what wheels, gyro, steering and a
reference say of it. The file says of the robot what `Robot.file` writes; what it is, `Robot.truth`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blind_slam import Array, Nees, normalised, rotated, wrapped, write

STEP_S = 1e-3
SKID = 0.02  # of skid wheels sideways [m/√m]
BIAS_SIGMA_RAD_S = 0.01
KINDS = ("differential", "skid", "pods", "omni3", "omni4", "mecanum", "car", "tricycle", "swerve")
HOLONOMIC = ("pods", "omni3", "omni4", "mecanum")
FRONT_STEERED = ("car", "tricycle")


@dataclass
class Wheel:
    """As in the robot file; angles [rad]."""

    name: str
    x: float
    y: float
    direction: float = 0.0
    kind: str = "fixed"
    roller: float = 0.0
    steered: bool = False
    encoder: bool = True

    def lever(self) -> float:
        """How far a turn rolls it [m/rad]: docs/theory/chassis.md, eq. 2 to 4."""
        c, s = math.cos(self.direction), math.sin(self.direction)
        return self.x * s - self.y * c + math.tan(self.roller) * (self.x * c + self.y * s)


def wheels_of(kind: str, half: float, base: float) -> list[Wheel]:
    """Half the track, or the radius, and the wheelbase [m]."""
    corners = [(name, x * base / 2, y * half) for name, x, y in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1))]
    front = Wheel("front", base, 0, steered=True, encoder=kind == "tricycle")
    sides = [Wheel("left", 0, half, kind="skid" if kind == "skid" else "fixed"), Wheel("right", 0, -half, kind="skid" if kind == "skid" else "fixed")]
    if kind == "pods":
        return [Wheel("forward", 0, half, kind="omni"), Wheel("sideways", -half, 0, math.pi / 2, "omni")]
    if kind.startswith("omni"):
        azimuths = 2 * math.pi * (np.arange(int(kind[-1])) + 0.5) / int(kind[-1])
        return [Wheel(f"w{i}", half * math.cos(a), half * math.sin(a), wrapped(a + math.pi / 2), "omni") for i, a in enumerate(azimuths)]
    if kind == "mecanum":
        return [Wheel(name, x, y, kind="mecanum", roller=math.radians(-45 if x * y > 0 else 45)) for name, x, y in corners]
    if kind == "swerve":
        return [Wheel(name, x, y, steered=True) for name, x, y in corners]
    return {"car": [*sides, front], "tricycle": [front, Wheel("rear", 0, 0, encoder=False)]}.get(kind, sides)


class Robot:
    """A chassis, its sensors and how it drives, drawn from what robots have; `truth` has what its file is `worn` by, by parameter."""

    def __init__(self, rng: np.random.Generator, kind: str, gyro: bool, worn: float = 0.0, axes_shown: bool = True, rates_hz: tuple[int, ...] = (10, 20, 50),
                 ticks: tuple[int, ...] = (360, 1000, 4096)) -> None:
        self.kind, self.gyro = kind, gyro or kind == "pods"
        self.half, self.base, self.diameter = rng.uniform(0.1, 0.25), rng.uniform(0.3, 0.6), rng.uniform(0.06, 0.2)
        self.wheels = wheels_of(kind, self.half, self.base)
        self.wheels_hz, self.gyro_hz = rng.choice(rates_hz), rng.choice([20, 50, 100, 200, 400])
        self.ticks = rng.choice(ticks)  # per revolution
        self.roll, self.slide = rng.choice([0.002, 0.005, 0.01]), rng.choice([0.0005, 0.001, 0.002])  # [m/√m]
        self.density, self.walk = rng.choice([1e-4, 3e-4, 1e-3]), rng.choice([3e-6, 1e-5])
        self.steering_sigma = math.radians(rng.choice([0.1, 0.5]))
        self.speed_m_s, self.whole_ms = rng.choice([0.15, 0.4, 0.8]), bool(rng.random() < 0.5)
        self.rest_s = 3.0 if worn else rng.choice([0.0, 2.0, 10.0])
        self.bias, self.bias_spread = (BIAS_SIGMA_RAD_S * rng.normal(), 0.003) if worn else (0.0, BIAS_SIGMA_RAD_S if self.rest_s else BIAS_SIGMA_RAD_S / 10)
        self.truth = {f"{wheel.name}.diameter": self.diameter * (1 + 0.02 * worn * rng.normal()) for wheel in self.wheels if wheel.encoder}
        self.truth["track"] = 2 * self.half * (1 + 0.04 * worn * rng.normal() * (kind in ("differential", "skid", "car")))
        self.truth["gyro.scale"] = 1 + 0.015 * worn * rng.normal()
        turned = math.radians(1.5) * worn * rng.normal(size=len(self.wheels))
        turned -= 0 if axes_shown else turned.mean()  # without headings nothing shows which way the robot's own axes point
        for wheel, turn in zip(self.wheels, turned):
            if kind in HOLONOMIC:
                self.truth[f"{wheel.name}.direction"], self.truth[f"{wheel.name}.lever"] = wheel.direction + turn, wheel.lever() + 0.01 * worn * rng.normal()
            if wheel.steered:
                self.truth[f"{wheel.name}.steering_zero"] = turn
        if kind in FRONT_STEERED:
            self.truth["front.x"], self.truth["front.steering_scale"] = self.base * (1 + 0.03 * worn * rng.normal()), 1 + 0.02 * worn * rng.normal()

    def row(self, wheel: Wheel, angle: Array | None = None) -> Array:
        """The true rolling row; of a steered wheel at each of the angles."""
        x, y = self.truth.get(f"{wheel.name}.x", wheel.x), wheel.y * self.truth["track"] / (2 * self.half)
        if angle is not None:
            return np.stack([np.cos(angle), np.sin(angle), x * np.sin(angle) - y * np.cos(angle)], -1)
        direction, free = self.truth.get(f"{wheel.name}.direction", wheel.direction), math.tan(wheel.roller)
        lever = self.truth.get(f"{wheel.name}.lever", Wheel("", x, y, direction, wheel.kind, wheel.roller).lever())
        return np.array([math.cos(direction) - free * math.sin(direction), math.sin(direction) + free * math.cos(direction), lever])

    def file(self, stated: float) -> str:
        """robot.toml, which claims `stated` of the noise."""
        lines = []
        for wheel in self.wheels:
            lines += ["[[wheel]]", f'name = "{wheel.name}"', f"x_m = {wheel.x:.12f}", f"y_m = {wheel.y:.12f}", f'kind = "{wheel.kind}"',
                      f"direction_deg = {math.degrees(wheel.direction):.9f}"]
            lines += [f"roller_deg = {math.degrees(wheel.roller):.9f}"] if wheel.roller else []
            lines += [f"diameter_m = {self.diameter:.12f}", f"ticks_per_revolution = {self.ticks}"] if wheel.encoder else ["passive = true"]
            lines += ["steered = true", f"steering_sigma_deg = {stated * math.degrees(self.steering_sigma)}"] if wheel.steered else []
        if self.gyro:
            lines += ["[gyro]", f"noise_rad_s_sqrt_hz = {stated * self.density}", f"bias_walk_rad_s_sqrt_s = {self.walk}",
                      f"bias_sigma_rad_s = {BIAS_SIGMA_RAD_S if self.rest_s else self.bias_spread}"]
        lines += ["[noise]", f"wheel_per_sqrt_m = {stated * self.roll}", f"lateral_per_sqrt_m = {stated * self.slide}", f"skid_per_sqrt_m = {stated * SKID}"]
        return "\n".join(lines) + "\n"


def smooth(values: Array, seconds: float) -> Array:
    """Means over so long before."""
    count = round(seconds / STEP_S)
    total = np.cumsum(np.concatenate([np.repeat(values[:1], count, 0), values]), 0)
    return np.asarray((total[count:] - total[:-count]) / count)


class Drive:
    """Where a robot was, in steps of 1 ms: straight, arcs, turns on the spot, sideways, backwards and rests as they come."""

    def __init__(self, robot: Robot, rng: np.random.Generator, seconds: float, speed_m_s: float | None = None, straight: bool = False) -> None:
        count, at = round(seconds / STEP_S), round(robot.rest_s / STEP_S)
        asked, bend, last = np.zeros((count, 3)), np.zeros(count), count - round(1.5 / STEP_S)  # velocities [m/s, m/s, rad/s], curvature [1/m]
        top = speed_m_s or robot.speed_m_s
        while at < last:
            until = min(last, at + round(rng.uniform(1, 4) / STEP_S))
            what = rng.choice(["straight", "arc", "spin", "rest", "back"], p=[0.25, 0.4, 0.15, 0.1, 0.1])
            speed, per_m = top * rng.uniform(0.5, 1.2) * (-1 if what == "back" else 1), rng.choice([-1, 1]) * rng.uniform(0.3, 2)
            course = rng.uniform(-math.pi, math.pi) if robot.kind in HOLONOMIC and rng.random() < 0.5 else 0.0
            bend[at:] = 0 if what == "straight" else 0.6 * per_m
            if what == "spin" and robot.kind not in FRONT_STEERED:
                asked[at:until, 2] = rng.choice([-1, 1]) * rng.uniform(0.5, 1.5) * max(0.3, top / 0.4)
            elif what != "rest":
                asked[at:until] = [speed * math.cos(course), speed * math.sin(course), 0 if what == "straight" else abs(speed) * per_m]
            at = until
        if straight:
            asked[:, 1:], bend[:] = 0, 0
        ramp_s = rng.choice([0.2, 0.5])
        steps, bend = smooth(smooth(asked, ramp_s), ramp_s / 2) * STEP_S, smooth(smooth(bend, 0.6), 0.3)
        self.angles: dict[str, Array] = {}

        def skids(travel: Array, k: float) -> Array:
            return np.asarray(k * np.sqrt(np.abs(travel)) * rng.normal(size=count))

        if robot.kind in FRONT_STEERED:  # the rear axle and the front wheel skid by themselves
            length, ahead = robot.truth["front.x"], steps[:, 0]
            angle = self.angles["front"] = np.arctan(bend * length)
            travel = ahead if robot.kind == "car" else ahead / np.cos(angle)
            rear, front = skids(travel, robot.slide), skids(travel, robot.slide)
            steps = np.stack([ahead, rear, ahead * bend + front / (length * np.cos(angle)) - rear / length], -1)
        elif robot.kind == "swerve":
            steps = self.swerve(robot, rng, seconds, top, skids)
        elif robot.kind not in HOLONOMIC:
            steps[:, 1] += skids(np.mean([np.abs(steps @ robot.row(wheel)) for wheel in robot.wheels], 0), SKID if robot.kind == "skid" else robot.slide)
        heading = np.concatenate([[0], np.cumsum(steps[:, 2])])
        moved = rotated(steps[:, :2], heading[:-1] + steps[:, 2] / 2)
        self.seconds, self.poses = seconds, np.column_stack([np.concatenate([np.zeros((1, 2)), np.cumsum(moved, 0)]), heading])
        self.travels = {w.name: (steps * robot.row(w, self.angles[w.name])).sum(1) if w.steered else steps @ robot.row(w) for w in robot.wheels if w.encoder}

    def swerve(self, robot: Robot, rng: np.random.Generator, seconds: float, top: float, skids: Callable[[Array, float], Array]) -> Array:
        """Steps of one whose modules stand along the way of their places; skids move it as docs/theory/simulation.md says, by N⁺ ε."""
        t = np.arange(round(seconds / STEP_S)) * STEP_S
        pace = np.clip(np.minimum.reduce([t - robot.rest_s, seconds - 1.5 - t, np.abs(t - seconds / 2) - 1]), 0, 1)
        course, turn = (sum(a * np.sin(2 * math.pi * (t / rng.uniform(5, 15) + rng.random())) for _ in range(2)) for a in (0.5, 0.7))
        shape = top * np.stack([np.cos(course), np.sin(course), turn], -1)
        rows = []
        for wheel in robot.wheels:
            angle = np.unwrap(np.arctan2(shape[:, 1] + wheel.x * shape[:, 2], shape[:, 0] - wheel.y * shape[:, 2]))
            self.angles[wheel.name] = angle
            rows.append(np.stack([-np.sin(angle), np.cos(angle), wheel.x * np.cos(angle) + wheel.y * np.sin(angle)], -1))
        lateral, along = np.stack(rows, 1), shape / np.linalg.norm(shape, axis=1, keepdims=True)
        steps = shape * pace[:, None] * STEP_S
        travel = np.mean([np.abs((steps * robot.row(wheel, self.angles[wheel.name])).sum(1)) for wheel in robot.wheels], 0)
        skid = np.einsum("nij,ni->nj", lateral, np.stack([skids(travel, robot.slide) for _ in rows], -1))
        normal = np.einsum("nij,nik->njk", lateral, lateral) + along[:, :, None] * along[:, None]
        return np.asarray(steps + np.linalg.solve(normal, skid[..., None])[..., 0])

    def at(self, time_s: Array) -> Array:
        """Poses."""
        return np.stack([np.interp(time_s / STEP_S, np.arange(len(self.poses)), column) for column in self.poses.T], -1)


@dataclass
class Reference:
    """A trajectory, or at 0 Hz an end pose; no headings where their sigma is 0; stamps are late."""

    hz: float
    sigma_m: float
    sigma_rad: float = 0.0
    late_s: float = 0.0


class Recording:
    """What sensors say of a drive; a wheel that slips rolls a share more than the ground below it."""

    def __init__(self, folder: Path, robot: Robot, drive: Drive, rng: np.random.Generator, reference: Reference | None = None, gyro_late_s: float = 0.0,
                 steering_late_s: float = 0.0, slip: tuple[str, float, float, float] = ("", 0, 0, 0)) -> None:
        self.folder, self.drive, self.excess_m = folder, drive, 0.0
        folder.mkdir(parents=True)
        ends = np.arange(len(drive.poses)) * STEP_S

        def times(hz: float) -> Array:
            return np.asarray(rng.uniform(0, 1 / hz) + np.arange(0, drive.seconds - 1.01 / hz, 1 / hz))

        def stamps(time_s: Array) -> Array:
            return np.round(time_s, 3) if robot.whole_ms else time_s

        self.read_s = times(robot.wheels_hz)
        self.stamps_s = stamps(self.read_s)
        columns = {"time_s": self.stamps_s}
        for wheel in robot.wheels:
            if wheel.encoder:
                travel = drive.travels[wheel.name].copy()
                slips = (ends[:-1] >= slip[1]) & (ends[:-1] < slip[2]) & (wheel.name == slip[0])
                self.excess_m += float(slip[3] * travel[slips].sum())
                travel[slips] *= 1 + slip[3]
                rolled = np.concatenate([[0], np.cumsum(travel + robot.roll * np.sqrt(np.abs(travel)) * rng.normal(size=len(travel)))])
                tick_m = math.pi * robot.truth[f"{wheel.name}.diameter"] / robot.ticks
                columns[f"{wheel.name}_ticks"] = np.floor(np.interp(self.read_s, ends, rolled) / tick_m + rng.random())
            if wheel.steered:
                angle = np.interp(self.read_s - steering_late_s, ends[:-1], drive.angles[wheel.name]) - wheel.direction
                zero, scale = robot.truth[f"{wheel.name}.steering_zero"], robot.truth.get(f"{wheel.name}.steering_scale", 1.0)
                columns[f"{wheel.name}_steering_rad"] = angle / scale + zero + robot.steering_sigma * rng.normal(size=len(angle))
        write(folder / "wheels.csv", columns)
        if robot.gyro:
            time = times(robot.gyro_hz)
            rates = np.diff(drive.at(time)[:, 2], prepend=drive.at(time[:1] - 1 / robot.gyro_hz)[0, 2]) * robot.gyro_hz / robot.truth["gyro.scale"]
            rates += robot.bias + robot.bias_spread * rng.normal() + np.cumsum(robot.walk / math.sqrt(robot.gyro_hz) * rng.normal(size=len(time)))
            rates += robot.density * math.sqrt(robot.gyro_hz) * rng.normal(size=len(time))
            write(folder / "gyro.csv", {"time_s": stamps(time + gyro_late_s), "yaw_rate_rad_s": rates})
        if reference and reference.hz:
            time, frame = times(reference.hz), rng.uniform(-3, 3, size=3)
            poses = drive.at(time)
            places = frame[:2] + rotated(poses[:, :2], frame[2]) + reference.sigma_m * rng.normal(size=(len(time), 2))
            columns = {"time_s": stamps(time + reference.late_s), "x_m": places[:, 0], "y_m": places[:, 1]}
            if reference.sigma_rad:
                columns["heading_rad"] = poses[:, 2] + frame[2] + reference.sigma_rad * rng.normal(size=len(time))
            write(folder / "reference.csv", columns)
            (folder / "recording.toml").write_text(f"[reference]\nposition_sigma_m = {reference.sigma_m}\nheading_sigma_rad = {reference.sigma_rad or 1}\n")
        elif reference:
            x, y, heading = self.truth(self.stamps_s[-1]) + rng.normal(size=3) * [reference.sigma_m, reference.sigma_m, reference.sigma_rad]
            (folder / "recording.toml").write_text(f"[reference]\nend_x_m = {x}\nend_y_m = {y}\n"
                                                   f"end_x_m_sigma = {reference.sigma_m}\nend_y_m_sigma = {reference.sigma_m}\n"
                                                   f"turns = {heading / 2 / math.pi}\nturns_sigma = {reference.sigma_rad / 2 / math.pi}\n")

    def truth(self, stamp_s: float) -> Array:
        """The pose at the row with that stamp, in the frame of the first row."""
        first, pose = self.drive.at(self.read_s[[0, int(np.argmin(np.abs(self.stamps_s - stamp_s)))]])
        return np.append(rotated(pose[:2] - first[:2], -first[2]), pose[2] - first[2])

    def error(self, row: dict[str, str]) -> tuple[Array, Array]:
        """Log(truth⁻¹ estimate) of a row of a trajectory, and its stated covariance in the estimate's axes."""
        values = {name: float(value) for name, value in row.items()}
        true, heading = self.truth(values["time_s"]), values["heading_rad"]
        turn, place = wrapped(heading - true[2]), rotated(np.array([values["x_m"], values["y_m"]]) - true[:2], -true[2])
        scale = turn / 2 / math.tan(turn / 2) if turn else 1.0
        covariance = np.array([values[f"var_{axes}"] for axes in ("xx", "xy", "xh", "yy", "yh", "hh")])[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
        c, s = math.cos(heading), math.sin(heading)
        turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return np.array([scale * place[0] + turn / 2 * place[1], scale * place[1] - turn / 2 * place[0], turn]), turned.T @ covariance @ turned

    def nees(self, row: dict[str, str]) -> Nees:
        return normalised(*self.error(row))
