"""The cache of compiled code: one folder for each state of the source code.

Numba notices that a file has changed, but not that a kernel or constant that the file imports has: after an update it
would continue with the old code. Each state of all compiled modules therefore has its own folder.
"""

from __future__ import annotations

import hashlib
import os
import shutil

from cospeech.kernels.code_hash import PACKAGE, closure

FOLDER = "NUMBA_CACHE_DIR"


def keep_apart() -> None:
    """Set the cache folder of numba to that of the current code, unless the environment sets one; delete old ones.

    Child processes inherit the setting.
    """
    if FOLDER not in os.environ:
        kept = PACKAGE / "__pycache__" / f"compiled-{state()}"
        if not kept.is_dir():
            for old in kept.parent.glob("compiled-*"):
                shutil.rmtree(old, ignore_errors=True)
        os.environ[FOLDER] = str(kept)


def state() -> str:
    """Return the hash of the text of every module that compiles kernels, and of the modules that these import."""
    kernels = [path for path in PACKAGE.rglob("*.py") if b"cospeech.kernels.jit import" in path.read_bytes()]
    digest = hashlib.sha256()
    for path in sorted({path for kernel in kernels for path in closure(kernel)}):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
