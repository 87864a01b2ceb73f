"""On real recordings Python's numbers are the program's, to the last bit: on every one there is, or on the share
$TRUNDLE_TEST_SCALE of each session's.

The recordings are laid out as tools/run_all.py does."""

import contextlib
import importlib.util
import io
import json
import os
import sys
import tempfile
import unittest
from pathlib import Path

import numpy
import trundle
from common import REAL_DATA, WithFolder, program

if not REAL_DATA.exists():
    raise unittest.SkipTest(f"real data not found: {REAL_DATA}")
SCALE = float(os.environ.get("TRUNDLE_TEST_SCALE", "1"))


def tool(name):
    """tools/NAME.py as a module."""
    spec = importlib.util.spec_from_file_location(name, Path("tools", f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class RealRecordings(WithFolder):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.out = Path(folder.name)
        run_all = tool("run_all")
        with contextlib.redirect_stdout(io.StringIO()):
            run_all.lay_out(REAL_DATA.resolve(), cls.out)
        cls.jobs = list(run_all.jobs(REAL_DATA.resolve(), cls.out))

    def recordings(self):
        """Of every session, with the number of the robot where the folder holds several."""
        for job in self.jobs:
            number = int(job.options[job.options.index("--robot-number") + 1]) if "--robot-number" in job.options else 0
            folders = [p for p in sorted(Path(job.folder).glob("*/")) if (p / "recording.toml").exists() or (p / "wheels.csv").exists()]
            for folder in (folders or [Path(job.folder)])[:: round(1.0 / SCALE)]:
                yield job, folder, number

    def test_odometry_and_slip(self):
        compared = 0
        for job, folder, number in self.recordings():
            with self.subTest(str(folder)):
                options = ["--robot", job.robot, *(["--robot-number", number] if number else [])]
                read = lambda: trundle.Recording(folder, robot_number=number)
                for name in ("odometry", "slip"):
                    with tempfile.TemporaryDirectory() as place:
                        ours, theirs = Path(place, "ours.csv"), Path(place, "theirs.csv")
                        found = self.assert_same_answer(name, lambda: getattr(trundle, name)(read(), job.robot),
                                                 folder, *options, "-o", theirs)
                        if found is None:
                            continue
                        compared += 1
                        found.save(ours)
                        self.assertEqual(ours.read_bytes(), theirs.read_bytes())
        print(f"{compared} answers compared")
        self.assertGreater(compared, len(self.jobs))

    def test_calibrate(self):
        compared = set()
        for job in self.jobs:
            name = job.title.split("/")[0]
            if name in compared or job.calibrate_on is None:
                continue
            compared.add(name)
            with self.subTest(job.title):
                self.assert_same_answer("calibrate", lambda: trundle.calibrate(job.calibrate_on, job.robot),
                                 job.calibrate_on, "--robot", job.robot)
        print(f"calibrated: {', '.join(sorted(compared))}")
        self.assertGreater(len(compared), 3)

    def test_slam(self):
        for job, folder, number in self.recordings():
            if number > 1 or not job.title.startswith(("mrclam", "lost_in_the_woods")):
                continue
            with self.subTest(job.title), tempfile.TemporaryDirectory() as place:
                options = ["--robot", job.robot, *(["--robot-number", number] if number else []), "--filter", "ekf"]
                recording = trundle.Recording(folder, robot_number=number)
                program("slam", folder, *options, "-o", place)
                found = trundle.slam(recording, job.robot, filter="ekf")
                self.assertEqual(found.to_dict(), json.loads(Path(place, "slam.json").read_text()))
                written = trundle.Trajectory(Path(place, "trajectory.csv"))
                numpy.testing.assert_array_equal(found.trajectory.x_m, written.x_m)


if __name__ == "__main__":
    unittest.main()
