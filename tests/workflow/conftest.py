"""One finished run of the test configuration, and copies of it to change."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from project import Project


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """The test configuration, run once on two cores; tests that change it work on a copy."""
    project = Project(tmp_path_factory.mktemp("finished"))
    project.make()
    return project


@pytest.fixture
def copy(finished: Project, tmp_path: Path) -> Project:
    """A copy of the finished run, times and Snakemake's own records included."""
    folder = tmp_path / "copy"
    subprocess.run(["cp", "-a", str(finished.folder), str(folder)], check=True)
    return Project(folder)
