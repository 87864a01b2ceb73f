"""The wheel installs where there is no network, and works there alone."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from common import missing

WHEELS = sorted(Path(os.environ["TRUNDLE_WHEELS"]).glob("trundle-*.whl"))
if not WHEELS:
    raise missing("no wheel was built: ./run python makes one")


class Wheel(unittest.TestCase):
    def test_installs_and_works(self):
        with tempfile.TemporaryDirectory() as folder:
            run = lambda *words: subprocess.run(
                words, check=True, capture_output=True, text=True,
                env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"}).stdout
            run("/usr/bin/python3", "-m", "venv", "--system-site-packages", folder)
            python = str(Path(folder, "bin/python3"))
            run(python, "-m", "pip", "install", "--quiet", "--no-index", str(WHEELS[-1]))
            said = run(python, "-c", "import trundle; print(trundle.__file__, len(trundle.odometry("
                       "'data/demo/session_03/tour', 'data/demo/robot.toml').trajectory))")
            where, poses = said.split()
            self.assertTrue(where.startswith(folder), where)
            self.assertEqual(poses, "1775")
            self.assertIn("--database", run(str(Path(folder, "bin/trundle-fleet")), "--help"))
            for name in ("py.typed", "_trundle.pyi", "plotting.py", "fleet/page.html"):
                self.assertTrue(Path(where).parent.joinpath(name).exists(), name)


if __name__ == "__main__":
    unittest.main()
