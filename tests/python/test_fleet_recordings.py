"""Real recordings as one fleet, the smallest ones: what trundle.fleet stores of each is what the program says of it. All of
them: tools/fleet_recordings.py."""

import math
import sys
import tempfile
import unittest
from pathlib import Path

from common import REAL_DATA

try:
    import sqlalchemy
except ImportError as missing:
    raise unittest.SkipTest(f"{missing}: apt-get install python3-sqlalchemy") from missing

if not REAL_DATA.exists():
    raise unittest.SkipTest(f"real data not found: {REAL_DATA}")

sys.path.append(str(Path("tools").resolve()))
import fleet_recordings
import trundle
from trundle.fleet import store

SETS = ("censi_calibration", "ese650_skidsteer", "kobuki_slip", "logs")


class Recordings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        every = fleet_recordings.recordings(REAL_DATA.resolve(), cls.folder / "out")
        cls.sets = {name: every[name] for name in SETS}
        cls.found = fleet_recordings.run(cls.sets, cls.folder)
        cls.given = [one for given in cls.sets.values() for one in given]

    def test_each_log_has_its_row_and_what_it_took(self):
        self.assertEqual(self.found.code, 0)
        self.assertEqual(sorted(self.found.runs), sorted(one.found_as for one in self.given))
        for one in self.given:
            self.assertEqual(self.found.runs[one.found_as].robot, one.robot)
            self.assertGreaterEqual(self.found.seconds[one.found_as], 0.0)
        self.assertGreater(sum(self.found.seconds.values()), 0.0)

    def test_what_fails_are_log_files_without_motion_and_drafts_with_gaps(self):
        failed = {log: run.line for log, run in self.found.runs.items() if run.status == "failed"}
        self.assertEqual({Path(log).parent.name for log in failed}, {"logs"})
        for log, line in failed.items():
            self.assertTrue(line.startswith(log), line)
            self.assertRegex(line, "holds no samples|says nothing of how the robot moved|no key 'diameter_m'")
            with self.assertRaises(ValueError):  # and not the engine alone says so
                trundle.odometry(log, f"{log}/robot.toml")

    def test_parameters_are_those_of_a_calibration(self):
        database = store.Store(f"sqlite:///{self.folder}/fleet.db")
        ids = {row.path: row.id for row in database.rows(sqlalchemy.select(store.logs))}
        stored = {}
        for row in database.rows(sqlalchemy.select(store.parameters)):
            stored.setdefault(row.log_id, {})[row.name] = row
        calibrated = [one for one in self.given if self.found.runs[one.found_as].status == "done" and not self.found.runs[one.found_as].line]
        self.assertGreaterEqual(len(calibrated), 10)
        self.assertEqual(sorted(stored), sorted(ids[one.found_as] for one in calibrated))
        for one in calibrated:
            rows = stored[ids[one.found_as]]
            self.assertTrue(all(math.isfinite(row.value) and (row.sigma > 0.0 or not row.observable) for row in rows.values()), one.log)
        for one in (self.sets["censi_calibration"][0], self.sets["kobuki_slip"][0]):
            found = trundle.calibrate(one.log, one.robot_file)
            self.assertEqual({row.name: row.value for row in stored[ids[one.found_as]].values()}, {p.name: p.value for p in found.parameters})

    def test_no_robot_stands_out_without_others_of_its_type(self):
        [attention, *changes] = fleet_recordings.told(self.found)
        self.assertIn("change 0, outlier 0, run 0,", attention)
        self.assertEqual(changes, [])


if __name__ == "__main__":
    unittest.main()
