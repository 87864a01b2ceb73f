"""Runs one module of tests from the root of the repository: run_tests.py test_views.py

Says "skipped: ..." where not one of its tests could be run, and fails where one failed. With CI=true it fails too where
packages are missing."""

import importlib
import os
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main() -> int:
    name = sys.argv[1].removesuffix(".py")
    sys.path.insert(0, str(HERE))
    os.chdir(HERE.parents[1])
    try:
        importlib.import_module("common")  # says that NumPy is missing, which others import before it
        suite = unittest.defaultTestLoader.loadTestsFromName(name)
    except unittest.SkipTest as missing:
        print(f"skipped: {missing}")
        return 0
    result = unittest.TextTestRunner(verbosity=2).run(suite)
    if result.skipped and len(result.skipped) >= result.testsRun:  # a module's setUp skips it without a test that was run
        print(f"skipped: {result.skipped[0][1]}")
    return 0 if result.wasSuccessful() and (result.testsRun > 0 or result.skipped) else 1


if __name__ == "__main__":
    sys.exit(main())
