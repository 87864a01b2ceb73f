"""Wheels calibrated, slip found, trajectories and maps with honest covariances: from a robot's own recordings.

Every function does what the command of its name does, with the same numbers to the last bit, and returns an
object with named fields. Their arrays are NumPy views of the result's memory. Where a recording or a robot is
asked for, its path will do.

>>> import trundle
>>> found = trundle.odometry("data/demo/session_03/tour", "data/demo/robot.toml")
>>> len(found.trajectory), f"{found.path_length_m:.2f} m"
(1775, '41.08 m')

Wrong input raises ValueError with the line that the program would end with, and data that cannot answer
raise CannotAnswer.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Callable, Optional, Union

from . import _trundle
from ._trundle import (
    Calibration,
    CannotAnswer,
    Drafts,
    ErrorBeforeAfter,
    ErrorStatistics,
    Estimate,
    Evaluation,
    Finding,
    IncrementalSmoother,
    InstallAngle,
    JointSlam,
    KnownStretch,
    Localization,
    Merge,
    Nees,
    Odometer,
    Odometry,
    ParameterEstimate,
    Pose,
    PositionError,
    Recording,
    RelativePoseError,
    Report,
    Robot,
    Run,
    SightingReport,
    Slam,
    SlamCounts,
    Slip,
    SlipEvent,
    Stage,
    Step,
    Trajectory,
    __version__,
)

Path = Union[str, "os.PathLike[str]"]
Start = tuple[float, float, float]  # x and y [m], heading [degrees]
Runs = Union[Path, Recording, Iterable[Union[Path, Recording]]]

__all__ = [
    "Calibration",
    "CannotAnswer",
    "Drafts",
    "ErrorBeforeAfter",
    "ErrorStatistics",
    "Estimate",
    "Evaluation",
    "Finding",
    "IncrementalSmoother",
    "InstallAngle",
    "JointSlam",
    "KnownStretch",
    "Localization",
    "Merge",
    "Nees",
    "Odometer",
    "Odometry",
    "ParameterEstimate",
    "Pose",
    "PositionError",
    "Recording",
    "RelativePoseError",
    "Report",
    "Robot",
    "Run",
    "SightingReport",
    "Slam",
    "SlamCounts",
    "Slip",
    "SlipEvent",
    "Stage",
    "Step",
    "Trajectory",
    "__version__",
    "calibrate",
    "evaluate",
    "init",
    "install_angle",
    "localize",
    "merge",
    "odometry",
    "report",
    "run",
    "simulate",
    "slam",
    "slam_together",
    "slip",
    "smooth",
    "steps",
    "umbmark",
]


def _recording(given: Union[Path, Recording]) -> Recording:
    return given if isinstance(given, Recording) else Recording(given)


def _robot(given: Union[Path, Robot]) -> Robot:
    return given if isinstance(given, Robot) else Robot(given)


def _many(given: Any) -> list[Any]:
    """One, or several of them."""
    one = (str, os.PathLike, Recording, Robot, Slam, JointSlam)
    return [given] if isinstance(given, one) else list(given)


def _text(path: Optional[Path]) -> str:
    """As the program takes it: empty where there is none."""
    return "" if path is None else os.fspath(path)


@contextmanager
def _paths() -> Iterator[Callable[[Any], list[str]]]:
    """The paths of what is given, one or several: an object that no file gives is written into a folder of its own."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="trundle-") as folder:
        written = 0

        def path(given: Any) -> str:
            nonlocal written
            if not isinstance(given, (Recording, Robot, Slam, JointSlam)):
                return os.fspath(given)
            if isinstance(given, Recording) and given.path:
                return given.path
            written += 1
            name = given.name if isinstance(given, Recording) else given.path if isinstance(given, Robot) else "map"
            place = os.path.join(folder, str(written), os.path.basename(os.path.normpath(name)))
            given.save(place)
            return place

        yield lambda given: [] if given is None else [path(one) for one in _many(given)]


