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
    import numpy
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


def beginning_of(recording, seconds):
    """What each sensor recorded in the first seconds, as arrays."""
    import trundle

    def cut(stream):
        rows = stream["time_s"] < start_s + seconds
        return {name: values[rows] if isinstance(values, numpy.ndarray) else [v for v, row in zip(values, rows) if row]
                for name, values in stream.items()}

    named = ("wheels", "gyro", "velocity", "commands", "accel", "sightings", "reference")
    streams = {name: stream for name in named if (stream := getattr(recording, name))}
    start_s = min(stream["time_s"][0] for stream in streams.values())
    landmarks = recording.landmarks
    places = {"landmark": list(landmarks), "x_m": [x for x, _ in landmarks.values()], "y_m": [y for _, y in landmarks.values()]}
    return trundle.Recording.from_arrays(recording.name, **{name: cut(stream) for name, stream in streams.items()},
                                         landmarks=places if landmarks else None)


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

    def assert_same_answer(self, command, call, *arguments):
        """The document of a command, or its line. Returns what `call` does; None: an error."""
        import trundle

        done = program(command, *arguments, "--json", check=False)
        try:
            found = call()
        except (ValueError, trundle.CannotAnswer) as error:
            self.assertEqual(f"trundle: {error}\n", done.stderr)
            self.assertEqual(done.returncode, 4 if isinstance(error, trundle.CannotAnswer) else 3)
            return None
        self.assertEqual(done.returncode, 0, done.stderr)
        theirs = json.loads(done.stdout)
        theirs.pop("outputs", None)
        self.assertEqual(found.to_dict(), theirs)
        return found
