"""Where the workflow lies: the Snakefile with its rules, scripts, configurations, schemas and templates."""

from __future__ import annotations

from pathlib import Path


def root() -> Path:
    """Return the folder that contains the Snakefile.

    A wheel carries the workflow inside the package, as ``cospeech/project``; in a checkout it is the repository.
    Both are laid out alike. The folder may be read-only: results go to the folder that the command is run in.
    """
    installed = Path(__file__).parents[1] / "project"
    return installed if installed.is_dir() else Path(__file__).parents[3]
