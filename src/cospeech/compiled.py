"""Where numba keeps what it compiled: a folder for each state of the code.

Numba sees that a file changed, but not that a kernel or a constant changed which another file brought into it: after
an update it would go on with the old one. So each state of all that is compiled has a folder of its own.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from pathlib import Path

PACKAGE = Path(__file__).parent
FOLDER = "NUMBA_CACHE_DIR"
IMPORT = re.compile(rb"^from cospeech([\w.]*) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE)


def keep_apart(package: Path = PACKAGE) -> None:
    """Let numba use the folder of the code as it is, unless the environment names one; drop those of other states.

    Processes that are started from here inherit it.
    """
    if FOLDER not in os.environ:
        kept = package / "__pycache__" / f"compiled-{state(package)}"
        if not kept.is_dir():
            for old in kept.parent.glob("compiled-*"):
                shutil.rmtree(old, ignore_errors=True)
        os.environ[FOLDER] = str(kept)


def state(package: Path = PACKAGE) -> str:
    """Return the hash of the text of every module that compiles something, and of what these import."""
    texts = {path: path.read_bytes() for path in package.rglob("*.py")}
    wanted, found = [path for path, text in texts.items() if b"import numba" in text], set[Path]()
    while wanted:
        path = wanted.pop()
        if path not in found:
            found.add(path)
            for module, listed, named in IMPORT.findall(texts[path]):
                folder = package.joinpath(*module.decode().split("."))
                names = [name.split()[0].decode() for name in (listed or named).split(b",") if name.strip()]
                candidates = [folder.with_suffix(".py"), *(folder / f"{name}.py" for name in names)]
                wanted += [candidate for candidate in candidates if candidate in texts]
    digest = hashlib.sha256()
    for path in sorted(found):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + texts[path] + b"\0")
    return digest.hexdigest()[:16]
