#!/usr/bin/env python3
"""Runs every command where something is not as usual, and looks at what it leaves.

    tools/odd_environments.py PROGRAM [--only WORD]

Each row of ENVIRONMENTS names an environment, the exit codes that may come of it, and how it is made. In each, every
command of COMMANDS runs in a fresh copy of the bundled sample, over the results of an earlier run. It fails on another
exit code, on more than a minute, on inputs that changed, on a temporary file, and on results that are neither those of
before nor, to the last byte, those that it writes where all is as usual; with exit code 0 they must be the new ones.
What cannot be made here (mounts need root) is counted as not tried.
"""
import argparse
import contextlib
import hashlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

DEMO = Path(__file__).resolve().parent.parent / "data/demo"
NOBODY = 65534
COMMANDS = {
    "info": "info tour --robot robot.toml",
    "odometry": "odometry tour --robot robot.toml -o out/t.csv",
    "slip": "slip tour --robot robot.toml -o out/slip.csv --corrected out/c.csv",
    "calibrate": "calibrate square straight --robot robot.toml -o out/calibrated.toml",
    "slam": "slam tour --robot robot.toml --particles 20 -o out",
    "localize": "localize tour --robot robot.toml --map map.csv --start 0,0,0 -o out/t.csv",
    "run": "run tour --robot robot.toml --particles 20 -o out",
    "simulate": "simulate scenario.toml -o out",
    "evaluate": "evaluate truth.csv tour",
    "report": "report results -o out/report.html",
    "live": "live --robot robot.toml --checkpoint out/state --checkpoint-every-s 1",
}


def limit(which, value):
    return {"preexec": lambda: resource.setrlimit(which, (value, value))}


def closing(*streams):
    return {"preexec": lambda: [os.close(stream) for stream in streams], "no_input": 0 in streams}


def nobody():
    os.setgroups([])
    os.setgid(NOBODY)
    os.setuid(NOBODY)


@contextlib.contextmanager
def mounted(folder, options):
    """A file system of its own in the place of the results."""
    out = folder / "out"
    kept = {path.name: path.read_bytes() for path in out.iterdir()}
    if os.geteuid() != 0 or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", out],
                                           capture_output=True).returncode != 0:
        yield None
        return
    for name, content in kept.items():
        (out / name).write_bytes(content)
    if options:
        subprocess.run(["mount", "-o", f"remount,{options}", out], check=True)
    try:
        yield {}
    finally:
        subprocess.run(["umount", out], check=True)


@contextlib.contextmanager
def locale(folder, name):
    """Debian has the sources of every locale; what is compiled here is used by this program alone."""
    places = folder.parent / "locales"
    places.mkdir(exist_ok=True)
    if subprocess.run(["localedef", "-i", name, "-f", "UTF-8", places / f"{name}.UTF-8"], capture_output=True).returncode > 1:
        yield None
        return
    yield {"env": {**os.environ, "LOCPATH": str(places), "LC_ALL": f"{name}.UTF-8", "LANG": f"{name}.UTF-8"}}


@contextlib.contextmanager
def rights(folder, mode, what="out"):
    """The program runs as nobody; root may do everything."""
    if os.geteuid() != 0:
        yield None
        return
    for path in (folder, *folder.rglob("*")):
        os.chown(path, NOBODY, NOBODY)
    for parent in folder.parents:
        if not parent.stat().st_mode & 1:
            yield None
            return
    (folder / what).chmod(mode)
    try:
        yield {"preexec": nobody, "foreign": True}
    finally:
        (folder / what).chmod(0o755)


@contextlib.contextmanager
def instead(folder, name, make):
    """Something else in the place of an input."""
    path = folder / name
    kept = folder.parent / "kept"
    path.rename(kept)
    make(path)
    try:
        yield {"foreign": True}
    finally:
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        kept.rename(path)


@contextlib.contextmanager
def elsewhere(folder):
    """The results' folder is a link to another file system."""
    with tempfile.TemporaryDirectory() as other:
        shutil.copytree(folder / "out", Path(other) / "out")
        shutil.rmtree(folder / "out")
        (folder / "out").symlink_to(Path(other) / "out")
        yield {"foreign": True}
        (folder / "out").unlink()
        shutil.copytree(Path(other) / "out", folder / "out")


def always(options):
    return lambda folder: contextlib.nullcontext(options)


def words(**changes):
    """Words of the command line that become others."""
    return always({"words": changes})


