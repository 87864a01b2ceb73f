"""What Python adds is small: to start, and to each call."""

import inspect
import subprocess
import sys
import time
import unittest
from pathlib import Path

import trundle
from common import DEMO, ROBOT, WithFolder, beginning_of

_TRIES = 7  # of which the fastest counts: the machine has other things to do
_LONGEST_S = 2e-3

# The robot of data/demo, at the rates of a fast one.
_SCENARIO = """
name = "tour"
seed = 5
robot = "{robot}"
[truth]
track_m = 0.306
[truth.gyro]
bias_rad_s = 0.012
[encoders]
rate_hz = 50
[gyro]
rate_hz = 100
[reference]
rate_hz = 50
position_sigma_m = 0.001
heading_sigma_deg = 0.1
[landmarks]
count = 12
box_x_m = 6
box_y_m = 6
spacing_m = 1
[[run]]
name = "tour"
[run.sightings]
rate_hz = 2
[[run.path]]
drive = "pause"
duration_s = 5
[[run.path]]
drive = "tour"
length_m = 20
box_x_m = 5
box_y_m = 5
"""


def look(found):
    """Takes all that a result has, and all of its trajectory; but a report's page, which is made when it is asked for."""
    for name in dir(found):
        value = None if name.startswith("_") or name == "html" else getattr(found, name)
        if isinstance(value, trundle.Trajectory):
            look(value)


def added_s(call):
    """Processor time that a call and a look at its result take besides the library's work, which the extension counts.
    Waiting for a disk or for other programs is no part of it."""
    library_s = trundle._trundle._library_s
    rest = []
    for _ in range(_TRIES):
        start, before = time.thread_time(), library_s()
        found = call()
        look(found)
        rest.append(time.thread_time() - start - (library_s() - before))
        del found  # who has it in C++ frees it too
    return min(rest)


class Start(unittest.TestCase):
    def test_import(self):
        code = "import time; start = time.process_time(); import trundle; print(time.process_time() - start)"
        seconds = min(float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
                      for _ in range(_TRIES))
        print(f"import: {seconds:.3f} s of processor time")
        self.assertLess(seconds, 0.3)

    def test_what_is_slow_to_import_is_not_imported(self):
        code = ("import sys, trundle\n"
                "trundle.odometry('data/demo/session_03/tour', 'data/demo/robot.toml').to_dict()\n"
                "print([name for name in ('pandas', 'matplotlib') if name in sys.modules])")
        self.assertEqual(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout, "[]\n")


class Calls(WithFolder):
    def test_each_on_a_minute(self):
        scenario = self.folder / "scenario.toml"
        scenario.write_text(_SCENARIO.format(robot=Path(ROBOT).resolve()))
        [tour] = trundle.simulate(scenario, self.folder / "tour")
        beginning_of(tour, 60.0).save(self.folder / "minute")
        path = str(self.folder / "minute")
        minute, robot = trundle.Recording(path), trundle.Robot(ROBOT)
        self.assertEqual((len(minute.wheels["time_s"]), len(minute.gyro["time_s"]), len(minute.reference["time_s"])), (3000, 6000, 3000))
        found, map = trundle.odometry(minute, robot), trundle.slam(minute, robot, filter="ekf")
        map.save(self.folder / "map")
        landmarks = self.folder / "map/landmarks.csv"
        results = self.folder / "results"
        squares = [f"{DEMO}/session_01/square_{turn}_01" for turn in ("cw", "ccw")]

        calls = {
            "calibrate": lambda: trundle.calibrate(minute, robot),
            "evaluate": lambda: trundle.evaluate(found, minute, robot=robot),
            "init": lambda: trundle.init(path, self.folder / "drafts"),
            "install_angle": lambda: trundle.install_angle(side_m=2, ends=[(1.998, 1.931), (2.001, 1.935)]),
            "localize": lambda: trundle.localize(minute, robot, map),
            "merge": lambda: trundle.merge([landmarks, landmarks]),
            "odometry": lambda: trundle.odometry(minute, robot),
            "run": lambda: trundle.run(minute, robot, results, filter="ekf"),
            "report": lambda: trundle.report(results),
            "simulate": lambda: trundle.simulate(scenario, self.folder / "again"),
            "slam": lambda: trundle.slam(minute, robot),
            "slam_together": lambda: trundle.slam_together([minute, minute], robot),
            "slip": lambda: trundle.slip(minute, robot),
            "smooth": lambda: trundle.smooth(minute, robot),
            "steps": lambda: trundle.steps(minute, robot),
            "umbmark": lambda: trundle.umbmark(squares, robot, side_m=2),
        }
        self.assertEqual(set(calls), {name for name, _ in inspect.getmembers(trundle, inspect.isfunction)})
        calls["Recording"] = lambda: trundle.Recording(path)
        calls["Recording.from_arrays"] = lambda: trundle.Recording.from_arrays(wheels=tour.wheels, gyro=tour.gyro, reference=tour.reference)
        calls["Report.html"] = lambda: trundle.report(results / "odometry.csv").html
        for name, call in calls.items():
            with self.subTest(name):
                seconds = added_s(call)
                print(f"{name}: {1e3 * seconds:.2f} ms of processor time besides the library's work")
                self.assertLess(seconds, _LONGEST_S)


if __name__ == "__main__":
    unittest.main()
