"""Tables, figures and notebooks' HTML of every result."""

import unittest

import trundle
from common import DEMO, ROBOT, TOUR, WithFolder, missing

try:
    import matplotlib.pyplot
    import numpy
    import pandas
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-pandas python3-matplotlib") from error


class Presentation(WithFolder):
    def results(self):
        tour = trundle.Recording(TOUR)
        odometry = trundle.odometry(tour, ROBOT)
        slam = trundle.slam(tour, ROBOT, filter="ekf")
        yield tour
        yield odometry.trajectory
        yield odometry
        yield trundle.calibrate(f"{DEMO}/session_01", ROBOT, hold_out=tour)
        yield trundle.slip(f"{DEMO}/slip", ROBOT)
        yield slam
        yield trundle.slam_together([f"{DEMO}/session_02/tour", tour], ROBOT, filter="ekf")
        yield trundle.merge([slam, slam])
        yield trundle.localize(tour, ROBOT, slam)
        yield trundle.evaluate(odometry, tour)
        yield trundle.run(f"{DEMO}/slip", ROBOT, self.folder / "run", filter="ekf")
        yield trundle.install_angle(side_m=2, ends=[(1.998, 1.931), (2.001, 1.935)])
        yield trundle.report(self.folder / "run")

    def test_every_result_has_a_table_a_figure_and_html(self):
        for result in self.results():
            with self.subTest(type(result).__name__):
                table = result.to_pandas()
                self.assertIsInstance(table, pandas.DataFrame)
                self.assertGreater(len(table), 0)
                figures = len(matplotlib.pyplot.get_fignums())
                axes = result.plot()
                self.assertEqual(len(matplotlib.pyplot.get_fignums()), figures + 1)
                self.assertGreater(len(axes.lines) + len(axes.patches) + len(axes.containers), 0)
                axes.figure.savefig(self.folder / "figure.png")
                again = result.plot(axes)
                self.assertIs(again, axes)
                matplotlib.pyplot.close(axes.figure)
                self.assertIn("<", result._repr_html_())
                self.assertIsInstance(result.to_dict() if hasattr(result, "to_dict") else {}, dict)
                self.assertLess(len(repr(result)), 300)

    def test_tables_have_the_columns_of_files(self):
        found = trundle.odometry(TOUR, ROBOT)
        found.save(self.folder / "trajectory.csv")
        pandas.testing.assert_frame_equal(found.to_pandas(), pandas.read_csv(self.folder / "trajectory.csv", comment="#",
                                                                             float_precision="round_trip"))
        slip = trundle.slip(f"{DEMO}/slip", ROBOT)
        slip.save(self.folder / "slip.csv")
        table = slip.to_pandas()
        written = pandas.read_csv(self.folder / "slip.csv", comment="#", float_precision="round_trip")
        self.assertEqual(list(table.columns), list(written.columns))
        # A slip's confidence is written with four digits, all other numbers with six.
        pandas.testing.assert_frame_equal(table, written.assign(confidence=table["confidence"]), rtol=0.0, atol=5e-7)
        pandas.testing.assert_series_equal(table["confidence"], written["confidence"], rtol=0.0, atol=5e-5)

    def test_figures_draw_the_numbers(self):
        tour = trundle.Recording(TOUR)
        odometry = trundle.odometry(tour, ROBOT)
        slip = trundle.slip(f"{DEMO}/slip", ROBOT)
        slam = trundle.slam(tour, ROBOT, filter="ekf")
        angle = trundle.install_angle(side_m=2, ends=[(1.998, 1.931), (2.001, 1.935)])
        gyro = trundle.Recording.from_arrays("turn", gyro={"time_s": [0.0, 0.1], "yaw_rate_rad_s": [0.2, 0.3]})
        for result, x, y in (
            (odometry, odometry.trajectory.x_m, odometry.trajectory.y_m),
            (slam, slam.trajectory.x_m, slam.trajectory.y_m),
            (tour, tour.reference["x_m"], tour.reference["y_m"]),
            (slip, slip.end_s, slip.statistic),
            (angle, [1, 2], numpy.degrees(angle.run_alpha_rad)),
            (gyro, [0.0, 0.1], [0.2, 0.3]),
        ):
            with self.subTest(repr(result)):
                line = result.plot().lines[0]
                numpy.testing.assert_array_equal(line.get_xdata(), x)
                numpy.testing.assert_array_equal(line.get_ydata(), y)
        evaluation = trundle.evaluate(odometry, tour)
        self.assertEqual([bar.get_height() for bar in evaluation.plot().patches],
                         [error.translation_rms_m for error in evaluation.relative if error.pairs > 0])
        calibration = trundle.calibrate(f"{DEMO}/session_01", ROBOT)
        moved = [(p.value - p.nominal) / p.sigma for p in calibration.parameters if p.observable]
        numpy.testing.assert_array_equal(calibration.plot().lines[0].get_xdata(), moved)
        run = trundle.run(f"{DEMO}/slip", ROBOT, self.folder / "run", filter="ekf")
        self.assertEqual([bar.get_width() for bar in run.plot().patches],
                         [error.rms_m for error in run.errors if error.alignment == run.errors[0].alignment])
        page = trundle.report(self.folder / "run")
        drawn = {line.get_label().split(": ")[1]: line for line in page.plot().lines}
        self.assertEqual(len(drawn), len(page.to_pandas()))
        reference = trundle.Recording(f"{DEMO}/slip").reference
        self.assertAlmostEqual(drawn["reference"].get_xdata()[-1], reference["x_m"][-1], places=5)
        self.assertAlmostEqual(drawn["reference"].get_ydata()[-1], reference["y_m"][-1], places=5)
        matplotlib.pyplot.close("all")

    def test_html_has_the_numbers(self):
        calibration = trundle.calibrate(f"{DEMO}/session_01", ROBOT, hold_out=TOUR)
        slip = trundle.slip(f"{DEMO}/slip", ROBOT)
        evaluation = trundle.evaluate(trundle.odometry(TOUR, ROBOT), TOUR)
        angle = trundle.install_angle(side_m=2, ends=[(1.998, 1.931), (2.001, 1.935)])
        run = trundle.run(f"{DEMO}/slip", ROBOT, self.folder / "run", filter="ekf")
        recording = trundle.Recording.from_arrays(gyro={"time_s": [0.0, 0.1, 0.1], "yaw_rate_rad_s": [0.0, 0.0, 0.0]})
        for result, cells in (
            (calibration, [f"{p.value:.8g}" for p in calibration.parameters] + [f"{e.after:.5g}" for e in calibration.errors]),
            (slip, [f"{event.excess_m:.4f}" for event in slip.events]),
            (evaluation, [f"{e.translation_rms_m:.4f} m" for e in evaluation.relative if e.pairs > 0]),
            (angle, [f"{alpha:.4f}" for alpha in numpy.degrees(angle.run_alpha_rad)]),
            (run, [stage.name for stage in run.stages]),
            (recording, [finding.place for finding in recording.findings]),
        ):
            with self.subTest(repr(result)):
                self.assertGreater(len(cells), 0)
                html = result._repr_html_()
                for cell in cells:
                    self.assertIn(f"<td>{cell}</td>", html)

    def test_html_shows_text_as_text(self):
        recording = trundle.Recording.from_arrays("<script>", gyro={"time_s": [0.0, 0.1], "yaw_rate_rad_s": [0.0, 0.0]})
        self.assertNotIn("<script>", recording._repr_html_())

    def test_a_page_in_a_notebook(self):
        trundle.slip(f"{DEMO}/slip", ROBOT).save(self.folder / "slip.csv")
        page = trundle.report(self.folder)
        self.assertTrue(page._repr_html_().startswith("<iframe srcdoc="))


if __name__ == "__main__":
    unittest.main()
