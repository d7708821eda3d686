"""Runs of the workflow in a separate folder under ``bench/out``, with their time and memory."""

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
    """Elapsed seconds, processor seconds, and the peak memory of the largest process."""

    wall_s: float
    cpu_s: float
    peak_mb: float


def folder(name: str, config: dict[str, Any]) -> Path:
    """Return a new folder that contains only this configuration."""
    path = OUT / name
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    (path / "config.yaml").write_text(yaml.safe_dump(config | {"run": RUN}))
    return path


def snakemake(path: Path, *arguments: str, snakefile: Path = ROOT / "Snakefile") -> Took:
    """Run Snakemake in folder ``path``; its output is written to ``snakemake.log``.

    Raises
    ------
    SystemExit : if Snakemake fails.
    """
    command = [
        *(sys.executable, "-m", "snakemake", *arguments, "--snakefile", str(snakefile)),
        *("--directory", str(path), "--configfile", str(path / "config.yaml"), "--cores", "2"),
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "PYTHONWARNINGS": "ignore"}
    begun_s = time.perf_counter()
    with (path / "snakemake.log").open("w") as said:
        process = subprocess.Popen(command, env=environment, stdout=said, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"snakemake failed; see {path / 'snakemake.log'}")
    return Took(time.perf_counter() - begun_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)
