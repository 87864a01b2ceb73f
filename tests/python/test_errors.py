"""Errors are the program's lines; long calls leave other threads alone, and Ctrl-C ends them."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy
import trundle
from common import DEMO, ROBOT, TOUR, WithFolder, program


class Lines(unittest.TestCase):
    def assert_same_line(self, kind, code, call, *arguments):
        done = program(*arguments, check=False)
        self.assertEqual(done.returncode, code)
        with self.assertRaises(kind) as caught:
            call()
        self.assertEqual(f"trundle: {caught.exception}\n", done.stderr)

    def test_wrong_input_is_a_value_error(self):
        self.assert_same_line(ValueError, 3, lambda: trundle.odometry("nowhere", ROBOT),
                              "odometry", "nowhere", "--robot", ROBOT)
        self.assert_same_line(ValueError, 3, lambda: trundle.odometry(TOUR, "nowhere.toml"),
                              "odometry", TOUR, "--robot", "nowhere.toml")
        self.assert_same_line(ValueError, 3, lambda: trundle.calibrate(TOUR, ROBOT, fix=["trck"]),
                              "calibrate", TOUR, "--robot", ROBOT, "--fix", "trck")

    def test_a_line_of_a_file_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "wheels.csv").write_text("time_s,left_ticks,right_ticks\n0,1,2\n1,a,2\n2,3,4\n")
            self.assert_same_line(ValueError, 3, lambda: trundle.Recording(folder), "info", folder)

    def test_data_that_cannot_answer(self):
        squares = f"{DEMO}/session_01/straight"
        self.assert_same_line(trundle.CannotAnswer, 4, lambda: trundle.umbmark(squares, ROBOT, side_m=2),
                              "umbmark", squares, "--robot", ROBOT, "--side-m", 2)
        self.assertTrue(issubclass(trundle.CannotAnswer, RuntimeError))

    def test_options_are_checked_as_the_program_s(self):
        for call, line in (
            (lambda: trundle.slip(TOUR, ROBOT, probability=2), "probability: is 2; expected a number from 1e-12 to 0.5"),
            (lambda: trundle.slam(TOUR, ROBOT, filter="pf"), "filter: is 'pf'; expected one of 'fastslam1'"),
            (lambda: trundle.slam(TOUR, ROBOT, particles=0), "particles: is 0; expected a number from 1 to 1e"),
            (lambda: trundle.odometry(TOUR, ROBOT, start=(float("nan"), 0, 0)), "start: (nan, 0, 0) is no pose"),
            (lambda: trundle.evaluate(TOUR, TOUR, align="best"), "align: is 'best'; expected 'none', 'start' or 'se2'"),
            (lambda: trundle.odometry(TOUR, ROBOT).save(f"{TOUR}/wheels.csv"), f"{TOUR}/wheels.csv: "),
        ):
            with self.subTest(line), self.assertRaises(ValueError) as caught:
                call()
            self.assertTrue(str(caught.exception).startswith(line), str(caught.exception))

    def test_a_recording_is_not_saved_over_itself(self):
        with tempfile.TemporaryDirectory() as folder:
            given = "# by hand\ntime_s,left_ticks,right_ticks,battery_v\n0,1,2,12\n1,2,3,12\n"
            Path(folder, "wheels.csv").write_text(given)
            with self.assertRaisesRegex(ValueError, "part of a recording"):
                trundle.Recording(folder).save(folder)
            self.assertEqual(Path(folder, "wheels.csv").read_text(), given)

    def test_a_robot_is_an_object_or_a_path_everywhere(self):
        recording = trundle.Recording(TOUR)
        self.assertEqual(recording.info(ROBOT), recording.info(trundle.Robot(ROBOT)))
        self.assertEqual(trundle.Odometer(Path(ROBOT)).finish(), [])
        self.assertEqual(trundle.IncrementalSmoother(ROBOT).pose.x_m, 0.0)
        for call in (recording.info, trundle.Odometer, trundle.IncrementalSmoother):
            with self.assertRaisesRegex(ValueError, "nowhere.toml"):
                call("nowhere.toml")
            with self.assertRaisesRegex(TypeError, "a Robot, or the path of its file"):
                call(3)

    def test_one_name_is_one_parameter(self):
        square = f"{DEMO}/session_01/square_cw_01"
        fixed = trundle.calibrate([square, f"{DEMO}/session_01/square_ccw_01"], ROBOT, fix="track")
        self.assertNotIn("track", [parameter.name for parameter in fixed.parameters])

    def test_whole_numbers_name_landmarks_though_one_is_missing(self):
        seen = {"time_s": [0.0, 0.5, 1.0], "landmark": numpy.array([1.0, numpy.nan, 12.0]),
                "range_m": [1.0, 2.0, 3.0], "bearing_rad": [0.0, 0.1, 0.2]}
        wheels = {"time_s": [0.0, 1.0], "left_ticks": [0, 1], "right_ticks": [0, 1]}
        recording = trundle.Recording.from_arrays("x", wheels=wheels, sightings=seen)
        self.assertEqual(list(recording.sightings["landmark"]), ["1", "", "12"])

    def test_wrong_types_are_type_errors(self):
        with self.assertRaises(TypeError):
            trundle.odometry(TOUR, ROBOT, start=(1, 2))
        with self.assertRaises(TypeError):
            trundle.Recording(3)
        tour = trundle.Recording(TOUR)
        for call, line in (
            (lambda: trundle.evaluate(3, TOUR), "estimate: is of type int; expected a trajectory, "),
            (lambda: trundle.evaluate(TOUR, None), "reference: is of type NoneType; expected a trajectory, "),
            (lambda: trundle.localize(tour, ROBOT, trundle.odometry(tour, ROBOT)), "map: is of type Odometry; expected what slam"),
            (lambda: trundle.calibrate([tour, 3], ROBOT), "runs: is of type int; expected recordings, "),
            (lambda: trundle.calibrate(tour, ROBOT, hold_out=[3]), "hold_out: is of type int; expected recordings, "),
            (lambda: trundle.slip(tour, ROBOT, learn=[3]), "learn: is of type int; expected recordings without slip, "),
        ):
            with self.subTest(line), self.assertRaises(TypeError) as caught:
                call()
            self.assertTrue(str(caught.exception).startswith(line), str(caught.exception))

    def test_no_runs(self):
        with self.assertRaisesRegex(ValueError, "^runs: name none; expected recordings"):
            trundle.calibrate([], ROBOT)


def long_call():
    """Half a minute, or more."""
    return trundle.slam(TOUR, ROBOT, filter="fastslam2", particles=20000)


def long_recording(hours):
    time_s = numpy.arange(0.0, 3600.0 * hours, 0.02)
    ticks = numpy.round(time_s * 300.0)
    return trundle.Recording.from_arrays(
        wheels=dict(time_s=time_s, left_ticks=ticks, right_ticks=ticks),
        gyro=dict(time_s=time_s, yaw_rate_rad_s=0.0 * time_s),
        reference=dict(time_s=time_s, x_m=0.1 * time_s, y_m=0.0 * time_s, heading_rad=0.0 * time_s))


class LongCalls(WithFolder):
    def longest_stop(self, call):
        """Of a thread that looks at the clock all the time while it runs; how long the call took."""
        ticks = []
        done = threading.Event()

        def tick():
            while not done.is_set():
                ticks.append(time.monotonic())
                time.sleep(0.001)

        thread = threading.Thread(target=tick)
        thread.start()
        try:
            start = time.monotonic()
            call()
            spent = time.monotonic() - start
        finally:
            done.set()
            thread.join()
        during = [t for t in ticks if start < t < start + spent]
        seen = [start, *during, start + spent]
        return max(b - a for a, b in zip(seen, seen[1:])), spent

    def test_other_threads_run_meanwhile(self):
        longest, spent = self.longest_stop(lambda: trundle.slam(TOUR, ROBOT, particles=1000))
        self.assertLess(longest, max(0.5 * spent, 0.1))

    def test_other_threads_run_while_results_are_saved(self):
        recording = long_recording(hours=4)
        robot = trundle.Robot(ROBOT)
        odometry, slip = trundle.odometry(recording, robot), trundle.slip(recording, robot)
        for save in (
            lambda: slip.save(self.folder / "slip.csv", corrected=self.folder / "corrected.csv"),
            lambda: odometry.save(self.folder / "odometry.csv"),
            lambda: odometry.trajectory.save(self.folder / "trajectory.csv"),
            lambda: recording.save(self.folder / "recording"),
        ):
            longest, spent = self.longest_stop(save)
            self.assertLess(longest, max(0.5 * spent, 0.1))

    def test_control_c_ends_a_long_call(self):
        code = ("import sys, trundle\nprint('ready', flush=True)\n"
                "try:\n    trundle.slam(*sys.argv[1:3], filter='fastslam2', particles=50000)\n"
                "except KeyboardInterrupt:\n    print('interrupted', flush=True)\n")
        with subprocess.Popen([sys.executable, "-c", code, TOUR, ROBOT], stdout=subprocess.PIPE, text=True,
                              env=os.environ) as process:
            self.assertEqual(process.stdout.readline(), "ready\n")
            time.sleep(0.5)
            start = time.monotonic()
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.stdout.readline(), "interrupted\n")
            self.assertEqual(process.wait(), 0)
            self.assertLess(time.monotonic() - start, 5.0)  # a step of so many particles takes a part of a second

    def assert_interrupted(self, call, before, *arguments):
        """Every long loop looks: a signal that came before is seen in its first look. By the processor's time, of which others
        that work on the machine take none. Nothing is left in the folder of what Python writes."""
        code = f"""
