"""What the tests share: the program to compare with, places of recordings."""

import filecmp
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path


def missing(what):
    """To be raised: skips what cannot be tested here, but a machine that tests every change must have what it takes."""
    return RuntimeError(what) if os.environ.get("CI") == "true" else unittest.SkipTest(what)


try:
    import numpy  # noqa: F401
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-numpy") from error

PROGRAM = os.environ["TRUNDLE_PROGRAM"]
DEMO = "data/demo"
ROBOT = "data/demo/robot.toml"
TOUR = "data/demo/session_03/tour"
REAL_DATA = Path(os.environ.get("TRUNDLE_DATA", "../shared/data"))


def program(*arguments, check=True):
    """What it prints, and its errors."""
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    if check and done.returncode != 0:
        raise AssertionError(f"{arguments}: exit {done.returncode}: {done.stderr}")
    return done


def document_of(*arguments):
    """What it prints with --json, without the places of outputs, which a function has not."""
    document = json.loads(program(*arguments, "--json").stdout)
    document.pop("outputs", None)
    return document


class WithFolder(unittest.TestCase):
    """Each test has a folder of its own, for what the program writes and what Python does."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.theirs = self.folder / "program"
        self.ours = self.folder / "python"
        self.theirs.mkdir()
        self.ours.mkdir()

    def assert_same_files(self):
        """Both have written the same files, byte by byte."""
        names = lambda place: sorted(p.relative_to(place) for p in place.rglob("*") if p.is_file())
        self.assertEqual(names(self.theirs), names(self.ours))
        self.assertGreater(len(names(self.ours)), 0)
        for name in names(self.ours):
            self.assertTrue(filecmp.cmp(self.theirs / name, self.ours / name, shallow=False), f"{name} differs")
