"""Online and afterwards are the same: reading by reading, step by step."""

import copy
import json
import subprocess
import unittest

import numpy
import trundle
from common import PROGRAM, ROBOT, TOUR, WithFolder


def readings_of(recording):
    """In order of time; of one stamp the gyro's first."""
    wheels, gyro = recording.wheels, recording.gyro
    readings = [(t, 1, {name: wheels[name][i] for name in wheels if name != "time_s"}, None)
                for i, t in enumerate(wheels["time_s"])]
    readings += [(t, 0, {}, gyro["yaw_rate_rad_s"][i]) for i, t in enumerate(gyro["time_s"])]
    return sorted(readings, key=lambda reading: reading[:2])


class Live(WithFolder):
    def setUp(self):
        super().setUp()
        self.robot = trundle.Robot(ROBOT)
        self.readings = readings_of(trundle.Recording(TOUR))

    def take(self, odometer, readings):
        found = []
        for time_s, _, wheels, rate in readings:
            found += odometer.add(time_s, wheels, rate)
        return found

    def lines_of(self, estimates):
        return [estimate.line(self.robot) for estimate in estimates]

    def test_same_lines_as_the_program(self):
        text = ""
        for time_s, _, wheels, rate in self.readings:
            line = {"time_s": time_s}
            if wheels:
                line["wheels"] = wheels
            if rate is not None:
                line["gyro"] = rate
            text += json.dumps(line) + "\n"
        printed = subprocess.run([PROGRAM, "live", "--robot", ROBOT], input=text, capture_output=True, text=True, check=True)
        odometer = trundle.Odometer(self.robot)
        found = self.take(odometer, self.readings) + odometer.finish()
        self.assertEqual(self.lines_of(found), printed.stdout.splitlines())
        again = trundle.Odometer(self.robot)
        by_line = [estimate for line in text.splitlines() for estimate in again.add_line(line)] + again.finish()
        self.assertEqual(self.lines_of(by_line), self.lines_of(found))

    def test_same_poses_as_afterwards(self):
        odometer = trundle.Odometer(self.robot)
        found = self.take(odometer, self.readings) + odometer.finish()
        whole = trundle.odometry(TOUR, self.robot).trajectory
        poses = {e.time_s: e for e in found}
        for i in range(0, len(whole), 97):
            estimate = poses[whole.time_s[i]]
            self.assertEqual(estimate.uncorrected_pose.x_m, whole.x_m[i])
            numpy.testing.assert_array_equal(estimate.uncorrected_covariance, whole.covariance[i])

    def test_goes_on_from_a_copy_and_from_a_file(self):
        half = len(self.readings) // 2
        first = trundle.Odometer(self.robot)
        self.take(first, self.readings[:half])
        first.save(self.folder / "state")
        resumed = trundle.Odometer(self.robot)
        resumed.resume(self.folder / "state")
        others = [copy.copy(first), copy.deepcopy(first), resumed]
        expected = self.lines_of(self.take(first, self.readings[half:]))
        for other in others:
            self.assertEqual(self.lines_of(self.take(other, self.readings[half:])), expected)
        with self.assertRaises(ValueError):
            trundle.Odometer(self.robot, probability=0.02).resume(self.folder / "state")

    def test_a_reading_that_does_not_suit_is_left_out(self):
        odometer = trundle.Odometer(self.robot)
        odometer.add(0.0, {"left_ticks": 0, "right_ticks": 0})
        with self.assertRaises(ValueError):
            odometer.add(0.02, {"middle_ticks": 0})


class Smoother(unittest.TestCase):
    def test_same_poses_as_slam(self):
        robot = trundle.Robot(ROBOT)
        for unknown in (False, True):
            whole = trundle.slam(TOUR, robot, filter="smoother", unknown_ids=unknown)
            smoother = trundle.IncrementalSmoother(robot)
            steps = trundle.steps(TOUR, robot, unknown_ids=unknown)
            self.assertEqual(len(steps), len(whole.online))
            for i, step in enumerate(steps):
                smoother.step(step)
                self.assertEqual((smoother.pose.x_m, smoother.pose.y_m), (whole.online.x_m[i], whole.online.y_m[i]))
            numpy.testing.assert_array_equal(smoother.covariance, whole.online.covariance[-1])
            self.assertEqual(len(smoother.landmarks), len(whole.landmarks))
            if not unknown:
                self.assertEqual(set(smoother.landmarks), set(whole.landmarks))
                place, covariance = smoother.landmarks[whole.landmarks[0]]
                numpy.testing.assert_array_equal(place, whole.positions[0])
                self.assertEqual(covariance.shape, (2, 2))

    def test_motions_and_sightings_of_one_s_own(self):
        smoother = trundle.IncrementalSmoother(trundle.Robot(ROBOT), start=(1.0, 0.0, 90.0))
        noise = numpy.diag([1e-4, 1e-4, 1e-5])
        for _ in range(10):
            reports = smoother.add(trundle.Pose(0.1, 0.0, 0.0), noise, [("post", 2.0, 0.0), (None, 1.5, 1.0)])
        self.assertEqual([r.decision for r in reports][0], "matched" if reports[0].nis < 13 else "rejected")
        self.assertIn("post", smoother.landmarks)
        self.assertEqual(smoother.map_covariance().shape, (2 * len(smoother.landmarks),) * 2)
        with self.assertRaisesRegex(ValueError, "landmark_sensor"):
            trundle.IncrementalSmoother(trundle.Robot("data/umbmark/robot.toml"))


if __name__ == "__main__":
    unittest.main()
