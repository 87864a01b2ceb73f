"""The same on PostgreSQL, on a server that the test starts and kills."""

import os
import subprocess
import sys
import threading
import time
import unittest

from common import missing

try:
    import psycopg2  # noqa: F401
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-psycopg2") from error

import fleet_logs
import guard
import postgres
import test_fleet
from trundle.fleet import store

if not postgres.PROGRAMS:
    raise missing("no PostgreSQL: apt-get install postgresql")


def setUpModule():
    global SERVER
    SERVER = postgres.Postgres()
    SERVER.start()


def tearDownModule():
    SERVER.close()


def empty():
    database = store.Store(SERVER.url)
    database.transact(lambda connection: store._tables.drop_all(connection))


class LeasesOnPostgres(test_fleet.Leases, test_fleet.WithFolder):
    def setUp(self):
        super().setUp()
        empty()
        self.url = SERVER.url

    def test_who_claims_waits_for_nobody(self):
        database, claimed = self.prepared(4), []
        other = threading.Thread(target=lambda: claimed.extend(store.claim(store.Store(self.url), "request", "b", 2, 60.0)))

        def claim_and_wait(connection):
            first = store._claim(database, "request", "a", 2, 60.0, connection)
            other.start()
            other.join(10.0)
            self.assertEqual(len({claim.id for claim in first + claimed}), 4)

        self.addCleanup(other.join)
        database.transact(claim_and_wait)


class OnPostgres(test_fleet.WithLogs):
    ROBOTS, LOGS = 12, 2

    def test_same_rows_as_on_sqlite_though_the_server_is_killed(self):
        self.fleet()
        expected = fleet_logs.finals(self.url)
        self.url = SERVER.url
        empty()
        working = threading.Thread(target=self.fleet)
        working.start()
        self.addCleanup(working.join)
        self.in_the_middle(SERVER.kill)
        SERVER.start()
        working.join()
        self.assertEqual(fleet_logs.finals(self.url), expected)


class Guarded(unittest.TestCase):
    def test_the_server_of_a_test_that_is_killed_ends(self):
        code = "import postgres, time; server = postgres.Postgres(); server.start(); print(server.folder, flush=True); time.sleep(600)"
        test = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
        self.addCleanup(test.stdout.close)
        self.addCleanup(lambda: (test.kill(), test.wait()))
        folder = test.stdout.readline().strip()
        self.assertGreater(len(guard.processes_of(folder)), 1)
        test.kill()
        end = time.monotonic() + 30.0
        while (guard.processes_of(folder) or os.path.exists(folder)) and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual((guard.processes_of(folder), os.path.exists(folder)), ([], False))


if __name__ == "__main__":
    unittest.main()
