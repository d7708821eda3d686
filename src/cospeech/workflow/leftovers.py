"""Temporary files of jobs that were killed."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from cospeech.data import tables


def remove(folders: Iterable[Path]) -> int:
    """Remove the temporary files (see ``tables.replacing``) below ``folders``, and return their number.

    No job may be writing there.
    """
    removed = 0
    for top in folders:
        for folder, _, names in os.walk(top):
            for name in filter(tables.is_temporary, names):
                Path(folder, name).unlink(missing_ok=True)
                removed += 1
    return removed
