"""Lock on the results of a run; the kernel releases it when the process ends, even if it is killed."""

from __future__ import annotations

import errno
import fcntl
import os
import stat
from pathlib import Path

from cospeech.errors import UserError

MARKS = ("run", "logs", "corpus", "capture")
"""Folders of which every run makes some. They identify its results where the lock file was not copied with them."""

_held: dict[Path, int] = {}


def hold(path: Path) -> None:
    """Lock ``path``, a file in the folder of results, until this process ends.

    Raises
    ------
    UserError : if another process holds the lock, if the folder cannot be written to, or if it contains files but no
        results of a run.
    """
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.path.lexists(path):
            names = {entry.name for entry in folder.iterdir()}
            if names and not names.intersection(MARKS):
                raise UserError(
                    f"{folder}: contains files, but no results of cospeech; change `run` in the configuration, or "
                    "move these files"
                )
        # A link is not followed and nothing is truncated: the lock may be a file that somebody else put there.
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise UserError(_explain(error, path)) from None
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise UserError(f"{path}: is not an ordinary file, so it cannot be the lock of a run; remove it")
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise UserError(
            f"{path}: another cospeech run is writing the same results; wait for it, or stop it and run again"
        ) from None
    _held[path] = handle


def check_writable(folder: Path) -> None:
    """Make ``folder`` if there is none. Raise UserError if nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(_explain(error, folder)) from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UserError(_explain(PermissionError(errno.EACCES, ""), folder.absolute()))


def _explain(error: OSError, path: Path) -> str:
    """Return one line about an error at ``path``, or at one of the folders that contain it."""
    if error.errno in (errno.EEXIST, errno.ENOTDIR):
        blocking = next((one for one in (path, *path.parents) if one.is_file()), path)
        return f"{blocking}: is a file, where a folder of results is needed; move it"
    return f"{error.filename or path}: {_reason(error)}"


def _reason(error: OSError) -> str:
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "is read-only, or belongs to another user; run the command in a folder where you may write"
    if error.errno == errno.ELOOP:
        return "is a symbolic link, which the lock of a run must not be; remove it"
    if error.errno in (errno.EISDIR, errno.ENXIO):
        return "is not an ordinary file, so it cannot be the lock of a run; remove it"
    return f"cannot be used ({error.strerror}); run the command in another folder"
