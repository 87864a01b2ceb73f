"""The same on Dask: a cluster of this machine, and a scheduler that somebody else keeps; both lose processes."""

import contextlib
import gc
import io
import os
import signal
import socket
import subprocess
import sys
import time
import unittest
from pathlib import Path

from common import missing

try:
    import distributed  # noqa: F401
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-distributed") from error

import fleet_logs
import guard
import test_fleet


class OnDask(test_fleet.WithLogs):
    ROBOTS, LOGS = 12, 2

    def setUp(self):
        super().setUp()
        self.addCleanup(guard.Guard(self.folder).close)
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
        port = self.start_scheduler()
        worker = self.start_worker(port)
        client = self.start_client("--scheduler", _address(port))

        def kill():
            for process in (self.scheduler, worker):
                _kill(process)

        self.in_the_middle(kill)
        self.start_scheduler(port)
        self.start_worker(port)
        self.assertEqual(client.wait(), 0)
        self.assertEqual(fleet_logs.finals(self.url), self.expected)

    def test_a_worker_that_is_killed(self):
        """At first only the process in which it works, which it starts again; then both."""
        port = self.start_scheduler()
        worker = self.start_worker(port)
        client = self.start_client("--scheduler", _address(port))

        def kill_host():
            hosts = [host for host in _children_of(worker.pid) if _children_of(host)]  # it is at work on a log
            for host in hosts:
                os.kill(host, signal.SIGKILL)
            return bool(hosts)

        def kill_both():
            if not kill_host():
                return False
            _kill(worker)

        self.in_the_middle(kill_host)
        self.in_the_middle(kill_both)
        self.start_worker(port)
        self.assertEqual(client.wait(), 0)
        self.assertEqual(fleet_logs.finals(self.url), self.expected)
        self.assertGreater(self.rows("SELECT max(losses) FROM log")[0][0], 0)

    def test_a_client_that_is_killed(self):
        """The same command goes on where it was."""
        port = self.start_scheduler()
        self.start_worker(port)
        client = self.start_client("--scheduler", _address(port))
        self.in_the_middle(lambda: _kill(client))
        self.assertEqual(self.start_client("--scheduler", _address(port)).wait(), 0)
        self.assertEqual(fleet_logs.finals(self.url), self.expected)

    def test_a_client_that_is_killed_with_a_cluster_of_its_own(self):
        """Whose processes end."""
        client = self.start_client("--workers", "1")
        self.in_the_middle(lambda: _kill(client))
        end = time.monotonic() + 60.0
        while (left := guard.processes_of(self.folder)) and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(left, [])
        self.assertEqual(self.start_client("--workers", "1").wait(), 0)
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

    def start(self, *words):
        process = subprocess.Popen([sys.executable, "-m", *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   env={**os.environ, "FLEET_TEST": f"{self.folder}/"})  # what the guard knows it by
        self.addCleanup(_kill, process)
        return process

    def start_scheduler(self, port=None):
        """Its port, at which it listens."""
        port = port or _free_port()
        self.scheduler = self.start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
        end = time.monotonic() + 60
        while True:
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                return port
            except ConnectionRefusedError:
                self.assertLess(time.monotonic(), end)
                time.sleep(0.05)

    def start_worker(self, port):
        return self.start("distributed.cli.dask_worker", _address(port), "--nthreads", "1", "--no-dashboard", "--no-nanny",
                          "--death-timeout", "20", "--local-directory", self.folder)

    def start_client(self, *more):
        return self.start("trundle.fleet", self.logs, "--database", self.url, "--quiet", "--lease-s", "1", *more)


def _address(port):
    return f"tcp://127.0.0.1:{port}"


def _kill(process):
    process.kill()
    process.wait()


def _children_of(process):
    found = []
    for thread in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):  # it ended
            found += map(int, thread.read_text().split())
    return found


def _free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


if __name__ == "__main__":
    unittest.main()
