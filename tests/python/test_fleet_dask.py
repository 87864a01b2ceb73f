"""The same on Dask: a cluster of this machine, and a scheduler that somebody else keeps; both lose processes."""

import contextlib
import gc
import io
import socket
import subprocess
import sys
import threading
import time
import unittest

try:
    import distributed  # noqa: F401
except ImportError as missing:
    raise unittest.SkipTest(f"{missing}: apt-get install python3-distributed") from missing

import fleet_logs
import test_fleet
from trundle.fleet import store


class OnDask(test_fleet.WithLogs):
    ROBOTS, LOGS = 12, 2

    def setUp(self):
        super().setUp()
        self.fleet()
        self.expected = fleet_logs.finals(self.url)
        self.url = f"sqlite:///{self.folder}/dask.db"

    def test_a_local_cluster(self):
        self.fleet("--workers", "2", "-o", self.folder / "page", "--reports", "all")
        self.assertEqual(fleet_logs.finals(self.url), self.expected)
        [(robots,)] = self.rows("SELECT count(*) FROM report")
        [(made,)] = self.rows("SELECT count(*) FROM report WHERE state = 'done'")  # runs so short do not determine every robot
        self.assertEqual((robots, len(list(self.folder.glob("page/robots/*.html")))), (self.ROBOTS, made))
        self.assertGreater(made, self.ROBOTS // 2)

    def test_a_scheduler_that_is_killed_with_its_worker(self):
        port = _free_port()
        address = f"tcp://127.0.0.1:{port}"
        start = lambda *words: subprocess.Popen([sys.executable, "-m", "distributed.cli." + words[0], *words[1:]],
                                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        scheduler = lambda: start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
        work = lambda: start("dask_worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny", "--death-timeout", "20",
                             "--local-directory", str(self.folder))
        processes = [scheduler(), work()]
        self.addCleanup(lambda: [(process.kill(), process.wait()) for process in processes])
        self.wait_for(port)
        client = threading.Thread(target=self.fleet, args=("--scheduler", address, "--lease-s", "1"))
        client.start()
        end = time.monotonic() + 60
        while time.monotonic() < end and not self.any_done():
            time.sleep(0.05)
        for process in processes:
            process.kill()
            process.wait()
        processes[:] = [scheduler(), work()]
        client.join()
        self.assertEqual(fleet_logs.finals(self.url), self.expected)

    def test_a_scheduler_that_never_answers(self):
        """The second is no scheduler."""
        with socket.create_server(("127.0.0.1", 0)) as other:
            for address in (f"tcp://127.0.0.1:{_free_port()}", "tcp://127.0.0.1:{}".format(other.getsockname()[1])):
                start = time.monotonic()
                done = subprocess.run([sys.executable, "-m", "trundle.fleet", str(self.logs), "--database", self.url, "--quiet",
                                       "--scheduler", address], capture_output=True, text=True)
                self.assertEqual((done.returncode, len(done.stderr.splitlines())), (3, 1), done.stderr)
                self.assertRegex(done.stderr, f"^trundle-fleet: {address}: .*; expected a Dask scheduler that answers$")
                self.assertLess(time.monotonic() - start, 60.0)  # a tenth of it on a machine to itself

    def test_a_scheduler_whose_certificates_are_not_here(self):
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            self.fleet("--scheduler", "tls://127.0.0.1:8786", code=3)
            gc.collect()  # what a client that was not made in full leaves
        self.assertEqual(errors.getvalue(), "trundle-fleet: tls://127.0.0.1:8786: no certificates; expected distributed.comm.tls in Dask's configuration\n")

    def wait_for(self, port):
        end = time.monotonic() + 60
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port)).close()
            except ConnectionRefusedError:
                self.assertLess(time.monotonic(), end)
                time.sleep(0.05)

    def any_done(self):
        try:
            return self.rows("SELECT count(*) FROM log WHERE state = 'done'")[0][0]
        except store.DatabaseUnreachable:  # the client has made no tables yet
            return 0


def _free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


if __name__ == "__main__":
    unittest.main()
