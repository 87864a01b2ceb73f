"""What a robot's wheels and gyro are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Optional, Union

from . import _trundle
from ._given import Path, Runs, given_paths, many, robot_of
from ._trundle import Calibration, InstallAngle, Robot


def calibrate(
    runs: Runs,
    robot: Union[Path, Robot],
    *,
    hold_out: Runs = (),
    free: Sequence[str] = (),
    fix: Sequence[str] = (),
    learn_noise: bool = False,
    landmarks: bool = False,
    with_reference: bool = False,
) -> Calibration:
    """Calibrates a robot from recordings with references, or `landmarks`: from what it saw of them.

    `runs` and `hold_out`: recordings, or folders of them; the latter are only evaluated. `robot`: as it is
    before. `free`, `fix`: names of parameters to estimate besides the usual ones, or to leave as they are.
    `learn_noise`: also the noise of wheels, sideways motion and gyro. `with_reference`: with `landmarks`, the
    positions of references count too. docs/calibration.md.

    >>> import trundle
    >>> found = trundle.calibrate("data/demo/session_01", "data/demo/robot.toml",
    ...                           hold_out="data/demo/session_03/tour")
    >>> print(f"{found['left.diameter'].value:.4f} m")
    0.1007 m
    >>> better = trundle.odometry("data/demo/session_03/tour", found.robot)
    """
    return _trundle.calibrate(
        many(runs),
        robot_of(robot),
        hold_out=many(hold_out),
        free=many(free),
        fix=many(fix),
        learn_noise=learn_noise,
        landmarks=landmarks,
        with_reference=with_reference,
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
    with given_paths() as paths:
        return _trundle.umbmark(paths(inputs), robot_of(robot), side_m=side_m, method=method)


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
    with given_paths() as paths:
        return _trundle.install_angle(
            recordings=paths(recordings),
            robot="".join(paths(robot)),
            side_m=side_m,
            ends=list(ends),
            sigma_m=sigma_m,
            sigma_heading_deg=sigma_heading_deg,
            start_heading=start_heading,
        )