LONG = "n" * 300
PATH = "/".join(["d" * 200] * 30)
DONE, LOST, BAD = {0}, {0, 3}, {3}
ENVIRONMENTS = {
    "no environment variables, so no HOME": (DONE, always({"env": {}})),
    "HOME and TMPDIR that are not there": (DONE, always({"env": {"HOME": "/nowhere", "TMPDIR": "/nowhere"}})),
    "another time zone": (DONE, always({"env": {"TZ": "Pacific/Kiritimati"}})),
    "a locale that is not there": (DONE, always({"env": {"LC_ALL": "xx_XX.nonsense"}})),
    "the locale C": (DONE, always({"env": {"LC_ALL": "C"}})),
    "German numbers": (DONE, lambda folder: locale(folder, "de_DE")),
    "Turkish letters": (DONE, lambda folder: locale(folder, "tr_TR")),
    "Arabic": (DONE, lambda folder: locale(folder, "ar_EG")),
    "stdin closed": ({0, 3}, always(closing(0))),
    "stdout closed": (LOST, always(closing(1))),
    "stderr closed": (DONE, always(closing(2))),
    "stdout and stderr closed": (LOST, always(closing(1, 2))),
    "all streams closed": (LOST, always(closing(0, 1, 2))),
    "a full stdout": (LOST, always({"stdout": "/dev/full"})),
    "a full stderr": (DONE, always({"stderr": "/dev/full"})),
    "files of 0 bytes at most": (LOST, always(limit(resource.RLIMIT_FSIZE, 0))),
    "files of 5000 bytes at most": (LOST, always(limit(resource.RLIMIT_FSIZE, 5000))),
    "4 open files at most": (LOST, always(limit(resource.RLIMIT_NOFILE, 4))),
    "6 open files at most": (LOST, always(limit(resource.RLIMIT_NOFILE, 6))),
    "10 open files at most": (LOST, always(limit(resource.RLIMIT_NOFILE, 10))),
    # Into less than 23 MB the loader does not get the program and its libraries.
    "24 MB of addresses": (LOST, always(limit(resource.RLIMIT_AS, 24_000_000))),
    "25 MB of addresses": (LOST, always(limit(resource.RLIMIT_AS, 25_000_000))),
    "30 MB of addresses": (LOST, always(limit(resource.RLIMIT_AS, 30_000_000))),
    "40 MB of addresses": (LOST, always(limit(resource.RLIMIT_AS, 40_000_000))),
    "a stack of 256 KB": (DONE, always(limit(resource.RLIMIT_STACK, 262144))),
    "no core, no locked memory": (DONE, always(limit(resource.RLIMIT_MEMLOCK, 0))),
    "a mask that takes all rights": (LOST, always({"preexec": lambda: os.umask(0o777)})),
    "one processor": (DONE, always({"preexec": lambda: os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})})),
    "SIGPIPE ignored": (DONE, always({"preexec": lambda: signal.signal(signal.SIGPIPE, signal.SIG_IGN)})),
    "SIGINT, SIGTERM and SIGHUP ignored": (DONE, always({"preexec": lambda: [
        signal.signal(s, signal.SIG_IGN) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]})),
    "a disk of 64 KB": (LOST, lambda folder: mounted(folder, None)),
    "a read-only disk": (LOST, lambda folder: mounted(folder, "ro")),
    "results on another disk, by a link": (DONE, elsewhere),
    "a folder that may not be written": (LOST, lambda folder: rights(folder, 0o555)),
    "a folder that may not be searched": (LOST, lambda folder: rights(folder, 0o000)),
    "a recording that may not be read": (LOST, lambda folder: rights(folder, 0o000, "tour/wheels.csv")),
    "a robot file that may not be read": (LOST, lambda folder: rights(folder, 0o000, "robot.toml")),
    "a loop of links for the recording": (LOST, lambda f: instead(f, "tour", lambda p: p.symlink_to("tour"))),
    "a loop of links for the robot": (LOST, lambda f: instead(f, "robot.toml", lambda p: p.symlink_to("robot.toml"))),
    "a pipe for the robot": (LOST, lambda f: instead(f, "robot.toml", os.mkfifo)),
    "a pipe for the wheels": (LOST, lambda f: instead(f, "tour/wheels.csv", os.mkfifo)),
    "a pipe for the map": (LOST, lambda f: instead(f, "map.csv", os.mkfifo)),
    "/dev/zero for the robot": (LOST, lambda f: instead(f, "robot.toml", lambda p: p.symlink_to("/dev/zero"))),
    "/dev/zero for the wheels": (LOST, lambda f: instead(f, "tour/wheels.csv", lambda p: p.symlink_to("/dev/zero"))),
    "/dev/zero for the scenario": (LOST, lambda f: instead(f, "scenario.toml", lambda p: p.symlink_to("/dev/zero"))),
    "a folder for the wheels": (LOST, lambda f: instead(f, "tour/wheels.csv", Path.mkdir)),
    "a socket or nothing for the robot": (LOST, lambda f: instead(f, "robot.toml", lambda p: p.symlink_to("nowhere"))),
    "a name of 300 bytes for the results": (LOST, words(out=LONG)),
    "a path of 6000 bytes for the results": (LOST, words(out=PATH)),
    "a name of 300 bytes for the inputs": (LOST, words(**{"tour": LONG, "robot.toml": LONG, "scenario.toml": LONG})),
    "results below a file": (LOST, words(out="robot.toml")),
    "results below /dev/null": (LOST, words(out="/dev/null")),
    "results below /proc": (LOST, words(out="/proc/1/out")),
}


