"""Slurm of Debian on this machine alone: controller, one node, and munge by which they know each other, in a folder of their own; for tests."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from guard import Guard

_PATH = os.pathsep.join((os.environ.get("PATH", ""), "/usr/sbin", "/usr/bin"))  # daemons are not on a user's
MISSING = [name for name in ("munged", "slurmctld", "slurmd", "slurmstepd", "sbatch") if shutil.which(name, path=_PATH) is None]
PACKAGES = "slurmctld slurmd slurm-client munge"

# No cgroups, no database of accounts, and two processors whatever the machine has.
_CONFIGURATION = """
ClusterName=fleet
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MailProg=/bin/true
PropagateResourceLimits=NONE
ReturnToService=2
SchedulerParameters=sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
NodeName=localhost NodeAddr=127.0.0.1 CPUs=2
PartitionName=fleet Nodes=localhost Default=YES
"""


def can_be_installed() -> bool:
    """Whether the system has such packages."""
    try:
        return subprocess.run(["apt-cache", "show", *PACKAGES.split()], capture_output=True, check=False).returncode == 0
    except OSError:  # not a Debian
        return False


class Slurm:
    """Nothing of it outlives this process, however that ends: a guard kills what is left."""

    def __init__(self) -> None:
        runs_none = os.statvfs(tempfile.gettempdir()).f_flag & os.ST_NOEXEC  # scripts of jobs are run from there
        self.folder = Path(tempfile.mkdtemp(prefix="fleet_slurm_", dir="/var/tmp" if runs_none else None))
        self.folder.chmod(0o711)  # as munged asks of where its socket is
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        (self.folder / "munge.key").touch(0o600)
        (self.folder / "munge.key").write_bytes(os.urandom(64))
        python = str(Path(sys.executable).parent)  # `python3` of a job is this one
        outer = {name: value for name, value in os.environ.items() if not name.startswith(("SLURM", "SBATCH"))}  # where this is a job itself
        self.environment = {**outer, "PATH": os.pathsep.join((python, _PATH)), "SLURM_CONF": str(self.folder / "slurm.conf")}
        self._daemons: list[subprocess.Popen[bytes]] = []
        self._guard = Guard(self.folder)

    def start(self) -> None:
        self._configure()
        mine = {option: str(self.folder / name) for option, name in (
            ("--key-file", "munge.key"), ("--socket", "munge.socket"), ("--pid-file", "munged.pid"), ("--seed-file", "munged.seed"))}
        self._daemon("munged", "--foreground", *(word for pair in mine.items() for word in pair))
        self.until((self.folder / "munge.socket").exists, "munged does not listen")
        self._daemon("slurmctld", "-D")
        self._daemon("slurmd", "-D", "-N", "localhost")
        self.until(lambda: self._call("sinfo", "--noheader", "--format=%T").stdout == "idle\n", "the node is not there")

    def _configure(self) -> None:
        with socket.socket() as one, socket.socket() as other:
            for free in (one, other):
                free.bind(("127.0.0.1", 0))
            ports = {"controller_port": one.getsockname()[1], "node_port": other.getsockname()[1]}
        text = _CONFIGURATION.format(folder=self.folder, user=pwd.getpwuid(os.geteuid()).pw_name, **ports)
        (self.folder / "slurm.conf").write_text(text)

    def _daemon(self, *words: str) -> None:
        with open(self.folder / f"{words[0]}.log", "wb") as log:
            self._daemons.append(subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=self.folder, env=self.environment))

    def _call(self, *words: str, **options: Any) -> subprocess.CompletedProcess[str]:
        return subprocess.run(words, capture_output=True, text=True, env=self.environment, **options)

    def until(self, is_so: Callable[[], bool], otherwise: str, seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not is_so():
            if time.monotonic() > end or any(daemon.poll() is not None for daemon in self._daemons):
                raise RuntimeError(f"{otherwise}\n{self.said()}")
            time.sleep(0.2)  # what asks is a process or more

    def said(self) -> str:
        """The ends of all logs, and what jobs printed."""
        files = sorted([*self.folder.glob("*.log"), *self.folder.glob("*.out")])
        return "".join(f"== {file.name}\n{file.read_text(errors='replace')[-1500:]}\n" for file in files)

    def command(self, line: str) -> str:
        """What a line for the shell prints, which has to succeed, in Slurm's folder."""
        done = self._call("sh", "-c", line, cwd=self.folder)
        if done.returncode != 0:
            raise RuntimeError(f"{line}: {done.stdout}{done.stderr}\n{self.said()}")
        return done.stdout

    def wait(self, job: str, seconds: float = 300.0) -> list[dict[str, str]]:
        """Until none of a job's tasks is to run any more."""
        self.until(lambda: self.command(f"squeue --noheader --jobs={job}") == "", f"job {job} does not end", seconds)
        return self.tasks(job)

    def tasks(self, job: str) -> list[dict[str, str]]:
        """What Slurm says of each."""
        lines = self.command(f"scontrol --oneliner show job {job}").splitlines()
        return [dict(word.split("=", 1) for word in line.split() if "=" in word) for line in lines]

    def close(self) -> None:
        self._guard.close()
        for daemon in self._daemons:
            daemon.wait(30)
