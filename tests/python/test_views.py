"""Arrays show the memory of results: no number is copied, none can be written, and none is freed too early."""

import gc
import unittest

import numpy
import trundle
from common import ROBOT, TOUR


def address(array):
    return array.__array_interface__["data"][0]


class Views(unittest.TestCase):
    def assert_is_view(self, owner, read, strided=False):
        """Two looks show one memory; it is not the array's own, and it is read-only."""
        first, second = read(owner), read(owner)
        self.assertGreater(first.size, 0)
        self.assertEqual(address(first), address(second))
        self.assertIs(first.base, owner)
        self.assertFalse(first.flags.owndata)
        self.assertFalse(first.flags.writeable)
        with self.assertRaises(ValueError):
            first[...] = 0.0
        if strided:
            self.assertNotEqual(first.strides[0], first.itemsize)

    def test_trajectory_is_columns_of_its_poses(self):
        trajectory = trundle.odometry(TOUR, ROBOT).trajectory
        for name in ("time_s", "x_m", "y_m", "heading_rad"):
            self.assert_is_view(trajectory, lambda t, name=name: getattr(t, name), strided=True)
        self.assert_is_view(trajectory, lambda t: t.covariance)
        # One pose is time, x, y and heading, 8 bytes each.
        start = address(trajectory.time_s)
        self.assertEqual([address(c) - start for c in (trajectory.x_m, trajectory.y_m, trajectory.heading_rad)], [8, 16, 24])
        self.assertEqual(trajectory.x_m.strides, (32,))
        self.assertEqual(trajectory.covariance.strides[0], 72)

    def test_a_trajectory_of_a_result_is_the_result_s(self):
        found = trundle.odometry(TOUR, ROBOT)
        self.assertEqual(address(found.trajectory.x_m), address(found.trajectory.x_m))
        self.assert_is_view(found, lambda f: f.end_covariance)
        self.assert_is_view(found, lambda f: f.gyro_bias_rad_s, strided=True)

    def test_streams_of_a_recording(self):
        recording = trundle.Recording(TOUR)
        self.assert_is_view(recording, lambda r: r.wheels["left_ticks"])
        self.assert_is_view(recording, lambda r: r.gyro["yaw_rate_rad_s"])
        self.assert_is_view(recording, lambda r: r.reference["x_m"])
        self.assert_is_view(recording, lambda r: r.sightings["range_m"], strided=True)

    def test_slam_slip_and_calibration(self):
        found = trundle.slam(TOUR, ROBOT, filter="ekf")
        self.assert_is_view(found, lambda f: f.positions, strided=True)
        self.assert_is_view(found, lambda f: f.position_covariances)
        self.assert_is_view(found, lambda f: f.map_covariance)
        self.assert_is_view(found, lambda f: f.sightings, strided=True)
        block = found.map_covariance[2:4, 2:4]
        numpy.testing.assert_array_equal(block[numpy.triu_indices(2)],
                                         found.position_covariances[1][numpy.triu_indices(2)])
        slip = trundle.slip("data/demo/slip", ROBOT)
        self.assert_is_view(slip, lambda f: f.statistic, strided=True)
        self.assert_is_view(slip, lambda f: f.slipping, strided=True)
        self.assert_is_view(trundle.calibrate("data/demo/session_01", ROBOT), lambda f: f.covariance)

    def test_an_array_outlives_its_result(self):
        x = trundle.odometry(TOUR, ROBOT).trajectory.x_m
        wheels = trundle.Recording(TOUR).wheels
        again = trundle.odometry(TOUR, ROBOT).trajectory.x_m.copy()
        gc.collect()
        _ = [trundle.odometry(TOUR, ROBOT) for _ in range(5)]  # who would reuse memory that was freed
        numpy.testing.assert_array_equal(x, again)
        numpy.testing.assert_array_equal(wheels["left_ticks"], trundle.Recording(TOUR).wheels["left_ticks"])

    def test_nothing_is_there_of_an_empty_stream(self):
        recording = trundle.Recording.from_arrays(gyro={"time_s": [0.0, 0.1], "yaw_rate_rad_s": [0.0, 0.0]})
        self.assertEqual(recording.wheels, {})
        self.assertEqual(recording.sightings, {})


if __name__ == "__main__":
    unittest.main()
