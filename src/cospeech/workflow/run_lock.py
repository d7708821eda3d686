"""Lock on the results of a run; the kernel releases it when the process ends, even if it is killed."""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import IO

from cospeech.errors import UserError

_held: dict[Path, IO[str]] = {}


def hold(path: Path) -> None:
    """Lock ``path`` until this process ends.

    Raises
    ------
    UserError : if another process holds the lock.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle = path.open("w")
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        handle.close()
        raise UserError(
            f"{path}: another cospeech run is writing the same results; wait for it, or stop it and run again"
        ) from None
    _held[path] = handle
