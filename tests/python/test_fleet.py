"""Many logs on one database: found, computed once, each with one final row, whoever dies."""

import contextlib
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import threading
import time
import types
import unittest
import unittest.mock
from pathlib import Path

from common import ROBOT, WithFolder, missing

try:
    import sqlalchemy
except ImportError as error:
    raise missing(f"{error}: apt-get install python3-sqlalchemy") from error

import trundle
from fleet_logs import finals, make_logs
from trundle.fleet import store, work, worker
from trundle.fleet.__main__ import main, parser
from trundle.fleet.host import Limits
from trundle.fleet.progress import Bar
from trundle.fleet.logs import date_of, files_of, find_logs, in_shard, sha256_of

SHORT_M = 0.6  # of way: logs that take a worker little time


class WithLogs(WithFolder):
    ROBOTS, LOGS = 3, 2

    def setUp(self):
        super().setUp()
        self.logs = self.folder / "logs"
        make_logs(self.logs, range(1, self.ROBOTS + 1), self.LOGS, Path(ROBOT), SHORT_M)
        self.url = f"sqlite:///{self.folder}/fleet.db"

    def fleet(self, *arguments, code=0):
        given = [str(self.logs), "--database", self.url, "--workers", "0", "--quiet", *map(str, arguments)]
        self.assertEqual(main(given), code)

    def said(self, line, code=0):
        """On standard error, a line among others."""
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            self.assertEqual(main([str(self.logs), "--database", self.url, "--workers", "0"]), code)
        self.assertIn(line, errors.getvalue())
        return [one for one in errors.getvalue().splitlines() if one.startswith("trundle-fleet: ")]

    def rows(self, statement):
        return store.Store(self.url).transact(lambda connection: connection.execute(sqlalchemy.text(statement)).all())

    def in_the_middle(self, kill, seconds=60.0):
        """Calls it when some logs have their final rows and others are worked on, of which none can be stored until it has
        returned. Where it returns False it is called again at another such moment."""
        database, end = store.Store(self.url), time.monotonic() + seconds
        database.create_tables()
        while time.monotonic() < end:
            with database.engine.connect() as connection:
                if not database.is_sqlite:  # of SQLite any transaction has all of it
                    connection.execute(sqlalchemy.text("LOCK TABLE log IN EXCLUSIVE MODE"))
                states = dict(connection.execute(sqlalchemy.text("SELECT state, count(*) FROM log GROUP BY state")).all())
                self.assertNotEqual(states.keys(), {"done"}, "every log was done before something was killed")
                if "done" in states and "leased" in states and kill() is not False:
                    connection.invalidate()  # the server may be what was killed
                    return
            time.sleep(0.01)
        self.fail(f"no log was done, and others worked on, within {seconds:g} s: {states}")


