"""Recordings of arrays are those of files, faults included."""

import copy
import csv
import inspect
import pickle
import unittest

import numpy
import trundle
from common import DEMO, ROBOT, TOUR, WithFolder, missing

STREAMS = ("wheels", "gyro", "sightings", "reference")


def streams_of(recording):
    return {name: getattr(recording, name) for name in STREAMS}


class FromArrays(WithFolder):
    def setUp(self):
        super().setUp()
        self.file = trundle.Recording(TOUR)

    def test_gives_the_same_odometry_and_map(self):
        arrays = trundle.Recording.from_arrays("tour", **streams_of(self.file))
        for compute in (lambda r: trundle.odometry(r, ROBOT), lambda r: trundle.slip(r, ROBOT),
                        lambda r: trundle.slam(r, ROBOT, filter="ekf")):
            mine, theirs = compute(arrays), compute(self.file)
            numpy.testing.assert_array_equal(mine.trajectory.x_m, theirs.trajectory.x_m)
            numpy.testing.assert_array_equal(mine.trajectory.covariance, theirs.trajectory.covariance)
        mine, theirs = (trundle.calibrate([r], ROBOT) for r in (arrays, self.file))
        numpy.testing.assert_array_equal(mine.covariance, theirs.covariance)
        self.assertEqual([p.value for p in mine.parameters], [p.value for p in theirs.parameters])

    def test_learns_from_arrays(self):
        clean = trundle.Recording("data/demo/session_01/straight")
        arrays = trundle.Recording.from_arrays("straight", wheels=clean.wheels, gyro=clean.gyro)
        for given in (arrays, [clean]):
            mine, theirs = (trundle.slip("data/demo/slip", ROBOT, learn=l) for l in (given, "data/demo/session_01/straight"))
            self.assertEqual(mine.limit, theirs.limit)
            numpy.testing.assert_array_equal(mine.statistic, theirs.statistic)

    def test_data_frames_and_other_types(self):
        pandas = self.pandas()
        wheels = pandas.read_csv(f"{TOUR}/wheels.csv", comment="#")
        gyro = pandas.read_csv(f"{TOUR}/gyro.csv", comment="#").to_records(index=False)
        wheels["note"] = "not a number"
        recording = trundle.Recording.from_arrays(wheels=wheels.astype({"left_ticks": "int32"}), gyro=gyro)
        numpy.testing.assert_array_equal(recording.wheels["left_ticks"], self.file.wheels["left_ticks"])
        numpy.testing.assert_array_equal(recording.gyro["yaw_rate_rad_s"], self.file.gyro["yaw_rate_rad_s"])

    def pandas(self):
        try:
            import pandas
        except ImportError as error:
            raise missing(f"{error}: apt-get install python3-pandas") from error
        return pandas

    def test_landmarks_and_unknown_ones(self):
        recording = trundle.Recording.from_arrays(
            sightings={"time_s": [0.0, 1.0, 2.0], "landmark": ["a", None, float("nan")], "range_m": [1.0, 2.0, 3.0],
                       "bearing_rad": [0.0, 0.1, 0.2]},
            landmarks={"landmark": ["a"], "x_m": [1.0], "y_m": [2.0]})
        self.assertEqual(recording.sightings["landmark"], ["a", "", ""])
        self.assertEqual(recording.landmarks, {"a": (1.0, 2.0)})

    def test_what_is_wrong_with_rows_is_found_as_in_a_file(self):
        time_s = numpy.arange(100) * 0.02
        ticks = numpy.arange(100.0)
        time_s[50], ticks[70] = time_s[49], numpy.inf
        recording = trundle.Recording.from_arrays(wheels={"time_s": time_s, "left_ticks": ticks, "right_ticks": ticks})
        with open(self.folder / "wheels.csv", "w", newline="") as file:
            csv.writer(file).writerows([["time_s", "left_ticks", "right_ticks"], *zip(time_s, ticks, ticks)])
        same = trundle.Recording(self.folder)
        self.assertEqual([(f.kind, f.count) for f in recording.findings], [(f.kind, f.count) for f in same.findings])
        self.assertIn("wheels:51", [f.place for f in recording.findings])
        numpy.testing.assert_array_equal(recording.wheels["time_s"], same.wheels["time_s"])

    def test_errors_name_the_stream_and_the_column(self):
        for streams, line in (
            ({"wheel": {"time_s": [0.0]}}, "wheel: is no stream of a recording; expected one of wheels, gyro"),
            ({"wheels": {"time_s": [0.0]}}, "wheels: has no column of a wheel; expected <wheel>_ticks"),
            ({"gyro": {"time_s": [0.0]}}, "gyro: has no column 'yaw_rate_rad_s'"),
            ({"gyro": {"time_s": [0.0], "yaw_rate_rad_s": [0.0, 1.0]}}, "gyro: column 'yaw_rate_rad_s' has 2 rows"),
            ({"gyro": {"time_s": [0.0], "yaw_rate_rad_s": [1e12]}}, "gyro:1: yaw_rate_rad_s is 1000000000000"),
            ({"gyro": {"time_s": [0.0], "yaw_rate_rads": ["x"]}},
             "gyro: has no column 'yaw_rate_rad_s'; expected 'yaw_rate_rad_s' in place of 'yaw_rate_rads'"),
            ({"gyro": {"t": [0.0], "rate": [0.0]}}, "gyro: has no column 'time_s'; expected it among "),
            ({}, "recording: holds no samples"),
        ):
            with self.subTest(line), self.assertRaises(ValueError) as caught:
                trundle.Recording.from_arrays(**streams)
            self.assertTrue(str(caught.exception).startswith(line), str(caught.exception))

    def test_values_that_are_no_numbers_are_named(self):
        time_s = [0.0, 0.02, 0.04]
        dates = numpy.array(["2024-05-01"] * 3, dtype="datetime64[ns]")
        for values, line in (
            ([0, "a", 2], "wheels:2: left_ticks is 'a'; expected a number"),
            ([0, 1, object], "wheels:3: left_ticks is <class 'object'>; expected a number"),
            ([0, 10**400, 2], f"wheels:2: left_ticks is 1{'0' * 39}…; expected a number"),
            ([[0, 1], [2, 3], [4, 5]], "wheels: column 'left_ticks' is an array of 2 axes; expected an array of one axis"),
            (7, "wheels: column 'left_ticks' is an array of 0 axes; "),
            (dates, "wheels: column 'left_ticks' is of type datetime64[ns]; expected numbers"),
            (dates - dates, "wheels: column 'left_ticks' is of type timedelta64[ns]; expected numbers"),
            (2**60 + numpy.arange(3), f"wheels:1: left_ticks is {2**60}; expected at most ±{2**53}: subtract the first"),
            ([0, 1, 2**70], f"wheels:3: left_ticks is {2**70}; expected at most ±{2**53}"),
        ):
            with self.subTest(line), self.assertRaises(ValueError) as caught:
                trundle.Recording.from_arrays(wheels={"time_s": time_s, "left_ticks": values, "right_ticks": time_s})
            self.assertTrue(str(caught.exception).startswith(line), str(caught.exception))

    def test_masked_and_missing_values_are_not_measured(self):
        pandas = self.pandas()
        time_s = numpy.arange(3) * 0.02
        expected = [0.0, numpy.nan, 2.0]
        for values in (numpy.ma.masked_equal([0, -99999, 2], -99999), numpy.ma.masked_equal([0.0, -99999.0, 2.0], -99999.0),
                       pandas.Series([0, None, 2], dtype="Int64"), [0, None, 2], ["0", "nan", "2"], [0, numpy.inf, 2]):
            recording = trundle.Recording.from_arrays(reference={"time_s": time_s, "x_m": time_s, "y_m": time_s, "heading_rad": values})
            numpy.testing.assert_array_equal(recording.reference["heading_rad"], expected)
        for names in (["a", pandas.NA, "b"], ["a", float("nan"), "b"], numpy.ma.masked_equal(["a", "?", "b"], "?")):
            recording = trundle.Recording.from_arrays(
                sightings={"time_s": time_s, "landmark": names, "range_m": time_s + 1.0, "bearing_rad": time_s})
            self.assertEqual(recording.sightings["landmark"], ["a", "", "b"])

    def test_a_stream_without_columns_is_a_type_error(self):
        for stream, kind in (([0.0, 1.0], "list"), (numpy.zeros((3, 3)), "ndarray"), (3, "int")):
            with self.assertRaisesRegex(TypeError, f"^wheels: is of type {kind}; expected columns by name: "):
                trundle.Recording.from_arrays(wheels=stream)

    def test_its_signature(self):
        parameters = list(inspect.signature(trundle.Recording.from_arrays).parameters)
        self.assertEqual(parameters, ["name", "wheels", "gyro", "velocity", "commands", "accel", "sightings", "reference",
                                      "relative", "landmarks"])
        with self.assertRaises(ValueError) as caught:
            trundle.Recording.from_arrays(wheel={})
        named = str(caught.exception).split("expected one of ")[1].split(", ")
        self.assertEqual(sorted(named), sorted(parameters[1:]))

    def test_copies_are_itself(self):
        self.assertIs(copy.copy(self.file), self.file)
        self.assertIs(copy.deepcopy([self.file])[0], self.file)

    def test_saved_and_read_again(self):
        self.file.save(self.folder / "copy")
        again = trundle.Recording(self.folder / "copy")
        for name in STREAMS:
            for column, values in getattr(self.file, name).items():
                numpy.testing.assert_array_equal(getattr(again, name)[column], values)

    def test_what_recording_toml_said_is_saved_with_it(self):
        slip = trundle.Recording(f"{DEMO}/slip")
        found = trundle.odometry(slip, ROBOT)
        expected = trundle.evaluate(found, slip).to_dict()
        self.assertEqual(expected["reference_noise"]["position_sigma_m"], 0.001)
        slip.save(self.folder / "copy")
        for reference in (self.folder / "copy", trundle.Recording(self.folder / "copy")):
            again = trundle.evaluate(found, reference).to_dict()
            self.assertEqual([again[name] for name in ("reference_noise", "nees", "position_m")],
                             [expected[name] for name in ("reference_noise", "nees", "position_m")])
        place = self.folder / "team"
        place.mkdir()
        (place / "recording.toml").write_text(
            'time_origin = 1494449900\nseen_as = "me"\nrobots = ["you"]\n[wheels]\nfile = "counts.csv"\n'
            'columns.time_s = "time_s"\ncolumns.left_ticks = "left_ticks"\ncolumns.right_ticks = "right_ticks"\n'
            '[reference]\nclosed = true\n')
        (place / "counts.csv").write_text("time_s,left_ticks,right_ticks\n1494449900.5,0,0\n1494449901.5,9,9\n")
        (place / "sightings.csv").write_text("time_s,landmark,range_m,bearing_rad\n0.5,you,2.0,0.1\n0.6,tree,3.0,0.2\n")
        trundle.Recording(place).save(self.folder / "again")
        said = (self.folder / "again/recording.toml").read_text().splitlines()
        self.assertEqual(said[1:5], ["time_origin = 1494449900", 'seen_as = "me"', 'robots = ["you"]', "[reference]"])
        again = trundle.Recording(self.folder / "again")
        self.assertEqual(list(again.wheels["time_s"]), [0.5, 1.5])
        self.assertEqual(list(again.sightings["landmark"]), ["tree"])
        self.assertIn("sighting of a robot", [finding.kind for finding in again.findings])
        again.save(self.folder / "third")
        for name in ("recording.toml", "sightings.csv", "wheels.csv"):
            self.assertEqual((self.folder / "third" / name).read_text(), (self.folder / "again" / name).read_text())

    def test_below(self):
        self.assertEqual([r.name for r in trundle.Recording.below("data/demo/session_01")],
                         ["square_ccw_01", "square_ccw_02", "square_cw_01", "square_cw_02", "straight", "tour"])

    def test_robots(self):
        robot = trundle.Robot(ROBOT)
        self.assertEqual(robot.wheels, ["left", "right"])
        larger = robot.with_parameters({"left.diameter": 0.2})
        self.assertEqual((robot.parameters["left.diameter"], larger.parameters["left.diameter"]), (0.1, 0.2))
        self.assertEqual(trundle.Robot.parse(larger.to_toml()).parameters, larger.parameters)
        again = pickle.loads(pickle.dumps(larger))
        self.assertEqual((again.to_toml(), again.path), (larger.to_toml(), larger.path))
        with self.assertRaisesRegex(ValueError, "has no parameter 'left.diametre'; expected 'left.diameter'"):
            robot.with_parameters({"left.diametre": 0.2})


if __name__ == "__main__":
    unittest.main()
