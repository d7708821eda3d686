"""Progress reports of long jobs."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

JOB_PROGRESS_VARIABLE = "COSPEECH_PROGRESS"
"""Environment variable; if it is set, jobs report their progress on stderr and not only in their logs."""

INTERVAL_S = 10.0
"""Minimum time between two progress reports of a job."""

interrupted = threading.Event()
"""Set in the main process when the user presses Ctrl-C."""

Item = TypeVar("Item")


def write_line(line: str) -> None:
    """Write ``line`` and its newline to stderr in one call, so that lines of threads never mix."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def tell(line: str) -> None:
    """Write ``line``, unless the run is quiet."""
    if JOB_PROGRESS_VARIABLE in os.environ:
        write_line(f"cospeech: {line}")


def clock(seconds: float) -> str:
    """Format a duration as h:mm:ss."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def done(target_jobs: Iterable[Any], report: str) -> str:
    """Return what a successful run says at its end: where the files lie that were asked for.

    Parameters
    ----------
    target_jobs : the jobs of Snakemake that were asked for: rules that only collect files, or rules that make them.
    report : path of the report.
    """
    files = [str(path) for job in target_jobs for path in (*job.output, *([] if job.output else job.input))]
    if report in files:
        return f"done; the report is {report}"
    if not files:
        return "done"
    return f"done; see {os.path.commonpath(files)}"


def followed(items: Sequence[Item], unit: str, report: Callable[[str], None]) -> Iterator[Item]:
    """Yield ``items``, and every ``INTERVAL_S`` report how many are done and the estimated time left."""
    start_s = reported_s = time.monotonic()
    for done, item in enumerate(items):
        now_s = time.monotonic()
        if done and now_s - reported_s >= INTERVAL_S:
            reported_s = now_s
            left_s = (now_s - start_s) / done * (len(items) - done)
            report(f"{done} of {len(items)} {unit}, about {clock(left_s)} left")
        yield item
