"""Paths in the configuration: relative to the working directory, and such that Snakemake reads them as they are."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

from cospeech.errors import MissingFileError, UserError

PLACEHOLDER = re.compile(r"\{\s*[.\w]+\s*(,([^{}]|\{[^{}]*\})*)?\}|<[a-z][a-z0-9_]*>")
"""What Snakemake replaces in every path, and offers no way to escape: wildcards, and its own path variables."""


def plain(path: str, what: str) -> str:
    """Return ``path`` without redundant ``./`` and ``//``, of which Snakemake would warn.

    Raises
    ------
    UserError : if Snakemake would replace a part of the path, and so look for another file.
    """
    found = PLACEHOLDER.search(path)
    if found:
        raise UserError(
            f"config: {what}: {path}: Snakemake takes '{found[0]}' in a path for a placeholder; rename this file or "
            "folder"
        )
    return str(Path(path))


def existing(path: str, what: str) -> str:
    """Return ``path`` as ``plain`` does.

    Raises
    ------
    MissingFileError : if there is no such file or folder.
    """
    if not Path(path).exists():
        raise MissingFileError(path, f"config: {what}: no file or folder {path}")
    return plain(path, what)


def explain(error: UserError, configurations: Sequence[str | Path]) -> str:
    """Return the message of an error. For a missing file, say where paths start, and whether it is elsewhere.

    Parameters
    ----------
    configurations : the configuration files of the run.
    """
    if not isinstance(error, MissingFileError):
        return str(error)
    if Path(error.path).is_absolute():
        return f"{error}; correct its path"
    for folder in (Path(configuration).parent for configuration in configurations):
        if (folder / error.path).exists():
            return (
                f"{error} in {Path.cwd()}: paths are relative to the folder in which the command is run, not to the "
                f"configuration; write {os.path.relpath(folder / error.path)}"
            )
    return f"{error} in {Path.cwd()}; correct its path, which is relative to the folder in which the command is run"
