"""Running the workflow in a folder of its own under ``bench/out``, and what it took."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import yaml

ROOT = Path(__file__).parents[1]
OUT = ROOT / "bench" / "out"
RUN = "bench"


class Took(NamedTuple):
    """Seconds that passed, seconds of all processors, and the peak memory of the largest process."""

    wall_s: float
    cpu_s: float
    peak_mb: float


def folder(name: str, config: dict[str, Any]) -> Path:
    """Return an empty folder with this configuration in it."""
    path = OUT / name
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    (path / "config.yaml").write_text(yaml.safe_dump(config | {"run": RUN}))
    return path


def snakemake(path: Path, *arguments: str, snakefile: Path = ROOT / "Snakefile") -> Took:
    """Run Snakemake there to its end; what it says lands in ``said.log``.

    Raises
    ------
    SystemExit : where it fails.
    """
    command = [
        *(sys.executable, "-m", "snakemake", *arguments, "--snakefile", str(snakefile)),
        *("--directory", str(path), "--configfile", str(path / "config.yaml"), "--cores", "2"),
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "PYTHONWARNINGS": "ignore"}
    begun_s = time.perf_counter()
    with (path / "said.log").open("w") as said:
        process = subprocess.Popen(command, env=environment, stdout=said, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"snakemake failed; see {path / 'said.log'}")
    return Took(time.perf_counter() - begun_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)
