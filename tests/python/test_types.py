"""The stubs are those of the extension, and what users write is checked by them."""

import ast
import importlib.util
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import trundle
from common import missing

if importlib.util.find_spec("mypy") is None:
    raise missing("no mypy: apt-get install mypy")

USE = """
import pandas
import trundle
found = trundle.odometry("tour", trundle.Robot("robot.toml"), start=(1, 2, 90))
length: float = found.path_length_m
frame = pandas.read_csv("log.csv")
recording = trundle.Recording.from_arrays("tour", wheels=frame, gyro={"time_s": frame["t"], "yaw_rate_rad_s": [0.0]})
trundle.run(recording, trundle.Robot("robot.toml"), "folder", calibrate_on=[recording])
for parameter in trundle.calibrate(["a", trundle.Recording("b")], "robot.toml").parameters:
    sigma: float = parameter.sigma
"""
MISUSE = """
import trundle
trundle.odometry("tour", "robot.toml").path_lenght_m
trundle.slip("tour", 3)
trundle.smooth("tour", "robot.toml", partcles=3)
trundle.Recording.from_arrays("name", wheel={"time_s": [0.0]})
trundle.report("folder", reference=3)
"""


def mypy(*arguments):
    done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


class Types(unittest.TestCase):
    def check(self, text, *options):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "user.py")
            file.write_text(text)
            return mypy("mypy", "--strict", "--ignore-missing-imports", "--cache-dir", folder, *options, str(file))

    def test_the_package_and_a_use_of_it(self):
        code, said = self.check(USE)
        self.assertEqual(code, 0, said)

    def test_the_fleet(self):
        code, said = self.check("import trundle.fleet.__main__, trundle.fleet.page\n", "--config-file", "python/pyproject.toml")
        self.assertEqual(code, 0, said)

    def test_a_misuse(self):
        code, said = self.check(MISUSE)
        self.assertEqual(code, 1, said)
        self.assertIn('has no attribute "path_lenght_m"', said)
        self.assertIn('"slip" has incompatible type "int"', said)
        self.assertIn('Unexpected keyword argument "partcles" for "smooth"', said)
        self.assertIn('Unexpected keyword argument "wheel" for "from_arrays"', said)
        self.assertIn('"reference" to "report" has incompatible type "int"', said)

    def stub(self):
        return ast.parse(Path(trundle.__file__).with_name("_trundle.pyi").read_text())

    def test_stubs_have_the_parameters_of_the_extension(self):
        """Which it names where it is called with one that it has not."""
        def compare(function, node):
            declared = [a.arg for a in node.args.posonlyargs + node.args.args + node.args.kwonlyargs if a.arg != "self"]
            with self.assertRaises(TypeError) as caught:
                function(no_such_parameter=None)
            has = re.search(r"1\. (.*)", str(caught.exception)).group(1)
            named = [name for name in re.findall(r"(\w+): ", has) if name != "self"]
            self.assertEqual(named, declared, node.name)

        compared = 0
        for node in self.stub().body:
            if isinstance(node, ast.FunctionDef):
                compare(getattr(trundle._trundle, node.name), node)
                compared += 1
            for method in node.body if isinstance(node, ast.ClassDef) else []:
                if (isinstance(method, ast.FunctionDef) and not method.name.startswith("__") and not
                        any(isinstance(d, ast.Name) and d.id == "property" for d in method.decorator_list)
                        and method.name not in ("to_pandas", "plot", "_repr_html_", "from_arrays")):
                    compare(getattr(getattr(trundle._trundle, node.name), method.name), method)
                    compared += 1
        self.assertGreater(compared, 40)

    def test_stubs_have_what_the_extension_has(self):
        """Names in both directions: what the stubs lack, and what the extension does."""
        stub = self.stub()
        named = {node.name: node for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        extension = trundle._trundle
        public = {name for name in dir(extension) if not name.startswith("_") and name.isidentifier()}
        declared = {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign)}
        self.assertEqual(public - set(named) - declared, set())
        for name, node in named.items():
            self.assertTrue(hasattr(extension, name), name)
            if not isinstance(node, ast.ClassDef) or name == "CannotAnswer":
                continue
            members = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
            has = {part for part in vars(getattr(extension, name)) if not part.startswith("__")}
            self.assertEqual(has - members, set(), name)
            self.assertEqual({m for m in members if not m.startswith("__")} - has, set(), name)


if __name__ == "__main__":
    unittest.main()
