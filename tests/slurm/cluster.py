"""A real Slurm of one node on this machine: installed from Debian's packages, started, and stopped again.

Every step is bounded in time, as a failed start of Slurm hangs rather than fails.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

CONF = Path("/etc/slurm/slurm.conf")  # srun inside a job looks nowhere else, whatever SLURM_CONF says
STATE = Path("/var/lib/cospeech-slurm")
MARK = "ClusterName=cospeech"

# No accounting, no process tracking by cgroups: what a container or a small machine offers.
SETTINGS = """\
{mark}
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
ReturnToService=2
StateSaveLocation={state}/ctld
SlurmdSpoolDir={state}/d
SlurmctldPidFile={state}/slurmctld.pid
SlurmdPidFile={state}/slurmd.pid
SlurmctldLogFile={state}/slurmctld.log
SlurmdLogFile={state}/slurmd.log
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory_mb} State=UNKNOWN
PartitionName=local Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def obstacle() -> str | None:
    """Return why no Slurm can be started here, or None."""
    if os.geteuid() != 0:
        return "needs root, to start Slurm's daemons"
    if not shutil.which("slurmctld") and not shutil.which("apt-get"):
        return "needs Slurm, or apt to install it from Debian's packages"
    if CONF.exists() and MARK not in CONF.read_text(encoding="utf-8"):
        return f"another Slurm is configured in {CONF}, which is left alone"
    return None


@contextmanager
def cluster() -> Iterator[str]:
    """Run a Slurm of one node and give the name of its partition.

    Raises
    ------
    RuntimeError : where a daemon does not start; with the end of its log.
    """
    _install()
    _configure()
    try:
        _start()
        yield "local"
    finally:
        _stop()


def _run(*command: str, timeout_s: float = 60, check: bool = True) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, text=True, check=check, timeout=timeout_s, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )


def _install() -> None:
    if not shutil.which("slurmctld"):
        quiet = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
        for words in (["update"], ["install", "--yes", "--no-install-recommends", "slurm-wlm", "munge"]):
            subprocess.run(["apt-get", "-qq", *words], check=True, timeout=600, env=quiet, stdout=subprocess.DEVNULL)


def _configure() -> None:
    shutil.rmtree(STATE, ignore_errors=True)
    for folder in (STATE / "ctld", STATE / "d"):
        folder.mkdir(parents=True)
    CONF.parent.mkdir(parents=True, exist_ok=True)
    memory_mb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
    CONF.write_text(
        SETTINGS.format(
            mark=MARK, host=socket.gethostname(), state=STATE, cpus=os.cpu_count(), memory_mb=memory_mb * 9 // 10
        ),
        encoding="utf-8",
    )


def _start() -> None:
    run = Path("/run/munge")
    run.mkdir(exist_ok=True)
    shutil.chown(run, "munge", "munge")
    if not _answers("munge", "--no-input"):
        _run("runuser", "--user", "munge", "--", "munged", "--force", timeout_s=20)
    _await("munge", "--no-input")
    _run("slurmctld", "-i", "-c", timeout_s=20)
    _run("slurmd", timeout_s=20)
    _await("srun", "--partition", "local", "--immediate=5", "true")


def _answers(*command: str) -> bool:
    try:
        return _run(*command, timeout_s=10, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def _await(*command: str, seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not _answers(*command):
        if time.monotonic() > end:
            logs = [log.read_text(errors="replace")[-1500:] for log in sorted(STATE.glob("*.log"))]
            raise RuntimeError(f"Slurm does not answer to '{' '.join(command)}'\n" + "\n".join(logs))
        time.sleep(0.5)


def _stop() -> None:
    for daemon in ("slurmd", "slurmctld"):
        _run("pkill", "--exact", daemon, timeout_s=20, check=False)
    CONF.unlink(missing_ok=True)
