"""Packages of others, as an installer leaves them; the toy package that is kept with the tests among them."""

from __future__ import annotations

from pathlib import Path

TOY = Path(__file__).parents[1] / "toy_gestures"


class Packages:
    """Installs packages in a folder; a process that has it on its path finds them."""

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
