"""The stubs are those of the extension, and what users write is checked by them."""

import importlib.util
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import trundle

if importlib.util.find_spec("mypy") is None:
    raise unittest.SkipTest("no mypy: apt-get install mypy")

USE = """
import trundle
found = trundle.odometry("tour", trundle.Robot("robot.toml"), start=(1, 2, 90))
length: float = found.path_length_m
for parameter in trundle.calibrate(["a", trundle.Recording("b")], "robot.toml").parameters:
    sigma: float = parameter.sigma
"""
MISUSE = """
import trundle
trundle.odometry("tour", "robot.toml").path_lenght_m
trundle.slip("tour", 3)
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
        self.assertIn('incompatible type "int"', said)

    def test_stubs_have_what_the_extension_has(self):
        """Names in both directions: what the stubs lack, and what the extension does."""
        import ast

        stub = ast.parse(Path(trundle.__file__).with_name("_trundle.pyi").read_text())
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
