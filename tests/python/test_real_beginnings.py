"""Of every kind of real recording the beginning: what the commands say and write of it Python gives to the last bit, files
byte by byte. Whole recordings: test_real_recordings.py.

They are laid out as tools/run_all.py does."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path

import trundle
from common import REAL_DATA, WithFolder, beginning_of, document_of, program

if not REAL_DATA.exists():
    raise unittest.SkipTest(f"real data not found: {REAL_DATA}")

sys.path.append(str(Path("tools").resolve()))
import run_all

# Of what takes long a stretch is written as a recording of its own; the others are read as they are mapped.
LONGEST_S = {"husky_gps_bag": 60.0, "lost_in_the_woods": 60.0, "mrclam": 30.0, "optiodom_diff": 60.0, "optiodom_omni4": 10.0,
             "optiodom_omni4_gyro": 10.0, "optiodom_omni4_pods": 10.0, "optiodom_tricyc": 30.0, "victoria_park": 30.0,
             "victoria_park_steered": 20.0, "warthog_whole": 60.0}
FAULTS_PUT_IN = ("kobuki_injected", "omni3_clean", "omni3_injected")  # made from recordings that are here already


class RealBeginnings(WithFolder):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        out = Path(folder.name)
        with contextlib.redirect_stdout(io.StringIO()):
            run_all.lay_out(REAL_DATA.resolve(), out)
        cls.squares = out / "optiodom_diff/square/231220200040"
        cls.kinds = {}  # by name: a recording, and its robot's file
        for robot in sorted(out.rglob("robot.toml")):
            name = robot.parent.name
            if name in FAULTS_PUT_IN:
                continue
            if name == "mrclam":
                recording = trundle.Recording(REAL_DATA / "mrclam/MRCLAM_Dataset6", robot_number=1)
            else:
                recording = trundle.Recording(trundle._trundle.recordings_below(robot.parent)[0])
            if name in LONGEST_S:
                beginning_of(recording, LONGEST_S[name]).save(out / "cut" / name)
                recording = trundle.Recording(out / "cut" / name)
            cls.kinds[name] = recording, robot

    def assert_same(self, compare, stream=None):
        """Of every kind, or of those that have a stream: compare(recording, robot, theirs, ours) has the program and Python write into two
        folders. It returns nothing where both say that it cannot be done."""
        answered = []
        for name, (recording, robot) in self.kinds.items():
            if stream and not getattr(recording, stream):
                continue
            with self.subTest(name):
                places = [self.theirs / name, self.ours / name]
                for place in places:
                    place.mkdir()
                if compare(recording, robot, *places):
                    answered.append(name)
        self.assert_same_files()
        print(f"{self.id().split('.')[-1]}: {len(answered)} kinds")
        return answered

    def test_info(self):
        for name, (recording, robot) in self.kinds.items():
            with self.subTest(name):
                self.assertEqual(recording.info(robot), document_of("info", recording.path, "--robot", robot))

    def test_odometry(self):
        def compare(recording, robot, theirs, ours):
            found = self.assert_same_answer("odometry", lambda: trundle.odometry(recording, robot), recording.path, "--robot", robot,
                                            "-o", theirs / "odometry.csv")
            found.save(ours / "odometry.csv")
            return found

        self.assertEqual(self.assert_same(compare), list(self.kinds))

    def test_slip(self):
        def compare(recording, robot, theirs, ours):
            found = self.assert_same_answer("slip", lambda: trundle.slip(recording, robot), recording.path, "--robot", robot,
                                            "-o", theirs / "slip.csv", "--corrected", theirs / "corrected.csv")
            if found:
                found.save(ours / "slip.csv", corrected=ours / "corrected.csv")
            return found

        self.assertGreaterEqual(len(self.assert_same(compare)), 7)

    def test_calibrate(self):
        def compare(recording, robot, theirs, ours):
            found = self.assert_same_answer("calibrate", lambda: trundle.calibrate(recording, robot), recording.path, "--robot", robot,
                                            "-o", theirs / "calibrated.toml")
            if found:
                found.save(ours / "calibrated.toml")
            return found

        self.assertGreaterEqual(len(self.assert_same(compare)), 8)

    def test_evaluate(self):
        def compare(recording, robot, theirs, ours):
            odometry, estimate = trundle.odometry(recording, robot), self.folder / "odometry.csv"
            odometry.save(estimate)
            for align in ("none", "start", "se2"):
                arguments = [estimate, recording.path, "--align", align, "--robot", robot]
                found = self.assert_same_answer(
                    "evaluate", lambda: trundle.evaluate(estimate, recording.path, align=align, robot=robot), *arguments)
                if found:
                    (theirs / f"{align}.json").write_text(program("evaluate", *arguments, "--json").stdout)
                    found.save(ours / f"{align}.json")
                    in_memory = trundle.evaluate(odometry, recording, align=align, robot=robot)
                    self.assertEqual(in_memory.position_m.rms, found.position_m.rms)
            return found

        self.assertGreaterEqual(len(self.assert_same(compare, "reference")), 10)

    def test_slam_smooth_and_localize(self):
        def compare(recording, robot, theirs, ours):
            given = [recording.path, "--robot", robot]
            program("slam", *given, "--filter", "ekf", "-o", theirs / "slam")
            slam = trundle.slam(recording, robot, filter="ekf")
            slam.save(ours / "slam")
            program("slam", *given, "--smooth", "-o", theirs / "smooth")
            trundle.smooth(recording, robot).save(ours / "smooth")
            map = theirs / "slam/landmarks.csv"
            found = self.assert_same_answer(
                "localize", lambda: trundle.localize(recording, robot, map, start=(0, 0, 0)), *given, "--map", map, "--start", "0,0,0",
                "-o", theirs / "localized.csv", "--steps", theirs / "steps.csv", "--innovations", theirs / "innovations.csv")
            if found:
                found.save(ours / "localized.csv", steps=ours / "steps.csv", innovations=ours / "innovations.csv")
            return found

        self.assertEqual(self.assert_same(compare, "sightings"), ["lost_in_the_woods", "mrclam", "victoria_park", "victoria_park_steered"])

    def test_run_and_report(self):
        def compare(recording, robot, theirs, ours):
            place = self.folder / "results"
            program("run", recording.path, "--robot", robot, "--filter", "ekf", "-o", place)
            program("report", place, "-o", theirs / "page.html")
            place.rename(theirs / "results")
            found = trundle.run(recording.path, robot, place, filter="ekf")
            self.assertEqual(found.to_dict(), json.loads((place / "run.json").read_text()))
            trundle.report(place).save(ours / "page.html")
            place.rename(ours / "results")
            return found

        self.assertEqual(self.assert_same(compare), list(self.kinds))

    def test_umbmark(self):
        for method in ("classic", "orientation", "ml"):
            robot = self.kinds["optiodom_diff"][1]
            arguments = [self.squares, "--robot", robot, "--side-m", 1, "--method", method]
            found = self.assert_same_answer("umbmark", lambda: trundle.umbmark(self.squares, robot, side_m=1, method=method), *arguments,
                                            "-o", self.theirs / f"{method}.toml")
            found.save(self.ours / f"{method}.toml")
        self.assert_same_files()


if __name__ == "__main__":
    unittest.main()