import signal, sys, threading, time, numpy, trundle
{before}
threading.Timer(0.1, lambda: signal.raise_signal(signal.SIGINT)).start()
start = time.process_time()
try:
    {call}
    print("done", time.process_time() - start)
except KeyboardInterrupt:
    print("interrupted", time.process_time() - start)
"""
        with self.subTest(call):
            done = subprocess.run([sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            word, seconds = done.stdout.split()
            self.assertEqual(word, "interrupted")
            self.assertLess(float(seconds), 5.0)
            self.assertEqual([file.name for file in self.ours.rglob("*") if file.is_file()], [])

    def test_control_c_of_other_calls(self):
        for call in ("trundle.calibrate([data] * 60, robot)", "trundle.smooth(data, robot, filter='fastslam1', particles=20000)",
                     "trundle.slam_together([data, data], robot, filter='fastslam1', particles=20000)",
                     "trundle.odometry(long, robot)", "trundle.slip(long, robot)", "found.save(sys.argv[3])",
                     "found.trajectory.save(sys.argv[3])", "trundle.evaluate(found, long)", "long.info(robot)",
                     "long.save(sys.argv[3])"):
            before = f"""
data, robot = trundle.Recording(sys.argv[1]), trundle.Robot(sys.argv[2])
time_s = numpy.arange(0.0, 40000.0, 0.02)
ticks = numpy.mod(time_s * 300.0, 65536.0).round()
sees = slice(None, None, 10)
long = trundle.Recording.from_arrays(wheels=dict(time_s=time_s, left_ticks=ticks, right_ticks=ticks),
                                     gyro=dict(time_s=time_s, yaw_rate_rad_s=0.0 * time_s),
                                     reference=dict(time_s=time_s, x_m=0.1 * time_s, y_m=0.0 * time_s, heading_rad=0.0 * time_s),
                                     sightings=dict(time_s=time_s[sees], landmark=["a"] * len(time_s[sees]),
                                                    range_m=0.0 * time_s[sees] + 1.0, bearing_rad=0.0 * time_s[sees]))
