"""How far a long job is, for a person who waits."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

SAID_BY_JOBS = "COSPEECH_PROGRESS"
"""Set in the environment where jobs are to tell their progress on stderr, and not in their logs alone."""

EVERY_S = 10.0
"""Least time between two lines of one job."""

Thing = TypeVar("Thing")


def tell(line: str) -> None:
    """Write ``line`` with its end on stderr: nothing comes between the two, even where stderr keeps no buffer."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def clock(seconds: float) -> str:
    """Return a time as h:mm:ss."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def followed(things: Sequence[Thing], unit: str, say: Callable[[str], None]) -> Iterator[Thing]:
    """Yield ``things``, and say every ``EVERY_S`` how many of them are done and how long the rest may take."""
    begun_s = said_s = time.monotonic()
    for done, thing in enumerate(things):
        now_s = time.monotonic()
        if done and now_s - said_s >= EVERY_S:
            said_s = now_s
            left_s = (now_s - begun_s) / done * (len(things) - done)
            say(f"{done} of {len(things)} {unit}, about {clock(left_s)} left")
        yield thing
