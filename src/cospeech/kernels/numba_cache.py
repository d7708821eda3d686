"""Where numba keeps what it compiled: a folder for each state of the code.

Numba sees that a file changed, but not that a kernel or a constant changed which another file brought into it: after
an update it would go on with the old one. So each state of all that is compiled has a folder of its own.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

from cospeech.kernels.code_hash import PACKAGE, closure

FOLDER = "NUMBA_CACHE_DIR"


def keep_apart() -> None:
    """Let numba use the folder of the code as it is, unless the environment names one; drop those of other states.

    Processes that are started from here inherit it.
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
    """Return the hash of the text of every module that compiles something, and of what these import."""
    kernels = [path for path in PACKAGE.rglob("*.py") if b"cospeech.kernels.jit import" in path.read_bytes()]
    digest = hashlib.sha256()
    for path in sorted({path for kernel in kernels for path in closure(kernel)}):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