class Logs(WithLogs):
    def test_of_a_folder_a_pattern_and_a_list(self):
        found = find_logs([str(self.logs)])
        self.assertEqual([(log.robot, log.date) for log in found[:3]],
                         [("robot_0001", "2026-03-02"), ("robot_0001", "2026-03-09"), ("robot_0002", "2026-03-02")])
        self.assertEqual(found, find_logs([f"{self.logs}/*/*"]))
        rows = "".join(f"{Path(log.path).relative_to(self.folder)},{log.robot},{log.date},{log.robot_file}\n" for log in found)
        (self.folder / "list.csv").write_text("log,robot,date,robot_file\n" + rows)
        self.assertEqual(found, find_logs([str(self.folder / "list.csv")]))
        (self.folder / "list.txt").write_text("# those of today\n" + "".join(f"{log.path}\n" for log in found))
        self.assertEqual([log.path for log in found], [log.path for log in find_logs([str(self.folder / "list.txt")])])

    def test_the_robot_file(self):
        one = self.logs / "robot_0001/2026-03-02/robot.toml"
        shutil.copy(one, self.logs / "robot_0001/robot.toml")
        one.unlink()
        self.assertEqual(find_logs([str(self.logs)])[0].robot_file, str(self.logs / "robot_0001/robot.toml"))
        self.assertEqual({log.robot_file for log in find_logs([str(self.logs)], ROBOT)}, {str(Path(ROBOT).resolve())})
        (self.logs / "robot_0001/robot.toml").rename(self.folder / "robot.toml")
        self.assertEqual(find_logs([str(self.logs)])[0].robot_file, str(self.folder / "robot.toml"))
        with self.assertRaisesRegex(ValueError, "does not exist"):
            find_logs([str(self.folder / "nowhere")])

    def test_dates(self):
        self.assertEqual(date_of("/2024-01-01/r/log_20260303T120000.bag"), "2026-03-03")
        self.assertEqual(date_of("/runs/2026_12_24/a"), "2026-12-24")
        self.assertIsNone(date_of("/runs/2026-02-30/120260303"))

    def test_shards_are_all_of_it_and_disjoint(self):
        paths = [f"/logs/robot_{i}" for i in range(1000)]
        parts = [[path for path in paths if in_shard(path, k, 7)] for k in range(1, 8)]
        self.assertEqual(sorted(sum(parts, [])), sorted(paths))
        self.assertLess(max(map(len, parts)), 2 * len(paths) // 7)


class Found(WithFolder):
    """Logs without their bytes: which, whose, of which day."""

    def place(self, *names, text=""):
        for name in names:
            file = self.folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)

    def found(self, *given, robot_file=None):
        """Path below the folder and robot of each."""
        logs = find_logs([str(self.folder / one) for one in given], robot_file)
        return [(os.path.relpath(log.path, os.path.realpath(self.folder)), log.robot) for log in logs]

    def test_a_log_file_is_part_of_the_recording_that_names_it(self):
        self.place("r1/2026-01-01/x.bag", "r1/2026-01-01/robot.toml", "r1/2026-01-01/parts/y.mcap")
        self.place("r1/2026-01-01/recording.toml", text='[wheels]\nfile = "x.bag"\ntopic = "/joint_states"\n')
        self.assertEqual(self.found(""), [("r1/2026-01-01", "r1")])
        self.place("r1/2026-01-01/z.bag")  # read with the same recording.toml
        self.assertEqual(self.found(""), [("r1/2026-01-01", "r1"), ("r1/2026-01-01/z.bag", "r1")])
        self.place("r2/a/metadata.yaml", "r2/a/a_0.db3", "r2/b.ulg")
        self.assertEqual(self.found("r2"), [("r2/a", "r2"), ("r2/b.ulg", "r2")])
        self.assertEqual(self.found("r2/a"), [("r2/a", "r2")])

    def test_the_same_log_file_by_another_path(self):
        """Named through a link, by way of another folder, or from another folder; a copy is a log of its own."""
        for name, toml in (("a", 'file = "link.bag"'), ("b", 'file = "../b/x.bag"'), ("c", f'file = "{self.folder}/c/x.bag"'), ("d", 'file = "../far/x.bag"')):
            self.place(f"{name}/x.bag", f"{name}/recording.toml", f"{name}/robot.toml", text=f"[wheels]\n{toml}\n")
        (self.folder / "a/link.bag").symlink_to(self.folder / "a/x.bag")
        (self.folder / "far").symlink_to(self.folder / "d")
        self.place("e/r/recording.toml", "e/x.bag", text='[wheels]\nfile = "../x.bag"\n')
        paths = lambda name: [path for path, _ in self.found(name)]
        self.assertEqual(list(map(paths, "abcde")), [["a"], ["b"], ["c"], ["d"], ["e/r"]])
        shutil.copy(self.folder / "b/x.bag", self.folder / "b/y.bag")
        self.assertEqual(paths("b"), ["b", "b/y.bag"])

    def test_a_broken_recording_hides_no_other(self):
        self.place("a/1/wheels.csv", "a/2/wheels.csv", "b/1/wheels.csv")
        self.place("a/2/recording.toml", text="garbage [")
        (self.folder / "b/above").symlink_to(self.folder)
        self.assertEqual(self.found(""), [("a/1", "a"), ("a/2", "a"), ("b/1", "b")])

    def test_a_robot_has_one_name_however_its_logs_are_given(self):
        expected = [(f"x/{robot}/2026-03-0{day}/run", robot) for robot in ("r1", "r2") for day in (2, 9)]
        self.place(*(f"{log}/wheels.csv" for log, _ in expected))
        self.place("list.txt", text="".join(f"{log}\n" for log, _ in expected))
        self.place("x/r1/list.csv", text="log\n" + "".join(f"../../y/../{log}\n" for log, _ in expected))
        for given in (["x"], ["x/r1", "x/r2"], ["x/*"], ["x/r*/2026*"], ["x/*/*/*"], ["list.txt"], ["x/r1/list.csv"], ["list.txt", "x", "x/r1"]):
            for robot_file in (ROBOT, None):
                self.assertEqual(self.found(*given, robot_file=robot_file), expected, given)
        self.place("x/r1/robot.toml", "x/r2/robot.toml", "x/r2/2026-03-02/run/robot.toml")
        self.place("x/r1/mowing/1/wheels.csv")
        self.assertEqual(self.found("x/r1/mowing"), [("x/r1/mowing/1", "r1")])
        self.assertEqual(self.found("x/r1/mowing", robot_file=ROBOT), [("x/r1/mowing/1", "mowing")])
        self.assertEqual(self.found("x/r2"), expected[2:])

    def test_tables_as_sheets_write_them(self):
        log = os.path.realpath(self.folder / "a/1")
        for text in ("\ufefflog,robot,date\na/1,r 7,2026-03-04\n", '"log","robot","date"\n"a/1","r 7","2026-03-04"\n',
                     "log;robot;date\na/1;r 7;2026-03-04\n", '# of today\n\nlog, robot , date\nb/../a/1, "r 7", 20260304\n'):
            (self.folder / "list.csv").write_text(text)
            self.assertEqual([(l.path, l.robot, l.date) for l in find_logs([str(self.folder / "list.csv")])], [(log, "r 7", "2026-03-04")], text)
        (self.folder / "list.txt").write_text('a/"1", b\n')
        self.assertEqual(self.found("list.txt"), [('a/"1", b', "a")])

    def test_what_is_wrong_in_a_table_is_one_line(self):
        for text, line in (("log,date\na,2026-03-04\n# c\nb,03/04/2026\n", "list.csv:4: date is '03/04/2026'; expected one as 2026-03-04"),
                           ("path,robot\na,b\n", "list.csv:1: has no column 'log'; expected log, and perhaps"),
                           ("log,robot\n,b\n", "list.csv:2: has no log; expected a path"),
                           ("log,robot_number\na,x\n", "list.csv:2: robot_number is 'x'; expected 1 or more")):
            (self.folder / "list.csv").write_text(text)
            with self.assertRaisesRegex(ValueError, line):
                self.found("list.csv")
        (self.folder / "list.csv").write_bytes(b"log\n\xfcb\n")
        with self.assertRaisesRegex(ValueError, "list.csv: is not in UTF-8"):
            self.found("list.csv")


