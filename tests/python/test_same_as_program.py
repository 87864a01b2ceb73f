"""On the bundled recordings every function gives what its command does: the same bytes in files, the same
documents, and arrays with the bits of the files' numbers."""

import csv
import json
import unittest
from pathlib import Path

import numpy
import trundle
from common import DEMO, ROBOT, TOUR, WithFolder, document_of, program


def columns_of(path):
    with open(path, newline="") as lines:
        rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}


class SameAsProgram(WithFolder):
    def assert_same_document(self, result, *arguments):
        self.assertEqual(result.to_dict(), document_of(*arguments))

    def test_odometry(self):
        for options, named in (([], {}), (["--start", "1,2,90"], {"start": (1, 2, 90)}), (["--smooth"], {"smooth": True})):
            arguments = ["odometry", TOUR, "--robot", ROBOT, *options]
            found = trundle.odometry(TOUR, ROBOT, **named)
            self.assert_same_document(found, *arguments)
            for name in ("trajectory.csv", "trajectory.tum"):
                program(*arguments, "-o", self.theirs / name)
                found.save(self.ours / name)
            self.assert_same_files()

    def test_arrays_have_the_bits_of_the_file(self):
        program("odometry", TOUR, "--robot", ROBOT, "-o", self.theirs / "trajectory.csv")
        written = {name: numpy.array(cells, float) for name, cells in columns_of(self.theirs / "trajectory.csv").items()}
        trajectory = trundle.odometry(TOUR, ROBOT).trajectory
        for name in ("time_s", "x_m", "y_m", "heading_rad"):
            numpy.testing.assert_array_equal(getattr(trajectory, name), written[name])
        for i, row in enumerate("xyh"):
            for j, column in enumerate("xyh"[i:], i):
                numpy.testing.assert_array_equal(trajectory.covariance[:, i, j], written[f"var_{row}{column}"])
        read = trundle.Trajectory(self.theirs / "trajectory.csv")
        numpy.testing.assert_array_equal(read.x_m, trajectory.x_m)

    def test_slip(self):
        clean = f"{DEMO}/session_01/straight"
        for options, named in (([], {}), (["--learn", clean], {"learn": clean}),
                               (["--method", "published", "--probability", "0.05", "--learn", clean],
                                {"method": "published", "probability": 0.05, "learn": [clean]})):
            arguments = ["slip", f"{DEMO}/slip", "--robot", ROBOT, *options]
            program(*arguments, "-o", self.theirs / "slip.csv", "--corrected", self.theirs / "corrected.csv")
            found = trundle.slip(f"{DEMO}/slip", ROBOT, **named)
            found.save(self.ours / "slip.csv", corrected=self.ours / "corrected.csv")
            self.assert_same_files()
            self.assert_same_document(found, *arguments)

    def test_calibrate(self):
        for options, named in (([], {}), (["--hold-out", TOUR], {"hold_out": TOUR}),
                               (["--fix", "track", "--free", "reference.x"], {"fix": ["track"], "free": ["reference.x"]}),
                               (["--learn-noise"], {"learn_noise": True})):
            # Two sessions take three times as long as one.
            runs = [f"{DEMO}/session_01"] if options else [f"{DEMO}/session_01", f"{DEMO}/session_02"]
            found = trundle.calibrate(runs, ROBOT, **named)
            found.save(self.ours / "calibrated.toml", export="ros2_control")
            self.assert_same_document(found, "calibrate", *runs, "--robot", ROBOT, *options, "-o",
                                      self.theirs / "calibrated.toml", "--export", "ros2_control")
            self.assert_same_files()

    def test_calibrated_robot_is_that_of_its_file(self):
        found = trundle.calibrate(f"{DEMO}/session_01", ROBOT)
        found.save(self.ours / "calibrated.toml")
        read = trundle.Robot(self.ours / "calibrated.toml")
        self.assertEqual(found.robot.parameters, read.parameters)
        before, after = trundle.odometry(TOUR, found.robot), trundle.odometry(TOUR, read)
        numpy.testing.assert_array_equal(before.trajectory.covariance, after.trajectory.covariance)

    def test_slam(self):
        for method in ("fastslam1", "fastslam2", "mapso", "mapso_proposal", "ekf", "smoother"):
            with self.subTest(method):
                options = ["--filter", method, "--seed", "7", "--particles", "20"]
                program("slam", TOUR, "--robot", ROBOT, *options, "-o", self.theirs)
                found = trundle.slam(TOUR, ROBOT, filter=method, seed=7, particles=20)
                found.save(self.ours)
                self.assert_same_files()
                self.assertEqual(found.to_dict(), json.loads((self.theirs / "slam.json").read_text()))

    def test_smooth(self):
        program("slam", TOUR, "--robot", ROBOT, "--smooth", "--unknown-ids", "--correct-slip", "-o", self.theirs)
        trundle.smooth(TOUR, ROBOT, unknown_ids=True, correct_slip=True).save(self.ours)
        self.assert_same_files()

    def test_slam_in_a_window_stored_and_taken_up(self):
        state, ours = self.folder / "slam.state", self.folder / "ours.state"
        options = ["slam", TOUR, "--robot", ROBOT, "--window", "20"]
        program(*options, "--checkpoint", state, "-o", self.theirs)
        trundle.slam(TOUR, ROBOT, window=20.0, checkpoint=ours).save(self.ours)
        self.assert_same_files()
        self.assertEqual(ours.read_bytes(), state.read_bytes())
        trundle.slam(TOUR, ROBOT, window=20.0, resume=state).save(self.ours)
        self.assert_same_files()
        with self.assertRaisesRegex(ValueError, "^window: is given with filter 'ekf'; expected filter 'smoother'$"):
            trundle.slam(TOUR, ROBOT, filter="ekf", window=20.0)
        with self.assertRaisesRegex(ValueError, "^checkpoint_every_s: is given without checkpoint; "):
            trundle.slam(TOUR, ROBOT, checkpoint_every_s=60.0)

    def test_slam_together(self):
        tours = [f"{DEMO}/session_02/tour", TOUR]
        program("slam", *tours, "--robot", ROBOT, "--together", "--marker-sigma", "0.05", "--filter", "ekf", "-o", self.theirs)
        for recordings, robot in ((tours, ROBOT), ([trundle.Recording(t) for t in tours], [trundle.Robot(ROBOT), ROBOT])):
            found = trundle.slam_together(recordings, robot, marker_sigma=0.05, filter="ekf")
            found.save(self.ours)
            self.assert_same_files()
            self.assertEqual(found.to_dict(), json.loads((self.theirs / "slam.json").read_text()))
        self.assertEqual(list(found.trajectories), ["tour", "tour_2"])
        written = trundle.Trajectory(self.theirs / "tour_2/trajectory.csv")
        numpy.testing.assert_array_equal(found.trajectories["tour_2"].x_m, written.x_m)
        with self.assertRaisesRegex(ValueError, "^robot: is given 3 times for 2 recordings; expected one for all, or one for each$"):
            trundle.slam_together(tours, [ROBOT] * 3)
        with self.assertRaisesRegex(ValueError, "^recordings: are 1; "):
            trundle.slam_together([TOUR], ROBOT)

    def test_robots_in_the_folders_of_their_recordings(self):
        for session in ("session_02", "session_03"):
            trundle.Recording(f"{DEMO}/{session}/tour").save(self.folder / session)
            trundle.Robot(ROBOT).save(self.folder / session / "robot.toml")
        tours = [self.folder / "session_02", self.folder / "session_03"]
        program("slam", *tours, "--together", "-o", self.theirs)
        trundle.slam_together(tours).save(self.ours)
        self.assert_same_files()

    def test_merge(self):
        maps = [self.folder / "a", self.folder / "b"]
        found = [trundle.slam(tour, ROBOT, filter="ekf") for tour in (f"{DEMO}/session_02/tour", TOUR)]
        for one, place in zip(found, maps):
            one.save(place)
        for options, named in (([], {}), (["--unknown-ids"], {"unknown_ids": True})):
            program("merge", *maps, *options, "-o", self.theirs)
            merged = trundle.merge(maps, **named)
            merged.save(self.ours)
            self.assert_same_files()
            self.assertEqual(merged.to_dict(), json.loads((self.theirs / "merge.json").read_text()))
        in_memory = trundle.merge(found, unknown_ids=True)
        numpy.testing.assert_array_equal(in_memory.positions, merged.positions)
        numpy.testing.assert_array_equal(in_memory.map_covariance, merged.map_covariance)
        numpy.testing.assert_array_equal(merged.map_covariance[2:4, 2:4], merged.position_covariances[1])
        self.assertEqual([frame.x_m for frame in merged.frames], [frame["x_m"] for frame in merged.to_dict()["frames"]])
        self.assertEqual(merged.frame_covariances[1][0, 0] ** 0.5, merged.to_dict()["frames"][1]["sigma"]["x_m"])
        with self.assertRaisesRegex(ValueError, "^maps: are 1; expected two at least$"):
            trundle.merge(found[0])

    def test_init(self):
        place = self.folder / "drafts"
        document = document_of("init", f"{DEMO}/slip", "-o", place)
        place.rename(self.theirs / "drafts")
        found = trundle.init(f"{DEMO}/slip", place)
        self.assertEqual(found.to_dict(), document)
        self.assertEqual((found.files, found.to_fill_in), (document["files"], document["to_fill_in"]))
        place.rename(self.ours / "drafts")
        self.assert_same_files()

    def test_localize(self):
        found = trundle.slam(f"{DEMO}/session_02/tour", ROBOT, filter="ekf")
        found.save(self.folder / "map")
        map = self.folder / "map/landmarks.csv"
        for options, named in (([], {}), (["--filter", "ekf", "--start", "0,0,0"], {"filter": "ekf", "start": (0, 0, 0)})):
            program("localize", TOUR, "--robot", ROBOT, "--map", map, *options, "-o", self.theirs / "localized.csv",
                    "--steps", self.theirs / "steps.csv", "--innovations", self.theirs / "innovations.csv")
            trundle.localize(TOUR, ROBOT, map, **named).save(
                self.ours / "localized.csv", steps=self.ours / "steps.csv", innovations=self.ours / "innovations.csv")
            self.assert_same_files()

    def test_a_map_that_was_never_written(self):
        slam = trundle.slam(f"{DEMO}/session_02/tour", ROBOT, filter="ekf")
        for kind, found in (("slam", slam), ("merge", trundle.merge([slam, slam]))):
            found.save(self.folder / kind)
            here = trundle.localize(TOUR, ROBOT, found)
            there = trundle.localize(TOUR, ROBOT, self.folder / kind / "landmarks.csv")
            numpy.testing.assert_array_equal(here.trajectory.x_m, there.trajectory.x_m)
            numpy.testing.assert_array_equal(here.trajectory.covariance, there.trajectory.covariance)

    def test_evaluate(self):
        program("odometry", TOUR, "--robot", ROBOT, "-o", self.folder / "trajectory.csv")
        estimate = self.folder / "trajectory.csv"
        for align in ("none", "start", "se2"):
            found = trundle.evaluate(estimate, TOUR, align=align, robot=ROBOT)
            self.assert_same_document(found, "evaluate", estimate, TOUR, "--align", align, "--robot", ROBOT)
            in_memory = trundle.evaluate(trundle.odometry(TOUR, ROBOT), trundle.Recording(TOUR), align=align, robot=ROBOT)
            self.assertEqual(in_memory.position_m.rms, found.position_m.rms)
            self.assertEqual(in_memory.to_dict()["nees"], found.to_dict()["nees"])

    def test_evaluate_a_reference_that_is_late(self):
        late = self.folder / "late"
        late.mkdir()
        for file in Path(TOUR).iterdir():
            (late / file.name).write_bytes(file.read_bytes())
        head, *rows = (late / "reference.csv").read_text().splitlines()
        moved = [f"{float(time_s) + 0.6!r},{rest}" for time_s, rest in (row.split(",", 1) for row in rows)]
        (late / "reference.csv").write_text("\n".join([head, *moved]) + "\n")
        program("odometry", TOUR, "--robot", ROBOT, "-o", self.folder / "trajectory.csv")
        estimate = self.folder / "trajectory.csv"
        for options, named in (([], {}), (["--robot", ROBOT], {"robot": ROBOT}),
                               (["--time-offset-s", "-0.6"], {"time_offset_s": -0.6})):
            found = trundle.evaluate(estimate, late, **named)
            self.assertAlmostEqual(found.time_offset_s, -0.6, delta=0.04)
            self.assert_same_document(found, "evaluate", estimate, late, *options)
            in_memory = trundle.evaluate(trundle.odometry(TOUR, ROBOT), trundle.Recording(late), **named)
            self.assertEqual(in_memory.position_m.rms, found.position_m.rms)

    def test_umbmark(self):
        for method in ("classic", "orientation", "ml"):
            arguments = ["umbmark", "data/umbmark/sheet.csv", "--robot", "data/umbmark/robot.toml", "--method", method]
            program(*arguments, "-o", self.theirs / "calibrated.toml")
            found = trundle.umbmark("data/umbmark/sheet.csv", "data/umbmark/robot.toml", method=method)
            found.save(self.ours / "calibrated.toml")
            self.assert_same_files()
            self.assert_same_document(found, *arguments)

    def test_install_angle(self):
        found = trundle.install_angle(side_m=2, ends=[(1.998, 1.931), (2.001, 1.935)], start_heading="each-run")
        arguments = ["install-angle", "--side-m", 2, "--end-x-m", 1.998, "--end-x-m", 2.001, "--end-y-m", 1.931,
                     "--end-y-m", 1.935, "--start-heading", "each-run"]
        self.assert_same_document(found, *arguments)
        found.save(self.ours / "angle.json")
        (self.theirs / "angle.json").write_text(program(*arguments, "--json").stdout)
        self.assert_same_files()

    def test_simulate(self):
        program("simulate", f"{DEMO}/slip.toml", "--seed", "5", "-o", self.theirs)
        runs = trundle.simulate(f"{DEMO}/slip.toml", self.ours, seed=5)
        self.assertEqual(len(runs), 1)
        self.assert_same_files()

    def test_run_and_report(self):
        arguments = ["run", f"{DEMO}/slip", "--robot", ROBOT, "--calibrate-on", f"{DEMO}/session_01", "--filter", "ekf"]
        place = self.folder / "results"
        program(*arguments, "-o", place)
        place.rename(self.theirs / "results")
        found = trundle.run(f"{DEMO}/slip", ROBOT, place, calibrate_on=f"{DEMO}/session_01", filter="ekf")
        self.assertEqual(found.to_dict(), json.loads((place / "run.json").read_text()))
        program("report", place, "-o", self.theirs / "page.html")
        trundle.report(place).save(self.ours / "page.html")
        place.rename(self.ours / "results")
        self.assert_same_files()

    def test_run_with_folders_of_messages(self):
        place = self.folder / "results"
        program("run", f"{DEMO}/slip", "--robot", ROBOT, "--msg-path", DEMO, "--filter", "ekf", "-o", place)
        theirs = json.loads((place / "run.json").read_text())
        found = trundle.run(f"{DEMO}/slip", ROBOT, place, msg_path=[DEMO], filter="ekf").to_dict()
        self.assertEqual(found, theirs)
        self.assertIn("msg-path", json.dumps(found))

    def test_objects_in_place_of_paths(self):
        robot, demo = trundle.Robot(ROBOT), trundle.Recording(f"{DEMO}/slip")
        self.assertEqual(demo.path, f"{DEMO}/slip")
        learn = trundle.Recording(f"{DEMO}/session_01/straight")
        by_path = trundle.run(f"{DEMO}/slip", ROBOT, self.theirs, learn=learn, filter="ekf")
        by_object = trundle.run(demo, robot, self.ours, learn=[f"{DEMO}/session_01/straight"], filter="ekf")
        self.assertEqual([s.status for s in by_object.stages], [s.status for s in by_path.stages])
        self.assertEqual([e.rms_m for e in by_object.errors], [e.rms_m for e in by_path.errors])
        squares = trundle.Recording.below(f"{DEMO}/session_01")[:4]
        for method in ("classic", "ml"):
            mine, theirs = (trundle.umbmark(runs, robot, side_m=2, method=method)
                            for runs in (squares, [f"{DEMO}/session_01/{square.name}" for square in squares]))
            self.assertEqual([p.value for p in mine.parameters], [p.value for p in theirs.parameters])
        arrays = trundle.Recording.from_arrays("squares", wheels=squares[0].wheels, gyro=squares[0].gyro, reference=squares[0].reference)
        self.assertEqual(arrays.path, "")
        by_arrays = trundle.run(arrays, robot, self.folder / "arrays", filter="ekf")
        by_path = trundle.run(squares[0].path, ROBOT, self.folder / "path", filter="ekf")
        self.assertEqual([e.rms_m for e in by_arrays.errors if e.trajectory == "odometry"],
                         [e.rms_m for e in by_path.errors if e.trajectory == "odometry"])
        mine, theirs = (trundle.report(self.ours / "odometry.csv", reference=reference, robot=given).to_dict()["results"][0]["errors"]
                        for reference, given in ((demo, robot), (f"{DEMO}/slip", ROBOT)))
        self.assertEqual(mine, theirs)

    def test_info(self):
        self.assertEqual(trundle.Recording(TOUR).to_dict(), document_of("info", TOUR))
        found = trundle.Recording(TOUR).info(trundle.Robot(ROBOT))
        self.assertEqual(found, document_of("info", TOUR, "--robot", ROBOT))


if __name__ == "__main__":
    unittest.main()
