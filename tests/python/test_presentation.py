"""Tables, figures and notebooks' HTML of every result."""

import unittest

import trundle
from common import DEMO, ROBOT, TOUR, WithFolder

try:
    import matplotlib.pyplot
    import pandas
except ImportError as missing:
    raise unittest.SkipTest(f"{missing}: apt-get install python3-pandas python3-matplotlib") from missing


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
        yield trundle.localize(tour, ROBOT, slam)
        yield trundle.evaluate(odometry, tour)
        yield trundle.run(f"{DEMO}/slip", ROBOT, self.folder / "run", filter="ekf")

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

    def test_html_shows_text_as_text(self):
        recording = trundle.Recording.from_arrays("<script>", gyro={"time_s": [0.0, 0.1], "yaw_rate_rad_s": [0.0, 0.0]})
        self.assertNotIn("<script>", recording._repr_html_())

    def test_a_page_in_a_notebook(self):
        trundle.slip(f"{DEMO}/slip", ROBOT).save(self.folder / "slip.csv")
        page = trundle.report(self.folder)
        self.assertTrue(page._repr_html_().startswith("<iframe srcdoc="))


if __name__ == "__main__":
    unittest.main()
