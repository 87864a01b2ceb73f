"""The fleet page and what stands beside it, made of a database."""

import contextlib
import csv
import io
import json
import re
import tempfile
import unittest
import unittest.mock
from pathlib import Path

from common import ROBOT, WithFolder, missing

try:
    import sqlalchemy
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-sqlalchemy") from error

import fleet_page
from fleet_logs import make_logs
from trundle.fleet import needs, page, store, worker
from trundle.fleet.__main__ import main
from trundle.fleet.host import Limits

HOSTILE = '=1+1</script><script>"\\\n{{history}}'


def data_of(page, name):
    return json.loads(re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', page.read_text(), re.DOTALL).group(1))


def samples(text):
    """Of the text format of Prometheus: name and labels to value; each name has HELP and TYPE before it."""
    found, typed = {}, set()
    for line in text.splitlines():
        if line.startswith("# TYPE "):
            typed.add(line.split()[2])
        elif not line.startswith("#"):
            name, labels, value = re.fullmatch(r'(\w+)\{((?:\w+="(?:[^"\\\n]|\\["\\n])*",?)*)\} (\S+)', line).groups()
            assert name in typed, line
            found[f"{name}{{{labels}}}"] = float(value)
    return found


class Page(WithFolder):
    def test_same_database_same_bytes_and_one_truth_in_all_files(self):
        for folder in (self.ours, self.theirs):
            fleet_page.write(folder, 60, 6)
            (folder / "fleet.db").unlink()
        self.assert_same_files()
        data = data_of(self.ours / "fleet.html", "data")
        self.assertEqual((len(data["robots"]["name"]), len(data_of(self.ours / "fleet.html", "history"))), (60, 60))
        prom = samples((self.ours / "fleet.prom").read_text())
        self.assertEqual(prom['trundle_fleet_robots{type="husky"}'], 6)
        self.assertEqual(prom['trundle_fleet_attention_robots{reason="change"}'], sum("change" in of for of in data["robots"]["reasons"]))
        changes = list(csv.DictReader((self.ours / "changes.csv").open()))
        self.assertIn(("robot_00003", "left.diameter", "2026-01-26"), [(row["robot"], row["parameter"], row["since"]) for row in changes])
        [trend] = [row for row in changes if row["robot"] == "robot_00013"]
        self.assertEqual((trend["kind"], trend["since"], trend["step"], trend["sigma"], trend["slope_unit"]), ("trend", "2026-01-05", "", "", "m/year"))
        self.assertLess(abs(float(trend["slope"]) + 0.002 * 0.1 * 365.25 / 7.0), 4.0 * float(trend["slope_sigma"]))
        self.assertEqual({(row["kind"], row["slope"] == "") for row in changes if row is not trend}, {("step", True)})
        [[name, since, _, words, [start, slope]]] = data["robots"]["changes"][13]
        self.assertRegex(words, r"^left.diameter −10\.\d+ % a year \(± 0\.\d+ %\) since 2026-01-05$")
        self.assertAlmostEqual(slope, float(trend["slope"]), 9)
        mean = prom['trundle_fleet_parameter_mean{type="kobuki",parameter="track"}']
        fit = next(one for one in next(t for t in data["types"] if t["name"] == "kobuki")["parameters"] if one["name"] == "track")["fit"]
        self.assertAlmostEqual(mean, fit[0], 6)
        self.assertTrue(fit[1] < mean < fit[2] and abs(mean - 0.3) < 1e-3)

    def test_hostile_names_are_text(self):
        fleet_page.write(self.ours, 5, 2)
        url = f"sqlite:///{self.ours}/fleet.db"
        database = store.Store(url)
        for table, column in ((store.robots, store.robots.c.name), (store.runs, store.runs.c.robot)):
            database.change(table.update().where(column == "robot_00001").values({column.name: HOSTILE}))
        self.assertEqual(main(["--database", url, "-o", str(self.ours), "--quiet", "--reports", "none"]), 0)
        self.assertIn(HOSTILE, data_of(self.ours / "fleet.html", "data")["robots"]["name"])
        self.assertNotIn("</script><script>\"", (self.ours / "fleet.html").read_text())
        with (self.ours / "robots.csv").open(newline="") as file:
            self.assertIn("'" + HOSTILE, [row["robot"] for row in csv.DictReader(file)])
        samples((self.ours / "fleet.prom").read_text())

    def with_reports(self, *more):
        """Asked for reports of two robots with two logs each; returns what was said, the robots that a report was made for,
        and the reports' texts by robot."""
        asked = []
        ask = worker.Host.ask_report
        given = [str(self.theirs), "--database", f"sqlite:///{self.folder}/fleet.db", "--workers", "0", "-o", str(self.ours), "--reports", "all", *more]
        with (unittest.mock.patch.object(worker.Host, "ask_report", lambda host, robot, *rest: asked.append(robot) or ask(host, robot, *rest)),
              contextlib.redirect_stderr(io.StringIO()) as errors, contextlib.redirect_stdout(io.StringIO())):
            self.assertEqual(main(given), 0)
        robots = data_of(self.ours / "fleet.html", "data")["robots"]
        texts = {robot: (self.ours / link).read_text() for robot, link in zip(robots["name"], robots["report"]) if link}
        return [line for line in errors.getvalue().splitlines() if line.startswith("trundle-fleet")], asked, texts

    def test_a_report_for_each_robot_is_made_once(self):
        make_logs(self.theirs, range(1, 3), 2, Path(ROBOT), 3.0)
        said, asked, texts = self.with_reports()
        self.assertEqual((said, asked), ([], ["robot_0001", "robot_0002"]))
        for text in texts.values():
            self.assertIn("</html>", text)
        with tempfile.TemporaryDirectory() as folder:
            self.ours = Path(folder)
            self.assertEqual(self.with_reports()[1:], ([], texts), "the database has them")
        self.ours = self.folder / "python"
        make_logs(self.theirs, range(2, 3), 3, Path(ROBOT), 3.0)
        _, asked, again = self.with_reports()
        self.assertEqual((asked, again["robot_0001"]), (["robot_0002"], texts["robot_0001"]))
        self.assertNotEqual(again["robot_0002"], texts["robot_0002"])

    def test_a_report_that_fails_stops_nothing(self):
        """One of its logs is there no longer; where limits are others it is tried again."""
        make_logs(self.theirs, range(1, 3), 2, Path(ROBOT), 0.6)
        self.with_reports("--reports", "none")
        log = self.theirs / "robot_0002/2026-03-02"
        log.rename(self.folder / "away")
        said, asked, texts = self.with_reports()
        self.assertEqual((asked, list(texts)), (["robot_0001", *3 * ["robot_0002"]], ["robot_0001"]))
        self.assertRegex(said[-2], "^trundle-fleet: report of robot_0002: .*2026-03-02")
        self.assertEqual(said[-1], "trundle-fleet: reports of single robots that could not be made: 1; their lines are in the table report")
        (self.folder / "away").rename(log)
        self.assertEqual(self.with_reports()[1], [])
        said, asked, texts = self.with_reports("--time-limit-s", "299")
        self.assertEqual((said, asked, list(texts)), ([], ["robot_0002"], ["robot_0001", "robot_0002"]))

    def test_a_report_has_the_limits_of_a_log(self):
        make_logs(self.theirs, range(9, 10), 1, Path(ROBOT), 60.0)
        host = worker.Host()
        self.addCleanup(host.close)
        log = str(self.theirs / "robot_0009/2026-03-02")
        shows = {"robot_file": ROBOT, "calibrated_on": [log], "last": log}
        self.assertEqual(host.ask_report("r", shows, Limits(2048, 0.05)), {"line": "report of r: takes longer than the time limit of 0.05 s"})
        self.assertEqual(host.ask_report("r", shows, Limits(1, 60.0)), {"line": "report of r: needs more than the memory limit of 1 MB"})
        self.assertIn("</html>", host.ask_report("r", shows, Limits(2048, 60.0))["document"])

    def test_a_reason_that_no_robot_has_is_0(self):
        fleet_page.write(self.ours, 5, 2)
        prom = samples((self.ours / "fleet.prom").read_text())
        counted = {name: value for name, value in prom.items() if name.startswith("trundle_fleet_attention_robots")}
        self.assertEqual(len(counted), 6)
        self.assertEqual(counted['trundle_fleet_attention_robots{reason="change"}'], 0)
        self.assertEqual({reason for of in data_of(self.ours / "fleet.html", "data")["robots"]["reasons"] for reason in of} - set(page._REASONS), set())

    def test_a_parameter_that_no_run_of_a_type_shows(self):
        fleet_page.write(self.ours, 5, 2)
        url = f"sqlite:///{self.ours}/fleet.db"
        store.Store(url).change(store.parameters.update().where(store.parameters.c.name == "track").values(observable=False))
        self.assertEqual(main(["--database", url, "-o", str(self.ours), "--quiet", "--reports", "none"]), 0)
        named = [row["parameter"] for row in csv.DictReader((self.ours / "parameters.csv").open())]
        self.assertNotIn("track", named)
        self.assertIn("left.diameter", named)

    def test_a_password_is_not_said(self):
        database = store.Store(f"sqlite:///{self.folder}/empty.db")
        database.engine.url = sqlalchemy.engine.make_url("postgresql://fleet:secret@db/fleet")
        with unittest.mock.patch.object(store, "Store", lambda *_, **__: database), self.assertRaisesRegex(ValueError, r"fleet:\*\*\*@db/fleet: has no run"):
            page.write_page("postgresql://fleet:secret@db/fleet", str(self.ours), "none", lambda *_: None)

    def test_nothing_in_the_database(self):
        self.assertEqual(main(["--database", f"sqlite:///{self.folder}/empty.db", "-o", str(self.ours)]), 3)


class Needs(unittest.TestCase):
    def test_the_run_that_shows_it(self):
        self.assertEqual(needs.runs_for([], 3), [])
        self.assertEqual(needs.runs_for([], 0)[0][:20], "a run with a referen")
        self.assertEqual(needs.runs_for(["left.diameter", "right.diameter"], 2), ["add one straight run of known length"])
        self.assertEqual(needs.runs_for(["track"], 1)[-1], needs.ANOTHER_DAY)
        self.assertEqual(needs.runs_for(["track"], 2, ["gyro.scale", "left.diameter", "right.diameter"])[1:],
                         [f"add one straight run of known length: left.diameter, right.diameter {needs.BADLY_KNOWN}"])
        self.assertEqual(list(map(needs.is_urgent, needs.runs_for(["track"], 1, ["left.diameter"]))), [True, False, False])


if __name__ == "__main__":
    unittest.main()
