"""What docstrings, docs/python.md and the notebook show is what comes out."""

import ast
import doctest
import inspect
import json
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
