"""Packages of others, installed for one test; the toy package that is kept with the tests among them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from one_fold import OneFold

TOY = Path(__file__).parents[1] / "toy_gestures"


@pytest.fixture(scope="package")
def one_fold() -> OneFold:
    """A fold that several tests share; none of them changes it."""
    return OneFold()


class Packages:
    """Installs packages in a folder that Python searches first."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def describe(self, name: str, entries: dict[str, str]) -> None:
        """Write what an installer leaves of a package ``name`` with these systems: its name and entry points."""
        info = self.folder / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"{entry} = {value}" for entry, value in entries.items()]
        (info / "entry_points.txt").write_text("\n".join(["[cospeech.systems]", *lines, ""]))

    def install(self, name: str, text: str, entry: str | None = None, value: str = "SYSTEM") -> None:
        """Install a package of one module, ``text``, that declares ``value``."""
        (self.folder / f"{name}.py").write_text(text)
        self.describe(name, {entry or name: f"{name}:{value}"})

    def install_toy(self) -> None:
        """Install the toy package."""
        (self.folder / "toy_gestures").symlink_to(TOY / "toy_gestures")
        self.describe("toy-gestures", {"toy_gestures": "toy_gestures:SYSTEMS"})


@pytest.fixture
def packages(tmp_path, monkeypatch) -> Packages:
    """A folder for packages of others; what they import is forgotten after the test."""
    folder = tmp_path / "packages"
    folder.mkdir()
    before = set(sys.modules)
    monkeypatch.syspath_prepend(folder)
    yield Packages(folder)
    for name in set(sys.modules) - before:
        if str(getattr(sys.modules[name], "__file__", None) or "").startswith(str(folder)):
            del sys.modules[name]
