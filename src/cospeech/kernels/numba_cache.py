"""The cache of compiled code: one folder for each state of the source code.

Numba notices that a file has changed, but not that a kernel or constant that the file imports has: after an update it
would continue with the old code. Each state of all compiled modules therefore has its own folder.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

from cospeech.kernels.code_hash import PACKAGE, closure

FOLDER = "NUMBA_CACHE_DIR"


def keep_apart() -> None:
    """Set the cache folder of numba to that of the current code, unless the environment sets one; delete old ones.

    Child processes inherit the setting.
    """
    if FOLDER not in os.environ:
        kept = place() / f"compiled-{state()}"
        if not kept.is_dir():
            for old in kept.parent.glob("compiled-*"):
                shutil.rmtree(old, ignore_errors=True)
        os.environ[FOLDER] = str(kept)


def is_filled() -> bool:
    """Return whether anything was compiled yet: the first use of a kernel takes seconds."""
    return Path(os.environ[FOLDER]).is_dir()


def place() -> Path:
    """Return the folder that holds the compiled kernels: within the package or, if that is read-only, the user's.

    Several installations may share a user, so each has a folder of its own there.
    """
    inside = PACKAGE / "__pycache__"
    nearest = inside if inside.exists() else PACKAGE
    if nearest.is_dir() and os.access(nearest, os.W_OK):
        return inside
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return caches / "cospeech" / hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:16]


def state() -> str:
    """Return the hash of the text of every module that compiles kernels, and of the modules that these import."""
    kernels = [path for path in PACKAGE.rglob("*.py") if b"cospeech.kernels.jit import" in path.read_bytes()]
    digest = hashlib.sha256()
    for path in sorted({path for kernel in kernels for path in closure(kernel)}):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
