"""What commands tell the user while they work."""

from __future__ import annotations

import sys

from cospeech.kernels import numba_cache

COMPILING_S = 10
"""Time in seconds that the first compilation takes, roughly."""


def note(line: str) -> None:
    """Write one line to stderr: results alone go to stdout."""
    print(f"cospeech: {line}", file=sys.stderr, flush=True)


def note_compilation() -> None:
    """Say that the inner loops are compiled first, if they are."""
    if not numba_cache.is_filled():
        note(f"compiling the inner loops, which takes about {COMPILING_S} s, only this time")
