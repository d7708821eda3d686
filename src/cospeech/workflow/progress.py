"""Progress reports of long jobs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

JOB_PROGRESS_VARIABLE = "COSPEECH_PROGRESS"
"""Environment variable; if it is set, jobs report their progress on stderr and not only in their logs."""

INTERVAL_S = 10.0
"""Minimum time between two progress reports of a job."""

Item = TypeVar("Item")


def write_line(line: str) -> None:
    """Write ``line`` and its newline to stderr in one call, so that lines of threads never mix."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def clock(seconds: float) -> str:
    """Format a duration as h:mm:ss."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


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