found = trundle.odometry(long, robot) if "found" in "{call}" else None"""
            self.assert_interrupted(call, before, TOUR, ROBOT, self.ours / "saved.csv")

    def test_control_c_of_a_merge(self):
        """Of two maps that share no name."""
        names, sigma_m = range(300), 0.05
        places = numpy.random.default_rng(7).uniform(0.0, 60.0, (len(names), 2))
        for folder, turned in (("a", places), ("b", places @ [[0.0, 1.0], [-1.0, 0.0]])):
            rows = [f"{name},{x},{y},{sigma_m**2},0,{sigma_m**2},9" for name, (x, y) in zip(names, turned)]
            joint = [f"{i // 2},{'xy'[i % 2]}," + ",".join(map(str, row))
                     for i, row in enumerate(sigma_m**2 * numpy.eye(2 * len(names)))]
            (self.theirs / folder).mkdir()
            (self.theirs / folder / "landmarks.csv").write_text(
                "landmark,x_m,y_m,var_xx,var_xy,var_yy,sightings\n" + "\n".join(rows) + "\n")
            (self.theirs / folder / "landmarks_covariance.csv").write_text(
                "landmark,axis," + ",".join(f"cov_{i}" for i in range(2 * len(names))) + "\n" + "\n".join(joint) + "\n")
        self.assert_interrupted("trundle.merge(sys.argv[1:], unknown_ids=True)", "", self.theirs / "a", self.theirs / "b")

    def test_control_c_of_calls_on_files(self):
        """Of six hours. umbmark takes many runs, as one of squares is short."""
        scenario, place, squares = self.theirs / "scenario.toml", self.theirs / "drive", f"{DEMO}/session_01/square_cw_01"
        text = Path(DEMO, "slip.toml").read_text().replace('"robot.toml"', f'"{Path(ROBOT).resolve()}"')
        scenario.write_text(text.replace("length_m = 20", "length_m = 5000"))
        [drive] = trundle.simulate(scenario, place)
        trundle.odometry(drive, ROBOT).save(self.theirs / "odometry.csv")
        for call in ("trundle.simulate(scenario, ours)", "trundle.run(drive, robot, ours)",
                     "trundle.report(odometry, reference=drive, robot=robot)",
                     "trundle.localize(recording, robot, drive + '/landmarks.csv')",
                     "trundle.umbmark([squares] * 800, robot, side_m=2)"):
            before = f"""
scenario, drive, odometry, squares, robot, ours = sys.argv[1:]
recording = trundle.Recording(drive) if "recording" in "{call}" else None"""
            self.assert_interrupted(call, before, scenario, place, self.theirs / "odometry.csv", squares, ROBOT, self.ours)


if __name__ == "__main__":
    unittest.main()