def calibrate(
    runs: Runs,
    robot: Union[Path, Robot],
    *,
    hold_out: Runs = (),
    free: Sequence[str] = (),
    fix: Sequence[str] = (),
    learn_noise: bool = False,
    landmarks: bool = False,
) -> Calibration:
    """Calibrates a robot from recordings with references, or `landmarks`: from what it saw of them.

    `runs` and `hold_out`: recordings, or folders of them; the latter are only evaluated. `robot`: as it is
    before. `free`, `fix`: names of parameters to estimate besides the usual ones, or to leave as they are.
    `learn_noise`: also the noise of wheels, sideways motion and gyro. docs/calibration.md.

    >>> import trundle
    >>> found = trundle.calibrate("data/demo/session_01", "data/demo/robot.toml",
    ...                           hold_out="data/demo/session_03/tour")
    >>> print(f"{found['left.diameter'].value:.4f} m")
    0.1007 m
    >>> better = trundle.odometry("data/demo/session_03/tour", found.robot)
    """
    return _trundle.calibrate(
        _many(runs),
        _robot(robot),
        hold_out=_many(hold_out),
        free=list(free),
        fix=list(fix),
        learn_noise=learn_noise,
        landmarks=landmarks,
    )


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
    return _trundle.odometry(_recording(recording), _robot(robot), start=start, smooth=smooth)


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
        _recording(recording),
        _robot(robot),
        learn=_many(learn),
        probability=probability,
        method=method,
        interval_s=interval_s,
        spin_odds=spin_odds,
    )


def slam(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    *,
    filter: str = "smoother",
    particles: int = 100,
    seed: int = 1,
    start: Optional[Start] = None,
    smooth: bool = False,
    smoother_runs: int = 5,
    unknown_ids: bool = False,
    estimate: Optional[str] = None,
    systematic_sigma: Optional[float] = None,
    swarm_iterations: int = 5,
    swarm_agreement: float = 0.0,
    window: Optional[float] = None,
    correct_slip: bool = False,
    learn: Runs = (),
    spin_odds: float = 10.0,
    threads: int = 1,
    checkpoint: Optional[Path] = None,
    checkpoint_every_s: Optional[float] = None,
    resume: Optional[Path] = None,
) -> Slam:
    """Estimates the trajectory and a map of landmarks from odometry and sightings.

    `recording`: with sightings. `robot`: with a landmark sensor. `filter`: 'fastslam1', 'fastslam2', 'mapso',
    'mapso_proposal', 'ekf' or 'smoother'. `start`: the pose at the first stamp. `smooth`: then also the most
    probable trajectory and map of all that was seen. `window`: of the smoother, poses that are older [s] are
    marginalised, so that memory and the time of a step stay bounded. docs/slam.md.

    `checkpoint`: a file to store the run in, near the end of the recording and, with `checkpoint_every_s`,
    whenever so much of its time has passed. `resume`: such a file, to go on from.

    Landmarks: `unknown_ids` forgets their names, and finds out which is which; the smoother then starts from
    `smoother_runs` runs of a filter, and the most probable result is kept.

    Particle filters: `particles`, how many; `seed` of their random numbers; `threads`, on which results do not
    depend; `estimate`, the pose: 'mean' or the 'best' particle's, which is the default of mapso. The swarm of
    mapso: `swarm_iterations`, its rounds in a step; it stops earlier once the mean of exp(-d²/2) over particles
    and sightings is above `swarm_agreement`, with 0 never.

    Odometry: `systematic_sigma`, then its systematic errors are estimated, with this prior (share of travel,
    share of turns, turn per metre); `correct_slip` finds the slips first, and goes on from what is corrected
    for them, with `learn` and `spin_odds` as `slip` has them.

    >>> import trundle
    >>> found = trundle.slam("data/demo/session_03/tour", "data/demo/robot.toml", filter="ekf")
    >>> found.positions.shape == (len(found.landmarks), 2)
    True
    """
    return _trundle.slam(
        [_recording(recording)],
        [_robot(robot)],
        filter=filter,
        particles=particles,
        seed=seed,
        start=start,
        smooth=smooth,
        smoother_runs=smoother_runs,
        unknown_ids=unknown_ids,
        estimate=estimate,
        systematic_sigma=systematic_sigma,
        swarm_iterations=swarm_iterations,
        swarm_agreement=swarm_agreement,
        window=window,
        correct_slip=correct_slip,
        learn=_many(learn),
        spin_odds=spin_odds,
        threads=threads,
        checkpoint=_text(checkpoint),
        checkpoint_every_s=checkpoint_every_s,
        resume=_text(resume),
    )


def smooth(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    *,
    filter: str = "smoother",
    particles: int = 100,
    seed: int = 1,
    start: Optional[Start] = None,
    smoother_runs: int = 5,
    unknown_ids: bool = False,
    estimate: Optional[str] = None,
    systematic_sigma: Optional[float] = None,
    swarm_iterations: int = 5,
    swarm_agreement: float = 0.0,
    window: Optional[float] = None,
    correct_slip: bool = False,
    learn: Runs = (),
    spin_odds: float = 10.0,
    threads: int = 1,
    checkpoint: Optional[Path] = None,
    checkpoint_every_s: Optional[float] = None,
    resume: Optional[Path] = None,
) -> Slam:
    """The most probable trajectory and map of a whole recording: `slam` with smooth=True, and its other options.

    >>> import trundle
    >>> found = trundle.smooth("data/demo/session_03/tour", "data/demo/robot.toml")
    >>> len(found.trajectory) == len(found.online)
    True
    """
    return slam(**locals(), smooth=True)  # whose parameters are these