def write_sample(folder):
    session = DEMO / "session_01"
    for name in ("tour", "straight", "square_cw_01"):
        (folder / name.removesuffix("_cw_01")).mkdir(parents=True)
        for file in (session / name).glob("*"):
            lines = file.read_bytes().splitlines(keepends=True)
            (folder / name.removesuffix("_cw_01") / file.name).write_bytes(b"".join(lines[:600]))
    shutil.copy(DEMO / "robot.toml", folder)
    shutil.copy(session / "tour/landmarks.csv", folder / "map.csv")
    shutil.copy(folder / "tour/reference.csv", folder / "truth.csv")
    (folder / "scenario.toml").write_text((DEMO / "slip.toml").read_text())
    rows = [row.split(",") for row in (folder / "tour/wheels.csv").read_text().splitlines() if not row.startswith("#")]
    names = [name.removesuffix("_ticks") for name in rows[0][1:]]
    (folder / "readings.jsonl").write_text("".join(
        f'{{"time_s": {r[0]}, "wheels": {{{", ".join(f"{chr(34)}{n}{chr(34)}: {v}" for n, v in zip(names, r[1:]))}}}}}\n'
        for r in rows[1:]))
    (folder / "out").mkdir()
    (folder / "out/notes.txt").write_text("of somebody else")


def digests(folder, ignored=None):
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.rglob("*"))
            if path.is_file() and str(path.relative_to(folder)) != ignored}


def run(program, line, folder, options):
    with open(folder / "readings.jsonl", "rb") as stdin, open(options.get("stdout", "/dev/null"), "wb") as stdout, \
            open(options.get("stderr", folder.parent / "stderr"), "wb") as stderr:
        return subprocess.run([program, *line], cwd=folder, stdin=stdin, stdout=stdout, stderr=stderr, timeout=60,
                              env=options.get("env", os.environ), preexec_fn=options.get("preexec")).returncode


def line_of(command, changes):
    replaced = lambda word: "/".join(changes.get(part, part) for part in word.split("/"))
    return [replaced(word) for word in COMMANDS[command].split()]


def fault(code, wanted, before, now, new):
    if code not in wanted:
        return f"exit code {code}"
    if temporary := [name for name in now if "trundle-new" in name]:
        return f"left {temporary[0]}"
    if now == new or (now == before and code != 0):
        return None
    differing = sorted(n for n in set(now) | set(new) if now.get(n) not in (before.get(n), new.get(n)) or
                       (code == 0 and now.get(n) != new.get(n)))
    # Two files that are not a set may be one of the old and one of the new.
    return f"exit code {code}, and {', '.join(differing[:4])} neither as before nor as new" if differing else None


def one(program, command, wanted, make, scratch, new):
    folder = scratch / "case"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(scratch / "sample", folder, symlinks=True)
    before = digests(folder)
    with make(folder) as options:
        if options is None:
            return None
        changes = options.get("words", {})
        try:
            code = run(program, line_of(command, changes), folder, options)
        except subprocess.TimeoutExpired:
            return f"{command}: does not end"
        now = None if options.get("foreign") else digests(folder)
    now = now or digests(folder)  # only now may all of it be read
    if command == "live" and options.get("no_input"):
        new = now  # of no lines
    if changes and code == 0 and command not in ("info", "evaluate"):
        now = new if now != before else now
    found = fault(code, wanted, before, now, new)
    return f"{command}: {found}: {(scratch / 'stderr').read_text(errors='replace')[-150:].strip()}" if found else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    program = options.program.resolve()
    tried = untried = failed = 0
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        scratch.chmod(0o755)
        write_sample(scratch / "sample")
        run(program, "run tour --robot robot.toml --particles 20 -o results".split(), scratch / "sample", {})
        new = {}
        for command in COMMANDS:
            shutil.copytree(scratch / "sample", scratch / "usual")
            if code := run(program, line_of(command, {}), scratch / "usual", {}):
                sys.exit(f"{command}: exit code {code} where all is as usual: {(scratch / 'stderr').read_text()}")
            new[command] = digests(scratch / "usual")
            shutil.rmtree(scratch / "usual")
        for environment, (wanted, make) in ENVIRONMENTS.items():
            if options.only not in environment:
                continue
            results = [one(program, command, wanted, make, scratch, new[command]) for command in COMMANDS]
            tried += sum(result is not None for result in results)
            untried += sum(result is None for result in results)
            faults = [result for result in results if result]
            failed += len(faults)
            print(f"{environment}: {'not tried' if None in results else 'ok' if not faults else ''}", flush=True)
            for result in faults:
                print(f"  {result}", flush=True)
    print(f"{tried} commands in {len(ENVIRONMENTS)} environments, {failed} failed, {untried} not tried")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
