"""Where landmarks say that it was, and where they are."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Optional, Union

from . import _trundle
from ._given import Map, Path, Runs, Start, given_paths, many, map_file, recording_of, robot_of, text_of
from ._trundle import JointSlam, Localization, Merge, Recording, Robot, Slam, Step


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
        [recording_of(recording)],
        [robot_of(robot)],
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
        learn=many(learn),
        spin_odds=spin_odds,
        threads=threads,
        checkpoint=text_of(checkpoint),
        checkpoint_every_s=checkpoint_every_s,
        resume=text_of(resume),
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
    given = [recording_of(recording) for recording in recordings]
    robots = [os.path.join(one.path, "robot.toml") for one in given] if robot is None else many(robot)
    return _trundle.slam_together(
        given,
        [robot_of(one) for one in robots],
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
        learn=many(learn),
        spin_odds=spin_odds,
        threads=threads,
        marker_sigma=marker_sigma,
    )


def merge(maps: Iterable[Union[Path, Map]], *, unknown_ids: bool = False) -> Merge:
    """Merges maps of several robots or runs into one, in the frame of the first.

    `maps`: folders with landmarks.csv, such files, or what `slam`, `slam_together` and `merge` found, which is
    written to a file first, whose path is what the result names. `unknown_ids` forgets the landmarks' names:
    which is which follows from how they lie. docs/together.md.

    >>> import trundle
    >>> a, b = (trundle.slam(f"data/demo/session_0{i}/tour", "data/demo/robot.toml") for i in (2, 3))
    >>> found = trundle.merge([a, b])
    >>> found.frames[0], len(found.landmarks)
    (Pose(x_m=0, y_m=0, heading_rad=0), 13)
    """
    with given_paths() as paths:
        return _trundle.merge(paths(maps), unknown_ids=unknown_ids)


def localize(
    recording: Union[Path, Recording],
    robot: Union[Path, Robot],
    map: Union[Path, Map],
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
    """Finds and follows the robot on a known `map`.

    `map`: landmarks.csv, or what `slam`, `slam_together` or `merge` found; of the last two a file is written
    first, whose path is what the result names. `recording`: with sightings. `robot`: with a landmark sensor. `start`: the pose at the first stamp, known to
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
    with given_paths() as paths:
        return _trundle.localize(
            recording_of(recording),
            robot_of(robot),
            map if isinstance(map, Slam) else map_file(map, paths),
            start=start,
            start_sigma_m=start_sigma_m,
            start_sigma_deg=start_sigma_deg,
            filter=filter,
            particles=particles,
            seed=seed,
            unknown_ids=unknown_ids,
            correct_slip=correct_slip,
            learn=many(learn),
            spin_odds=spin_odds,
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
    return _trundle.steps(recording_of(recording), robot_of(robot), unknown_ids=unknown_ids)
