"""The folder of the workflow: the Snakefile with its rules, scripts, configurations, schemas and templates."""

from __future__ import annotations

from pathlib import Path


def root() -> Path:
    """Return the folder that contains the Snakefile.

    In an installed wheel this is ``cospeech/project``, and in a checkout the repository; both have the same layout.
    The folder may be read-only: results are written to the folder in which the command is run.
    """
    installed = Path(__file__).parents[1] / "project"
    return installed if installed.is_dir() else Path(__file__).parents[3]
