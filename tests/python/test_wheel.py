"""The wheel installs where there is no network, and works there alone."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
import zipfile
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

    @unittest.skipUnless(shutil.which("readelf") and shutil.which("dpkg"), "needs binutils and dpkg")
    def test_the_libraries_that_another_machine_needs_are_named(self):
        """docs/python.md names the packages of what the extension is linked to, but for those of every program in C++."""
        with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(WHEELS[-1]) as wheel:
            [name] = [name for name in wheel.namelist() if name.endswith(".so")]
            said = lambda *words: subprocess.run(words, check=True, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}).stdout
            needed = re.findall(r"\(NEEDED\).*\[(.*)\]", said("readelf", "-d", wheel.extract(name, folder)))
        self.assertGreater(len(needed), 5)
        own = [f"*/{library}" for library in needed if not re.match(r"(ld-linux.*|lib(c|m|gcc_s|stdc\+\+))\.", library)]
        packages = {line.split(":")[0] for line in said("dpkg", "-S", *own).splitlines()}
        [listed] = re.findall(r"`apt-get install (lib.*?)`", Path("docs/python.md").read_text(encoding="utf-8"))
        self.assertEqual(sorted(packages), listed.split())


if __name__ == "__main__":
    unittest.main()