def slam_together(
    recordings: Iterable[Union[Path, Recording]],
    robot: Union[Path, Robot, Iterable[Union[Path, Robot]], None] = None,
    *,
    filter: str = "smoother",
    particles: int = 100,
    seed: int = 1,
    start: Optional[Start] = None,
    smoother_runs: int = 5,
    unknown_ids: bool = False,
    estimate: Optional[str] = None,
    systematic_sigma: Optional[float] = None,
    swarm_iterations: int = 5,
    swarm_agreement: float = 0.0,
    correct_slip: bool = False,
    learn: Runs = (),
    spin_odds: float = 10.0,
    threads: int = 1,
    marker_sigma: float = 0.0,
) -> JointSlam:
    """The most probable trajectories of several robots in one world, and the one map of them all.

    `recordings`: one for each robot, all by one clock. `robot`: one for all, or one for each; without it,
    robot.toml in the folder of each recording. `marker_sigma`: 1 sigma of where on its marker a robot is seen
    by others, beside the sensor's noise [m]. `start`: of the first robot, whose frame the result is in.
    docs/together.md.

    Each robot alone is estimated first, as `slam` does it: `filter`, `particles`, `seed`, `smoother_runs`,
    `unknown_ids`, `estimate`, `systematic_sigma`, `swarm_iterations`, `swarm_agreement`, `correct_slip`,
    `learn`, `spin_odds` and `threads` are its options.

    >>> import trundle
    >>> tours = ["data/demo/session_02/tour", "data/demo/session_03/tour"]
    >>> found = trundle.slam_together(tours, "data/demo/robot.toml")
    >>> list(found.trajectories), found.positions.shape == (len(found.landmarks), 2)
    (['tour', 'tour_2'], True)
    """
    given = [_recording(recording) for recording in recordings]
    robots = [os.path.join(one.path, "robot.toml") for one in given] if robot is None else _many(robot)
    return _trundle.slam_together(
        given,
        [_robot(one) for one in robots],
        filter=filter,
        particles=particles,
        seed=seed,
        start=start,
        smoother_runs=smoother_runs,
        unknown_ids=unknown_ids,
        estimate=estimate,
        systematic_sigma=systematic_sigma,
        swarm_iterations=swarm_iterations,
        swarm_agreement=swarm_agreement,
        correct_slip=correct_slip,
        learn=_many(learn),
        spin_odds=spin_odds,
        threads=threads,
        marker_sigma=marker_sigma,
    )


def merge(maps: Iterable[Union[Path, Slam, JointSlam]], *, unknown_ids: bool = False) -> Merge:
    """Merges maps of several robots or runs into one, in the frame of the first.

    `maps`: folders with landmarks.csv, such files, or what `slam` and `slam_together` found, which is written
    to a file first, whose path is what the result names. `unknown_ids` forgets the landmarks' names: which is
    which follows from how they lie. docs/together.md.

    >>> import trundle
    >>> a, b = (trundle.slam(f"data/demo/session_0{i}/tour", "data/demo/robot.toml") for i in (2, 3))
    >>> found = trundle.merge([a, b])
    >>> found.frames[0], len(found.landmarks)
    (Pose(x_m=0, y_m=0, heading_rad=0), 13)
    """
    with _paths() as paths:
        return _trundle.merge(paths(maps), unknown_ids=unknown_ids)


