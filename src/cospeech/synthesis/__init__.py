"""Synthesis systems: from what a fold knows, to the gesture phrases of the record that it holds out.

A system is a module of this room that declares ``SYSTEM = System(...)``, and a rule that makes its phrases. It is
found by that line, which is read and not run: who lists the systems (the Snakefile, at every start) need not load
compiled kernels.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

Role = Literal["system", "control", "ceiling"]
Drive = Literal["own", "shuffled", "shifted"]

ROLES: tuple[Role, ...] = ("system", "control", "ceiling")
WRONG_SPEECH: dict[Drive, str] = {
    "shuffled": "another record's speech",
    "shifted": "own speech, shifted",
}


@dataclass(frozen=True)
class System:
    """One row of every table of results.

    Attributes
    ----------
    name : as in the paths of its artifacts.
    title : as a reader sees it.
    role : ``system`` hears the record's speech; a ``control`` does not, or hears the wrong one; a ``ceiling`` knows
        what no system may know.
    order : place among its role, small ones first.
    controls : of a ``system``: names of the controls that are the same decoder under wrong speech, ``shuffled`` and
        ``shifted`` in that order; made from the name where not given.
    studio_only : needs the planted truth of the virtual studio.
    decoder : name of the system whose decoder this is: its own, but for controls under wrong speech.
    drive : the speech that it hears.
    """

    name: str
    title: str
    role: Role
    order: int
    controls: tuple[str, ...] = ()
    studio_only: bool = False
    decoder: str = ""
    drive: Drive = "own"

    def __post_init__(self) -> None:
        if not self.decoder:
            object.__setattr__(self, "decoder", self.name)
        if self.role == "system" and not self.controls:
            object.__setattr__(self, "controls", tuple(f"{self.name}_{drive}" for drive in WRONG_SPEECH))

    def under_wrong_speech(self) -> list[System]:
        """Return the matched controls of this system."""
        return [
            replace(self, name=name, title=f"{self.title}: {what}", role="control", controls=(), drive=drive)
            for name, (drive, what) in zip(self.controls, WRONG_SPEECH.items(), strict=False)
        ]


def systems(studio: bool) -> dict[str, System]:
    """Return all systems by name: those that hear the speech, their controls and the others, the ceilings.

    Parameters
    ----------
    studio : whether the corpus has a planted truth.
    """
    declared = [_declaration(path) for path in sorted(Path(__file__).parent.glob("*.py"))]
    found = sorted(
        (system for system in declared if system is not None and (studio or not system.studio_only)),
        key=lambda system: (ROLES.index(system.role), system.order),
    )
    controls = [control for system in found for control in system.under_wrong_speech()]
    hearing = [system for system in found if system.role == "system"]
    rest = [system for system in found if system.role != "system"]
    return {system.name: system for system in hearing + controls + rest}


def _declaration(path: Path) -> System | None:
    """Return what the line ``SYSTEM = System(key=literal, ...)`` of a module declares, without running the module."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Call)
            and [target.id for target in node.targets if isinstance(target, ast.Name)] == ["SYSTEM"]
        ):
            given: dict[str, Any] = {str(word.arg): ast.literal_eval(word.value) for word in node.value.keywords}
            return System(**given)
    return None
