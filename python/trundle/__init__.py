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

from ._calibration import calibrate, install_angle, umbmark
from ._mapping import localize, merge, slam, slam_together, smooth, steps
from ._odometry import evaluate, odometry, slip
from ._runs import init, report, run, simulate
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
