"""What docstrings, docs/python.md and the notebook show is what comes out."""

import ast
import contextlib
import doctest
import inspect
import io
import json
import math
import os
import random
import re
import unittest
from pathlib import Path

import trundle
from common import WithFolder, missing

try:
    import matplotlib.pyplot
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-pandas python3-matplotlib") from error

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def run_cell(source, place, names):
    """The value of its last expression, which a notebook shows."""
    lines = ast.parse(source, place)
    last = lines.body.pop() if isinstance(lines.body[-1], ast.Expr) else None
    exec(compile(lines, place, "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), place, "eval"), names)


def foreign_log(path):
    """Semicolons, milliseconds, counts and degrees, as a robot of 0.3 m between wheels of 0.1 m and 1000 counts writes it on a
    square of 2 m, whose end is its beginning."""
    draw = random.Random(3)
    rows, time, ways = ["t_ms;enc_l;enc_r;gyro_deg_s"], 0, [0.0, 0.0]
    for seconds, speed, turn in [(4, 0.0, 0.0)] + 4 * [(5, 0.4, 0.0), (1, 0.0, 0.0), (2, 0.0, math.pi / 4), (1, 0.0, 0.0)]:
        for _ in range(50 * seconds):
            time += 20
            ways = [way + 0.02 * (speed + side * turn) for way, side in zip(ways, (-0.15, 0.15))]
            counts = [math.floor(1000 * way / (0.1 * math.pi)) for way in ways]
            rows.append(f"{time};{counts[0]};{counts[1]};{math.degrees(turn) + 0.5 + draw.gauss(0.0, 0.1):.3f}")
    path.write_text("\n".join(rows) + "\n")


class Docs(WithFolder):
    def test_docstrings(self):
        modules = {inspect.getmodule(f) for f in vars(trundle).values() if inspect.isfunction(f)}
        self.assertGreater(len(modules), 1)
        results = [doctest.testmod(module, optionflags=FLAGS) for module in (trundle, *modules)]
        self.assertEqual(sum(result.failed for result in results), 0)
        self.assertGreater(sum(result.attempted for result in results), 20)

    def test_every_public_name_is_described(self):
        for name in trundle.__all__:
            if not name.startswith("__"):
                self.assertTrue(getattr(trundle, name).__doc__, name)

    def test_every_parameter_is_described(self):
        functions = [f for f in map(trundle.__dict__.get, trundle.__all__) if inspect.isfunction(f)]
        self.assertGreater(len(functions), 10)
        for function in functions:
            if function is trundle.smooth:  # says that its options are those of slam
                continue
            for parameter in inspect.signature(function).parameters:
                self.assertIn(f"`{parameter}`", function.__doc__, function.__name__)
        self.assertEqual(set(inspect.signature(trundle.smooth).parameters) | {"smooth"},
                         set(inspect.signature(trundle.slam).parameters))

    def test_the_page(self):
        """Its console sessions, one after the other."""
        page = Path("docs/python.md").read_text(encoding="utf-8")
        sessions = re.findall(r"^```pycon\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
        self.assertGreater(len(sessions), 3)
        test = doctest.DocTestParser().get_doctest("\n".join(sessions), {"OUT": str(self.folder)}, "docs/python.md", None, 0)
        self.assertEqual(doctest.DocTestRunner(optionflags=FLAGS).run(test).failed, 0)

    def own_csv(self, change=lambda source: source):
        """The page's section about one's own log, where one is: what it prints, and its names."""
        page = Path("docs/python.md").read_text(encoding="utf-8").split("## Your own CSV, in five minutes")[1].split("\n## ")[0]
        block = lambda language: re.search(rf"^```{language}\n(.*?)^```", page, re.DOTALL | re.MULTILINE)[1]
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)
        Path("robot.toml").write_text(block("toml"))
        foreign_log(Path("my_log.csv"))
        names = {}
        with contextlib.redirect_stdout(io.StringIO()) as said:
            exec(compile(change(block("python")), "docs/python.md", "exec"), names)
        matplotlib.pyplot.close("all")
        return said.getvalue(), names

    def test_ones_own_csv(self):
        said, names = self.own_csv()
        self.assertEqual(said, "")
        end = names["found"].end
        self.assertLess(math.hypot(end.x_m, end.y_m), 0.05)
        self.assertAlmostEqual(names["found"].path_length_m, 8.0, delta=0.1)
        self.assertEqual(Path("tour.png").read_bytes()[:4], b"\x89PNG")

    def test_ones_own_csv_in_degrees_is_named(self):
        """And not without the robot, as the page says."""
        said, names = self.own_csv(lambda source: source.replace("numpy.radians", ""))
        self.assertIn("degrees per second", said)
        self.assertEqual(names["tour"].findings, [])

    def test_ones_own_csv_is_drafted(self):
        """Three lines are to be filled in; then it is the same recording."""
        said, names = self.own_csv()
        folder = Path("log")
        folder.mkdir()
        Path("my_log.csv").rename(folder / "my_log.csv")
        self.assertEqual(len(trundle.init(folder, "drafts").to_fill_in), 3)
        drafted, ours = trundle.odometry("drafts", "robot.toml").end, names["found"].end
        self.assertLess(math.hypot(drafted.x_m - ours.x_m, drafted.y_m - ours.y_m), 1e-9)

    def test_the_notebook(self):
        """Its cells by this interpreter; results are shown as a notebook would ask for them."""
        notebook = json.loads(Path("examples/notebook.ipynb").read_text(encoding="utf-8"))
        self.assertEqual((notebook["nbformat"], [c for c in notebook["cells"] if c.get("outputs")]), (4, []))
        names, tables = {}, 0
        cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
        self.assertGreater(len(cells), 4)
        for number, cell in enumerate(cells, 1):
            source = "".join(cell["source"])
            shown = run_cell(source, f"examples/notebook.ipynb, cell {number}", names)
            if hasattr(shown, "_repr_html_"):
                tables += 1
                self.assertIn("<", shown._repr_html_())
        self.assertGreater(tables, 4)
        matplotlib.pyplot.close("all")


if __name__ == "__main__":
    unittest.main()
