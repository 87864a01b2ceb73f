"""From a log to a page, and what stands before and after that."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Optional, Union

from . import _trundle
from ._given import Map, Path, Runs, given_paths, many, map_file, text_of
from ._trundle import Drafts, Recording, Report, Robot, Run


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
        log, folder, urdf=text_of(urdf), controller=text_of(controller), msg_path=[os.fspath(one) for one in msg_path]
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
    map: Union[Path, Map, None] = None,
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
    `spin_odds`: as `slip` has them. `map`: of known landmarks to localize on, as `localize` has it, in place
    of the recording's own. `filter`, `particles`, `seed`: as `slam` has them. `export`: 'mcap' or 'wpilog', a file for
    viewers besides. `robot_number`, `recording_map`, `msg_path`: as Recording has `robot_number`, `map` and
    `msg_path`. A robot, a map, and a recording of arrays, is written to a file first, whose path is what the
    results name. docs/run.md.

    >>> import tempfile, trundle
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = trundle.run("data/demo/slip", "data/demo/robot.toml", folder)
    >>> [stage.status for stage in found.stages if stage.name == "odometry"]
    ['done']
    """
    with given_paths() as paths:
        return _trundle.run(
            *paths(recording),
            *paths(robot),
            os.fspath(folder),
            calibrate_on=paths(calibrate_on),
            free=many(free),
            fix=many(fix),
            learn=paths(learn),
            spin_odds=spin_odds,
            map=text_of(map_file(map, paths)),
            filter=filter,
            particles=particles,
            seed=seed,
            export=export,
            robot_number=robot_number,
            recording_map=text_of(recording_map),
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
    with given_paths() as paths:
        return _trundle.report(
            paths(results), reference="".join(paths(reference)), robot="".join(paths(robot))
        )
