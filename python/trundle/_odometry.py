"""Where wheels and gyro say that it drove, where they slipped, and how wrong that is."""

from __future__ import annotations

from typing import Any, Optional, Union

from . import _trundle
from ._given import Path, Runs, Start, many, recording_of, robot_of
from ._trundle import Evaluation, Odometry, Recording, Robot, Slip, Trajectory


def odometry(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    *,
    start: Optional[Start] = None,
    smooth: bool = False,
) -> Odometry:
    """Integrates wheels and gyro to a trajectory with covariance.

    `recording`, `robot`: what drove. `start`: the pose at the first stamp. `smooth`: every pose also by what
    later rests show of the gyro's bias. docs/odometry.md.

    >>> import trundle
    >>> found = trundle.odometry("data/demo/session_03/tour", "data/demo/robot.toml", start=(1, 2, 90))
    >>> found.trajectory.x_m[0], found.trajectory.covariance.shape
    (1.0, (1775, 3, 3))
    """
    return _trundle.odometry(recording_of(recording), robot_of(robot), start=start, smooth=smooth)


def slip(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    *,
    learn: Runs = (),
    probability: float = 0.01,
    method: str = "general",
    interval_s: float = 0.25,
    spin_odds: float = 10.0,
) -> Slip:
    """Finds where wheels slip, and corrects the odometry for it.

    `recording`, `robot`: what drove. `learn`: recordings without slip, to measure the noise on.
    `probability`: that an interval without slip is flagged. `method`: 'general', for any chassis, or
    'published', for two wheels and a gyro: the wheel that is off spins. `interval_s`: readings are judged over
    at least this long. `spin_odds`: how much likelier a driven wheel that slips while it pushes spins than
    skids. docs/slip.md.

    >>> import trundle
    >>> robot = trundle.calibrate("data/demo/slip", "data/demo/robot.toml").robot
    >>> for event in trundle.slip("data/demo/slip", robot).events:
    ...     print(f"{event.start_s:.1f} s: {event.wheel}, {event.kind}")
    20.1 s: left, spin
    40.1 s: ambiguous, unknown
    55.1 s: ambiguous, unknown
    """
    return _trundle.slip(
        recording_of(recording),
        robot_of(robot),
        learn=many(learn),
        probability=probability,
        method=method,
        interval_s=interval_s,
        spin_odds=spin_odds,
    )


def evaluate(
    estimate: Any,
    reference: Union[Path, Recording, Trajectory],
    *,
    align: str = "start",
    longest_gap_s: float = 0.5,
    robot: Union[Path, Robot, None] = None,
    time_offset_s: Optional[float] = None,
) -> Evaluation:
    """How far an estimated trajectory is from a reference.

    `estimate`: a trajectory, a result that has one, or a file. `reference`: a recording that has one, a
    trajectory, or the path of either. `align`: 'none', 'start' (first common poses laid on each other) or 'se2'
    (least squares over all positions). `longest_gap_s`: the estimate is not interpolated across longer ones.
    `robot`: says where the reference was measured on it. `time_offset_s`: added to the reference's stamps,
    instead of what the motion shows where they are off; 0: they stay as they are. docs/evaluation.md.

    >>> import trundle
    >>> tour = trundle.Recording("data/demo/session_03/tour")
    >>> found = trundle.evaluate(trundle.odometry(tour, "data/demo/robot.toml"), tour)
    >>> print(f"{found.position_m.rms:.4f} m")
    0.1304 m
    """
    return _trundle.evaluate(
        getattr(estimate, "trajectory", estimate),
        reference,
        align=align,
        longest_gap_s=longest_gap_s,
        robot=None if robot is None else robot_of(robot),
        time_offset_s=time_offset_s,
    )