def localize(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    map: Union[Path, Slam],
    *,
    start: Optional[Start] = None,
    start_sigma_m: float = 0.5,
    start_sigma_deg: float = 10.0,
    filter: str = "particles",
    particles: int = _trundle.DEFAULT_LOCALIZATION_PARTICLES,
    seed: int = 1,
    unknown_ids: bool = False,
    correct_slip: bool = False,
    learn: Runs = (),
    spin_odds: float = 10.0,
) -> Localization:
    """Finds and follows the robot on a known `map`: landmarks.csv, or what `slam` found.

    `recording`: with sightings. `robot`: with a landmark sensor. `start`: the pose at the first stamp, known to
    `start_sigma_m` and `start_sigma_deg`; without it the pose is searched. `filter`: 'ekf' or 'particles', at
    most `particles` of them; `seed` of their random numbers. `unknown_ids` forgets the landmarks' names, and
    finds out which is which. `correct_slip` finds the slips first, and goes on from the odometry corrected for
    them, with `learn` and `spin_odds` as `slip` has them. docs/localization.md.

    >>> import trundle
    >>> map = trundle.smooth("data/demo/session_02/tour", "data/demo/robot.toml")
    >>> found = trundle.localize("data/demo/session_03/tour", "data/demo/robot.toml", map)
    >>> found.known[0].loss_noticed_s is None
    True
    """
    return _trundle.localize(
        _recording(recording),
        _robot(robot),
        map,
        start=start,
        start_sigma_m=start_sigma_m,
        start_sigma_deg=start_sigma_deg,
        filter=filter,
        particles=particles,
        seed=seed,
        unknown_ids=unknown_ids,
        correct_slip=correct_slip,
        learn=_many(learn),
        spin_odds=spin_odds,
    )


