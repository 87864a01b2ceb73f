"""The same on PostgreSQL, on a server that the test starts and kills."""

import threading
import time
import unittest

try:
    import psycopg2  # noqa: F401
except ImportError as missing:
    raise unittest.SkipTest(f"{missing}: apt-get install python3-psycopg2") from missing

import fleet_logs
import postgres
import test_fleet
from trundle.fleet import store

if not postgres.PROGRAMS:
    raise unittest.SkipTest("no PostgreSQL: apt-get install postgresql")


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
    def test_same_rows_as_on_sqlite_though_the_server_is_killed(self):
        self.fleet()
        expected = fleet_logs.finals(self.url)
        self.url = SERVER.url
        empty()
        working = threading.Thread(target=self.fleet)
        working.start()
        time.sleep(0.7)
        SERVER.kill()
        SERVER.start()
        working.join()
        self.assertEqual(fleet_logs.finals(self.url), expected)


if __name__ == "__main__":
    unittest.main()
