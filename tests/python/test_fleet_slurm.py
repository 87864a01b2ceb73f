"""What docs/fleet.md says of Slurm: its script and its line, submitted to a Slurm and on a PostgreSQL that the test starts."""

import re
import unittest
from pathlib import Path

from common import missing

import test_fleet_postgres  # says what is missing for it

import fleet_logs
import slurm
import sqlalchemy
import test_fleet
from trundle.fleet import store
from trundle.fleet.logs import find_logs, in_shard

if slurm.MISSING:
    no_slurm = f"no {', '.join(slurm.MISSING)}: apt-get install {slurm.PACKAGES}"
    raise missing(no_slurm) if slurm.can_be_installed() else unittest.SkipTest(f"{no_slurm}, where there are such packages")

SCRIPT, LINE = re.search(r"\*\*Slurm\.\*\*.*?^```sh\n(#!.*?)^```.*?^```sh\n(sbatch .*?)\n```", Path("docs/fleet.md").read_text(encoding="utf-8"),
                         re.DOTALL | re.MULTILINE).groups()


def setUpModule():
    global SLURM
    test_fleet_postgres.setUpModule()
    unittest.addModuleCleanup(test_fleet_postgres.tearDownModule)
    SLURM = slurm.Slurm()
    unittest.addModuleCleanup(SLURM.close)
    try:
        SLURM.start()
    except RuntimeError as reason:  # on this machine
        raise unittest.SkipTest(f"no Slurm: {reason}") from reason
    (SLURM.folder / "fleet.sh").write_text(SCRIPT)


class OnSlurm(test_fleet.WithLogs):
    ROBOTS, LOGS = 4, 2

    def setUp(self):
        super().setUp()
        self.fleet()
        self.expected = fleet_logs.finals(self.url)
        self.url = test_fleet_postgres.SERVER.url
        test_fleet_postgres.empty()

    def submit(self, parts, more=""):
        """The line of the page, with fewer parts, logs and database of the test, and perhaps more options."""
        line = LINE
        for theirs, ours in (("1-16", f"1-{parts}"), ("/srv/logs", str(self.logs)), ("postgresql://fleet@db/fleet", f"'{self.url}'")):
            self.assertEqual(line.count(theirs), 1, line)
            line = line.replace(theirs, ours)
        return re.fullmatch(r"Submitted batch job (\d+)\n", SLURM.command(f"{line} {more}"))[1]

    def wait(self, job, parts):
        tasks = SLURM.wait(job)
        self.assertEqual([(task["JobState"], task["ExitCode"]) for task in tasks], parts * [("COMPLETED", "0:0")], SLURM.said())
        return tasks

    def test_an_array_of_jobs(self):
        """More parts than the node has processors."""
        self.wait(self.submit(3), 3)
        self.assertEqual(fleet_logs.finals(self.url), self.expected)
        parts = [sum(in_shard(log.path, number, 3) for log in find_logs([str(self.logs)])) for number in (1, 2, 3)]
        worked_off = self.rows("SELECT count(*) FROM log GROUP BY request")
        self.assertEqual(sorted(count for (count,) in worked_off), sorted(filter(None, parts)))

    def test_a_task_that_is_requeued_in_the_middle(self):
        database = store.Store(self.url)
        database.create_tables()
        job = self.submit(1, "--lease-s 1")

        def requeue(connection):
            connection.execute(sqlalchemy.text("LOCK TABLE run IN EXCLUSIVE MODE"))  # it works, but cannot store
            SLURM.until(lambda: self.rows("SELECT count(*) FROM log WHERE state = 'leased'") != [(0,)], "no log is worked on")
            SLURM.command(f"scontrol requeue {job}_1")
            SLURM.until(lambda: [task["JobState"] for task in SLURM.tasks(job)] == ["PENDING"], "the task is not ended")

        database.transact(requeue)
        SLURM.command(f"scontrol update jobid={job}_1 starttime=now+2")  # rather than in two minutes
        [task] = self.wait(job, 1)
        self.assertEqual(task["Restarts"], "1")
        self.assertEqual(fleet_logs.finals(self.url), self.expected)


if __name__ == "__main__":
    unittest.main()