def evaluate(
    estimate: Any,
    reference: Union[Path, Recording, Trajectory],
    *,
    align: str = "start",
    longest_gap_s: float = 0.5,
    robot: Union[Path, Robot, None] = None,
) -> Evaluation:
    """How far an estimated trajectory is from a reference.

    `estimate`: a trajectory, a result that has one, or a file. `reference`: a recording that has one, a
    trajectory, or the path of either. `align`: 'none', 'start' (first common poses laid on each other) or 'se2'
    (least squares over all positions). `longest_gap_s`: the estimate is not interpolated across longer ones.
    `robot`: says where the reference was measured on it. docs/evaluation.md.

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
        robot=None if robot is None else _robot(robot),
    )


def simulate(scenario: Path, folder: Path, *, seed: Optional[int] = None) -> list[Recording]:
    """Writes recordings of a robot whose truth is known into a folder, and returns them.

    `scenario`: the file that describes robot and drive. `folder`: for the recording, or a folder of each run.
    `seed`: of all random numbers, in place of the scenario's. docs/simulation.md.

    >>> import tempfile, trundle
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     runs = trundle.simulate("data/demo/slip.toml", folder)
    >>> len(runs), len(runs[0].reference["x_m"]) > 100
    (1, True)
    """
    written = _trundle.simulate(os.fspath(scenario), os.fspath(folder), seed=seed)
    return [Recording(run["folder"]) for run in written["recordings"]]


def run(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    folder: Path,
    *,
    calibrate_on: Runs = (),
    free: Sequence[str] = (),
    fix: Sequence[str] = (),
    learn: Runs = (),
    spin_odds: float = 10.0,
    map: Optional[Path] = None,
    filter: str = "smoother",
    particles: int = 100,
    seed: int = 1,
    export: Optional[str] = None,
    robot_number: int = 0,
    recording_map: Optional[Path] = None,
    msg_path: Iterable[Path] = (),
) -> Run:
    """All in one go: health, calibration, odometry, slip, map, errors, one page; all of it into a `folder`.

    `recording`: one, or the folder of a session. `robot`: before it is calibrated. `calibrate_on`: recordings to
    calibrate on, in place of the recording itself, with `free` and `fix` as `calibrate` has them. `learn`,
    `spin_odds`: as `slip` has them. `map`: landmarks.csv of known landmarks to localize on, in place of the
    recording's own. `filter`, `particles`, `seed`: as `slam` has them. `export`: 'mcap' or 'wpilog', a file for
    viewers besides. `robot_number`, `recording_map`, `msg_path`: as Recording has `robot_number`, `map` and
    `msg_path`. A robot, and a recording of arrays, is written to a file first, whose path is what the results
    name. docs/run.md.

    >>> import tempfile, trundle
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = trundle.run("data/demo/slip", "data/demo/robot.toml", folder)
    >>> [stage.status for stage in found.stages if stage.name == "odometry"]
    ['done']
    """
    with _paths() as paths:
        return _trundle.run(
            *paths(recording),
            *paths(robot),
            os.fspath(folder),
            calibrate_on=paths(calibrate_on),
            free=list(free),
            fix=list(fix),
            learn=paths(learn),
            spin_odds=spin_odds,
            map=_text(map),
            filter=filter,
            particles=particles,
            seed=seed,
            export=export,
            robot_number=robot_number,
            recording_map=_text(recording_map),
            msg_path=[os.fspath(one) for one in msg_path],
        )


def report(
    results: Union[Path, Iterable[Path]],
    *,
    reference: Union[Path, Recording, None] = None,
    robot: Union[Path, Robot, None] = None,
) -> Report:
    """Draws folders of `results`, or files of them, as one page that opens from disk.

    `reference`: what trajectories are compared with where a folder has none. `robot`: says where the reference
    was measured on it. docs/report.md.

    >>> import tempfile, trundle
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = trundle.slip("data/demo/slip", "data/demo/robot.toml").save(folder + "/slip.csv")
    ...     page = trundle.report(folder)
    >>> "</html>" in page.html
    True
    """
    with _paths() as paths:
        return _trundle.report(
            paths(results), reference="".join(paths(reference)), robot="".join(paths(robot))
        )


def umbmark(
    inputs: Runs,
    robot: Union[Path, Robot],
    *,
    side_m: Optional[float] = None,
    method: str = "orientation",
) -> Calibration:
    """Calibrates from squares driven both ways: a sheet that was measured by hand, or recordings of them.

    `inputs`: the sheet, or the recordings. `robot`: as it is before. `side_m`: of the square; a sheet may say it
    itself. `method`: 'classic', 'orientation' or 'ml'. docs/umbmark.md.

    >>> import trundle
    >>> found = trundle.umbmark("data/umbmark/sheet.csv", "data/umbmark/robot.toml")
    >>> found.method
    'orientation'
    """
    with _paths() as paths:
        return _trundle.umbmark(paths(inputs), _robot(robot), side_m=side_m, method=method)


def init(
    log: Path,
    folder: Path,
    *,
    urdf: Optional[Path] = None,
    controller: Optional[Path] = None,
    msg_path: Iterable[Path] = (),
) -> Drafts:
    """Drafts robot.toml and recording.toml for a log as it is, and says what is to be filled in.

    `log`: of any known format, or a folder of CSV files. `folder`: of the two drafts. `urdf`: of the robot, where
    its wheels are, and how large. `controller`: parameters of its diff_drive_controller or
    mecanum_drive_controller (YAML). `msg_path`: folders with .msg files of types that a log does not define.
    docs/logs.md.

    >>> import tempfile, trundle
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = trundle.init("data/demo/slip", folder)
    >>> found.to_fill_in[0]
    'robot.toml: diameter_m of left, right'
    """
    return _trundle.init(
        log, folder, urdf=_text(urdf), controller=_text(controller), msg_path=[os.fspath(one) for one in msg_path]
    )


def install_angle(
    recordings: Runs = (),
    robot: Union[Path, Robot, None] = None,
    *,
    side_m: Optional[float] = None,
    ends: Iterable[tuple[float, float]] = (),
    sigma_m: float = 0.005,
    sigma_heading_deg: float = 1.0,
    start_heading: str = "one-alignment",
) -> InstallAngle:
    """The mounting angle of two dead wheels from L-shaped runs: recordings, or `side_m` and `ends`.

    `recordings`: then `robot` says which wheel is which. `side_m`: what the wheels read on each leg. `ends`:
    where each run really ended, ahead of its start and to the left of it [m], measured to `sigma_m`.
    `sigma_heading_deg`: how well the start heading is set. `start_heading`: 'one-alignment' of all runs, or
    'each-run' where the robot was aligned anew for each. docs/dead-wheels.md.

    >>> import trundle
    >>> found = trundle.install_angle(side_m=2, ends=[(1.998, 1.931), (2.001, 1.935)])
    >>> print(f"{found.alpha_rad:.4f} rad")
    0.0338 rad
    """
    with _paths() as paths:
        return _trundle.install_angle(
            recordings=paths(recordings),
            robot="".join(paths(robot)),
            side_m=side_m,
            ends=list(ends),
            sigma_m=sigma_m,
            sigma_heading_deg=sigma_heading_deg,
            start_heading=start_heading,
        )


def steps(
    recording: Union[Path, Recording], robot: Union[Path, Robot], *, unknown_ids: bool = False
) -> list[Step]:
    """A `recording` cut into what a filter is given at once: motions, and what was seen at the end of each.

    `robot`: with a landmark sensor. `unknown_ids` forgets the landmarks' names.

    >>> import trundle
    >>> smoother = trundle.IncrementalSmoother(trundle.Robot("data/demo/robot.toml"))
    >>> for step in trundle.steps("data/demo/session_03/tour", "data/demo/robot.toml")[:50]:
    ...     _ = smoother.step(step)
    >>> smoother.covariance.shape
    (3, 3)
    """
    return _trundle.steps(_recording(recording), _robot(robot), unknown_ids=unknown_ids)
