"""A process that works on one log, or one report, at a time, each in a child of its own with a limit of memory and of time.

The host has imported all that the work needs, so that a child is a fork of a few milliseconds; it has one thread, as
a fork needs. It is spoken to in lines of JSON on its standard streams, and ends with whoever started it.
"""

from __future__ import annotations

import errno
import json
import os
import resource
import select
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, Optional

from .logs import path_and_number


class Limits(NamedTuple):
    memory_mb: int = 2048
    time_s: float = 300.0


class HostLost(RuntimeError):
    """The host process is gone."""


class Host:
    """The other side: asks a host process, and starts it anew where it is gone."""

    def __init__(self) -> None:
        self._process: Optional[subprocess.Popen[bytes]] = None

    def ask(self, log: str, robot_file: str, limits: Limits) -> dict[str, Any]:
        """{"document": what `work.analyse` gives} or {"line": why there is none}."""
        answer, path = self._ask("analyse", log, [log, robot_file], limits), path_and_number(log)[0]
        line = answer.get("line", path)
        if path not in line and robot_file not in line:  # a recording is called as its folder, and a day is the name of many
            answer["line"] = f"{log}: {line.removeprefix(f'{Path(path).name}: ')}"
        return answer

    def ask_report(self, robot: str, shows: dict[str, Any], limits: Limits) -> dict[str, Any]:
        """{"document": what `work.report` gives} or {"line": why there is none}."""
        name = f"report of {robot}"
        answer = self._ask("report", name, [shows], limits)
        if not answer.get("line", name).startswith(name):  # which of its logs it was does not say whose
            answer["line"] = f"{name}: {answer['line']}"
        return answer

    def _ask(self, what: str, name: str, arguments: list[Any], limits: Limits) -> dict[str, Any]:
        if self._process is None or self._process.poll() is not None:
            self.close()
            self._process = subprocess.Popen(
                [sys.executable, "-m", "trundle.fleet.host"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(json.dumps([what, name, arguments, *limits]).encode() + b"\n")
            process.stdin.flush()
            answer = process.stdout.readline()
        except OSError:
            answer = b""
        except BaseException:  # Ctrl-C: its answer would be taken for that of the next log
            self.close()
            raise
        if not answer.endswith(b"\n"):
            self.close()
            raise HostLost(f"{name}: the process that worked on it is gone")
        found: dict[str, Any] = json.loads(answer)
        return found

    def close(self) -> None:
        if self._process is None:
            return
        process, self._process = self._process, None
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:
                    pass
        process.kill()
        process.wait()


class _Asked(NamedTuple):
    what: str  # a function of work.py
    name: str  # in lines of errors
    arguments: list[Any]
    limits: Limits


def _child(asked: _Asked, folder: str, out: int) -> NoReturn:
    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()  # before the log
    limit = own + (asked.limits.memory_mb << 20)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    tempfile.tempdir = folder  # the host removes it, however this ends
    import trundle

    from . import work

    answer: dict[str, Any]
    try:
        answer = {"document": getattr(work, asked.what)(*asked.arguments)}
    except (MemoryError, ValueError, OSError, trundle.CannotAnswer) as error:
        no_memory = isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM
        needs = f"{asked.name}: needs more than the memory limit of {asked.limits.memory_mb} MB"
        answer = {"line": needs if no_memory else str(error).splitlines()[0]}
    with os.fdopen(out, "wb") as stream:
        stream.write(json.dumps(answer, allow_nan=False).encode())
    os._exit(0)


def _fork(asked: _Asked, folder: str) -> tuple[int, int]:
    readable, writable = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.close(readable)
            os.dup2(os.open(os.devnull, os.O_RDWR), 0)
            os.dup2(2, 1)  # whatever a library prints does not get among the answers
            _child(asked, folder, writable)
        except BaseException as error:
            os.write(2, f"trundle-fleet: {asked.name}: {type(error).__name__}: {error}\n".encode())
            os._exit(1)
    os.close(writable)
    return pid, readable


def _work_on(asked: _Asked, folder: str) -> dict[str, Any]:
    pid, readable = _fork(asked, folder)
    end, parts, timed_out = time.monotonic() + asked.limits.time_s, [], False
    while True:
        left = end - time.monotonic()
        ready = select.select([readable, 0], [], [], max(left, 0.0))[0]
        if readable in ready:
            part = os.read(readable, 1 << 16)
            if not part:
                break
            parts.append(part)
        elif 0 in ready or left <= 0.0:  # nothing is sent while an answer is due: the asker is gone
            timed_out = left <= 0.0
            os.kill(pid, signal.SIGKILL)
            break
    os.close(readable)
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if timed_out:
        return {"line": f"{asked.name}: takes longer than the time limit of {asked.limits.time_s:g} s"}
    if status < 0:
        return {"line": f"{asked.name}: the program was ended by {signal.Signals(-status).name}"}
    if status > 0 or not parts:
        return {"line": f"{asked.name}: the program failed; its error is on the worker's standard error"}
    answer: dict[str, Any] = json.loads(b"".join(parts))
    return answer


def main() -> int:
    import numpy  # noqa: F401  which the extension imports when it first needs it: once here, not in every child

    from . import work  # noqa: F401

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who started it
    while (line := sys.stdin.buffer.readline()).endswith(b"\n"):
        what, name, arguments, *limits = json.loads(line)
        with tempfile.TemporaryDirectory(prefix="trundle-") as folder:
            answer = _work_on(_Asked(what, name, arguments, Limits(*limits)), folder)
        try:
            os.write(1, json.dumps(answer).encode() + b"\n")
        except BrokenPipeError:  # the asker was interrupted
            break
    return 0


if __name__ == "__main__":
    sys.exit(main())