class OnSqlite(WithLogs):
    def test_rows(self):
        self.fleet()
        self.assertEqual(self.rows("SELECT status, count(*) FROM run GROUP BY status"), [("done", 6)])
        self.assertEqual(self.rows("SELECT count(*) FROM robot"), [(3,)])
        self.assertEqual(self.rows("SELECT count(DISTINCT name) FROM parameter"), [(5,)])
        self.assertEqual(self.rows("SELECT count(*) FROM run WHERE length(log_sha256) = 64 AND version != ''"), [(6,)])
        self.assertGreater(self.rows("SELECT count(*) FROM finding")[0][0], 0)

    def test_what_is_unchanged_is_not_done_again(self):
        """By SHA-256: neither size nor time tell."""
        self.fleet()
        before = finals(self.url)
        asked = []
        ask = worker.Host.ask
        self.addCleanup(setattr, worker.Host, "ask", ask)
        worker.Host.ask = lambda host, log, *rest: asked.append(log) or ask(host, log, *rest)
        self.fleet()
        self.assertEqual((asked, finals(self.url)), ([], before))
        wheels = self.logs / "robot_0002/2026-03-09/wheels.csv"
        stat, text = wheels.stat(), wheels.read_bytes()
        middle = text.index(b"\n", len(text) // 2)
        digit = text[middle - 1 : middle]
        wheels.write_bytes(text[: middle - 1] + (b"4" if digit != b"4" else b"5") + text[middle:])
        os.utime(wheels, ns=(stat.st_atime_ns, stat.st_mtime_ns))
        self.assertEqual((wheels.stat().st_size, wheels.stat().st_mtime_ns), (stat.st_size, stat.st_mtime_ns))
        self.fleet()
        self.assertEqual(asked, [str(wheels.parent)])
        self.assertNotEqual(finals(self.url), before)
        (wheels.parent / "robot.toml").write_text((wheels.parent / "robot.toml").read_text() + "\n# looked at\n")
        self.fleet()
        self.assertEqual(asked, 2 * [str(wheels.parent)])

    def test_whatever_a_row_depends_on_makes_it_done_again(self):
        row = dict.fromkeys(("robot", "date", "log_sha256", "robot_sha256", "version", "limits"), "as it was")
        for status, on in (("done", set(row) - {"limits"}), ("failed", set(row))):
            known = types.SimpleNamespace(status=status, **row)
            changed = {name for name in row if not worker._is_unchanged(known, {**row, name: "another"})}
            self.assertEqual((worker._is_unchanged(known, row), changed), (True, on))

    def test_another_build_of_the_same_version_does_it_again(self):
        code = hashlib.sha256(b"".join(Path(part.__file__).read_bytes() for part in (trundle._trundle, trundle, work)))
        self.assertEqual(worker._version(), f"{trundle.__version__} {code.hexdigest()[:16]}")
        self.fleet()
        with unittest.mock.patch.object(worker, "_version", lambda: "another"):
            self.fleet()
        self.assertEqual(self.rows("SELECT version, count(*) FROM run GROUP BY version"), [("another", 6)])

    def test_a_log_that_changes_while_it_is_read_is_read_again(self):
        ask, asked = worker.Host.ask, []
        self.addCleanup(setattr, worker.Host, "ask", ask)

        def and_is_written_to(host, log, *rest):
            answer = ask(host, log, *rest)
            if log not in asked:
                os.utime(Path(log, "wheels.csv"))
            asked.append(log)
            return answer

        worker.Host.ask = and_is_written_to
        self.fleet()
        self.assertEqual(len(asked), 2 * 6)
        self.assertEqual(self.rows("SELECT status, count(*) FROM run GROUP BY status"), [("done", 6)])

    def test_a_poisoned_log_is_tried_three_times_and_stops_nobody(self):
        wheels = self.logs / "robot_0001/2026-03-02/wheels.csv"
        wheels.write_text("time_s,left_ticks\n0,1\n")
        asked = []
        ask = worker.Host.ask
        self.addCleanup(setattr, worker.Host, "ask", ask)
        worker.Host.ask = lambda host, log, *rest: asked.append(log) or ask(host, log, *rest)
        self.fleet()
        self.assertEqual(asked.count(str(wheels.parent)), 3)
        self.assertEqual(len(asked), 5 + 3)
        [(line,)] = self.rows("SELECT line FROM run WHERE status = 'failed'")
        self.assertIn("right", line)
        self.assertEqual(self.rows("SELECT count(*) FROM run WHERE status = 'done'"), [(5,)])

    def test_who_loses_logs_to_another_call_says_so(self):
        register = store.register
        self.addCleanup(setattr, store, "register", register)

        def and_then_another(database, request, found, types):
            register(database, request, found, types)
            register(database, "another", found[:2], types)

        store.register = and_then_another
        said = self.said("2 of 6 logs were taken over by another call", code=3)
        self.assertEqual(len(said), 1)

    def test_the_line_of_a_log_says_which_one(self):
        """Also where the program calls a recording as its folder is called: a day is the name of many."""
        for log in ("robot_0001", "robot_0002"):
            (self.logs / log / "2026-03-02/robot.toml").write_text('name = "without_wheels"\n')
        said = self.said("2 of 6 logs failed")
        self.assertEqual([line.split(": ")[1:3] for line in said[:2]],
                         [[f"{self.logs}/robot_000{number}/2026-03-02", "says nothing of how the robot moved"] for number in (1, 2)])

    def test_the_first_lines_of_what_failed_are_said(self):
        for wheels in self.logs.glob("*/*/wheels.csv"):
            wheels.write_text("time_s,left_ticks\n0,1\n")
        said = self.said("6 of 6 logs failed", code=3)
        self.assertEqual(sum("wheels.csv" in line for line in said), 3)

    def test_a_log_without_a_robot_file_and_one_whose_map_is_broken_stop_nobody(self):
        second, first = (self.logs / f"robot_0001/2026-03-0{day}" for day in (2, 9))
        (first / "robot.toml").unlink()
        (second / "recording.toml").write_text("garbage [\n")
        self.fleet()
        self.assertEqual(self.rows("SELECT status, count(*) FROM run GROUP BY status ORDER BY 1"), [("done", 4), ("failed", 2)])
        lines = self.rows("SELECT line FROM run WHERE status = 'failed' ORDER BY log")
        self.assertRegex(lines[0][0], "2026-03-02/recording.toml:1")
        self.assertRegex(lines[1][0], "2026-03-09: no robot.toml beside or above it; expected one, or --robot FILE$")
        self.assertEqual(len(self.rows("SELECT DISTINCT type FROM robot")), 1)

    def test_sums_are_those_that_a_shell_makes(self):
        (self.logs / "robot_0001/2026-03-02/.DS_Store").write_text("of a file browser")
        self.fleet()
        for log, log_sum, robot_sum, robot_file in self.rows("SELECT run.log, log_sha256, robot_sha256, robot_file FROM run JOIN log ON log.id = log_id"):
            [command] = re.findall("`(cd LOG .*?)`", Path("docs/fleet.md").read_text())
            shell = lambda command, folder: subprocess.check_output(["sh", "-c", command, "sh"], text=True, cwd=folder).split()[0]
            self.assertEqual(shell(command.replace("LOG", f"'{log}'"), "/"), log_sum)
            self.assertEqual(shell(f"sha256sum '{robot_file}'", log), robot_sum)
        one = self.folder / "x.bag"
        one.write_text("bytes")
        self.assertEqual(sha256_of(files_of(str(one)), self.folder), hashlib.sha256(b"bytes").hexdigest())

    def test_a_robot_of_several_in_one_log(self):
        folder = self.folder / "site/2026-03-02"
        folder.mkdir(parents=True)
        for number in (1, 3):
            rows = "".join(f"{10 + i / 10:.1f} {0.1 * number:.1f} 0.0\n" for i in range(100))
            (folder / f"Robot{number}_Odometry.dat").write_text(rows)
        self.logs = self.folder / "list.csv"
        self.logs.write_text("log,robot_number\nsite/2026-03-02,1\nsite/2026-03-02,3\n")
        robot = self.folder / "without_wheels.toml"
        robot.write_text('name = "createbot"\n')
        self.fleet("--robot", robot)
        rows = self.rows("SELECT robot, date, status, path_length_m FROM run ORDER BY robot")
        self.assertEqual([row[:3] for row in rows], [(f"site#{number}", "2026-03-02", "done") for number in (1, 3)])
        self.assertAlmostEqual(rows[1][3], 3 * rows[0][3], 6)

    def test_limits(self):
        make_logs(self.folder / "slow", range(9, 10), 1, Path(ROBOT), 60.0)
        host = worker.Host()
        self.addCleanup(host.close)
        log = str(self.folder / "slow/robot_0009/2026-03-02")
        line = host.ask(log, ROBOT, Limits(2048, 0.05))["line"]
        self.assertRegex(line, "takes longer than the time limit of 0.05 s")
        self.assertRegex(host.ask(log, ROBOT, Limits(1, 60.0))["line"], "needs more than the memory limit of 1 MB")
        self.assertIn("document", host.ask(log, ROBOT, Limits(2048, 60.0)))

    def test_a_host_that_dies_is_started_again(self):
        host = worker.Host()
        self.addCleanup(host.close)
        log = str(self.logs / "robot_0001/2026-03-02")
        first = host.ask(log, ROBOT, Limits())
        host._process.kill()
        host._process.wait()
        self.assertEqual(host.ask(log, ROBOT, Limits()), first)

    def test_a_host_whose_asker_is_gone_ends_without_a_word(self):
        host = subprocess.Popen([sys.executable, "-m", "trundle.fleet.host"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        host.stdout.close()
        host.stdin.write(b'["analyse", "/nowhere", ["/nowhere", "/nowhere"], 2048, 60.0]\n')
        host.stdin.flush()
        with host.stderr:
            self.assertEqual((host.stderr.read(), host.wait()), (b"", 0))
        host.stdin.close()

    def test_a_host_that_dies_costs_no_attempt(self):
        ask, lost = worker.Host.ask, []
        self.addCleanup(setattr, worker.Host, "ask", ask)

        def dies_at_first(host, log, *rest):
            if lost.count(log) < 4:
                lost.append(log)
                raise worker.HostLost(log)
            return ask(host, log, *rest)

        worker.Host.ask = dies_at_first
        self.fleet()
        self.assertEqual(self.rows("SELECT status, count(*) FROM run GROUP BY status"), [("done", 6)])

    def test_shards_together_are_all(self):
        for number in (1, 2, 3):
            self.fleet("--shard", f"{number}/3")
        self.assertEqual(self.rows("SELECT status, count(*) FROM run GROUP BY status"), [("done", 6)])

    def test_the_progress_bar(self):
        bar = Bar(200, True)
        self.assertEqual(bar.line({"waiting": 200}, 0.0), f"[{30 * ' '}] 0 of 200 logs, 0.0/s")
        self.assertEqual(bar.line({"done": 99, "failed": 1, "waiting": 100}, 50.0),
                         f"[{15 * '#'}{15 * ' '}] 100 of 200 logs, 1 failed, 2.0/s 50 s left")
        self.assertEqual(Bar(20000, True).line({"done": 100}, 0.0).split(", ")[1], "0.0/s")

    def test_help_says_which_database_is_enough_and_it_is(self):
        [url] = re.findall(r"(sqlite:///\S+) is enough", " ".join(parser().format_help().split()))
        done = subprocess.run([sys.executable, "-m", "trundle.fleet", str(self.logs), "--database", url, "--workers", "0", "--quiet"], cwd=self.folder)
        self.assertEqual((done.returncode, len(self.rows("SELECT * FROM run"))), (0, 6))

    def test_errors_are_one_line(self):
        for given, code in ((["nowhere", "--database", self.url], 3), ([str(self.logs), "--database", "nothing"], 3),
                            ([str(self.logs), "--database", f"sqlite:///{self.folder}/no/folder.db"], 3)):
            done = subprocess.run([sys.executable, "-m", "trundle.fleet", *given], capture_output=True, text=True)
            self.assertEqual((done.returncode, len(done.stderr.strip().splitlines())), (code, 1), done.stderr)
        for more, line in ((["--robot", "typo.toml"], "typo.toml: does not exist"),
                           (["-o", ROBOT], f"{ROBOT}: File exists; expected a folder to write to")):
            done = subprocess.run([sys.executable, "-m", "trundle.fleet", str(self.logs), "--database", self.url, *more],
                                  capture_output=True, text=True)
            self.assertEqual((done.returncode, len(done.stderr.splitlines())), (3, 1), done.stderr)
            self.assertIn(line, done.stderr)
        address = lambda text: ["x", "--database", self.url, "--scheduler", text]
        for given in (["--database", self.url], ["x", "--database", self.url, "--shard", "3/2"], ["x"],
                      *map(address, ("nonsense", "head:", "foo://head:8786", "tcp://head", "tcp://head:8786/", "head:99999"))):
            done = subprocess.run([sys.executable, "-m", "trundle.fleet", *given], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)


class Leases:
    """The same laws on every database."""

    def prepared(self, logs=20):
        database = store.Store(self.url)
        database.create_tables()
        store.register(database, "request", self.found(logs), lambda log: "type")
        return database

    def found(self, logs):
        return [store.Log(f"/logs/{i:03}", "/robot.toml", f"r{i}", None) for i in range(logs)]

    def final(self, claim, mark):
        row = {column.name: None for column in store.runs.columns}
        row.update(log_id=claim.id, log=claim.path, robot=claim.robot, type="", status="done", line=mark, log_sha256="", robot_sha256="",
                   version="", limits="", document="{}")
        return store.Final(claim.id, "done", row)

    def test_a_log_is_claimed_once(self):
        database = self.prepared(60)
        claims = [[] for _ in range(4)]

        def take(mine):
            while got := store.claim(store.Store(self.url), "request", f"lease {id(mine)}", 3, 60.0):
                mine.extend(claim.id for claim in got)

        threads = [threading.Thread(target=take, args=(mine,)) for mine in claims]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        taken = sum(claims, [])
        self.assertEqual((len(taken), len(set(taken))), (60, 60))
        self.assertEqual(store.progress(database, "request"), {"leased": 60})

    def test_who_lost_the_lease_stores_nothing(self):
        database = self.prepared(1)
        [first] = store.claim(database, "request", "a", 1, 2.0)
        self.assertEqual(store.claim(database, "request", "b", 1, 60.0), [])
        time.sleep(2.5)
        [second] = store.claim(database, "request", "b", 1, 60.0)
        self.assertEqual((second.id, first.losses, second.losses), (first.id, 0, 1))
        self.assertEqual(store.finish(database, "a", [self.final(first, "late")]), 0)
        self.assertEqual(store.finish(database, "b", [self.final(second, "in time")]), 1)
        self.assertEqual(store.finish(database, "b", [self.final(second, "again")]), 0)
        lines = database.transact(lambda connection: connection.execute(sqlalchemy.select(store.runs.c.line)).all())
        self.assertEqual(lines, [("in time",)])

    def test_a_heartbeat_keeps_the_lease(self):
        database = self.prepared(1)
        store.claim(database, "request", "a", 1, 3.0)
        with worker._heartbeat(database, "a", 3.0):
            time.sleep(5.0)
            self.assertEqual(store.claim(database, "request", "b", 1, 60.0), [])
        time.sleep(4.0)
        self.assertEqual(len(store.claim(database, "request", "b", 1, 60.0)), 1)

    def test_a_worker_keeps_its_lease_while_it_computes(self):
        database, stolen = self.prepared(1), []
        robot = self.folder / "robot.toml"
        robot.write_text("")
        log = self.folder / "log"
        log.mkdir()
        store.register(database, "long", [store.Log(str(log), str(robot), "r", None)], lambda log: "type")

        def takes_longer_than_the_lease(*_):
            time.sleep(5.0)
            stolen.extend(store.claim(database, "long", "thief", 1, 60.0))
            return {"line": "computed"}

        with unittest.mock.patch.object(worker.Host, "ask", takes_longer_than_the_lease):
            worker.work_off(worker.Job(self.url, "long", Limits(), lease_s=3.0), 1)
        self.assertEqual(stolen, [])

    def test_a_log_that_kills_its_workers_is_recorded(self):
        database = self.prepared(1)
        for _ in range(store.MOST_LOSSES):
            store.claim(database, "request", "a", 1, -1.0)
        job = worker.Job(self.url, "request", Limits())
        self.assertEqual(worker.work_off(job, 1), 1)
        [run] = database.transact(lambda connection: connection.execute(sqlalchemy.select(store.runs)).all())
        self.assertEqual((run.status, run.line), ("failed", "/logs/000: 10 workers ended while they worked on it"))

    def test_registering_again_leaves_leases(self):
        database = self.prepared(2)
        [claim] = store.claim(database, "request", "a", 1, 60.0)
        self.prepared(2)
        self.assertEqual(store.progress(database, "request"), {"leased": 1, "waiting": 1})
        self.assertEqual(store.finish(database, "a", [self.final(claim, "")]), 1)

    def test_another_request_takes_logs_over(self):
        """Else they were in nobody's count, and never done where their worker is gone."""
        database = self.prepared(2)
        [claim] = store.claim(database, "request", "a", 1, 60.0)
        store.register(database, "another", self.found(2), lambda log: "type")
        self.assertEqual((store.progress(database, "request"), store.progress(database, "another")), ({}, {"waiting": 2}))
        self.assertEqual(store.finish(database, "a", [self.final(claim, "")]), 0)


class LeasesOnSqlite(Leases, WithFolder):
    def setUp(self):
        super().setUp()
        self.url = f"sqlite:///{self.folder}/fleet.db"


if __name__ == "__main__":
    unittest.main()
