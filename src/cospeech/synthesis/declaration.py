"""What a synthesis system says about itself.

A declaration is a light object: importing it loads neither numpy nor compiled kernels, so the Snakefile can list
all systems at every start. The method behind it is a module that is imported only where it runs.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

Role = Literal["system", "control", "ceiling"]
Drive = Literal["own", "shuffled", "shifted"]
Need = Literal["gestures", "prosody_labels", "prosody", "motion", "truth"]
Output = Literal["phrases", "motion"]

ROLES: tuple[Role, ...] = get_args(Role)
RESERVED = (
    *("phrases", "phrases_seen", "motion", "units", "decoding"),
    *("gestures", "gesture_model", "prosody_model"),
)
"""Tables that stand next to those of a model, so that a model cannot use their names."""

WRONG_SPEECH: dict[Drive, str] = {
    "shuffled": "another record's speech",
    "shifted": "own speech, shifted",
}


@dataclass(frozen=True)
class System:
    """A synthesis system, a control or a ceiling: one line of every table of results.

    Attributes
    ----------
    name : name in paths, tables and configurations.
    title : name that readers see.
    method : import path of the module that trains and synthesises (see ``interface.Method``).
    source : where the method is described.
    role : a ``system`` listens to the record's speech; a ``control`` does not, or listens to the wrong speech; a
        ``ceiling`` knows what no system may know.
    needs : what it learns from and listens to. ``gestures``: the gesture phrases of the training records;
        ``prosody_labels``: the prosody cluster of every frame; ``prosody``: the prosody features of every frame;
        ``motion``: the joint angles of the training records; ``truth``: what the virtual studio planted.
    makes : ``phrases``, which unit selection turns into motion, or ``motion``, in which the actor's gesture model
        finds phrases.
    shares : name of the system whose trained model it uses, where that is not its own.
    tables : tables of its trained model, name to schema.
    schemas : import path of a package whose folder holds the schemas in ``tables`` that cospeech does not bring.
    settings : names and default values of its own settings, ``synthesis.systems.<name>`` in the configuration.
    order : position among the systems of its role, small numbers first.
    controls : names of the two controls that run the same decoder under wrong speech (``shuffled``, ``shifted``);
        by default made from the system's name.
    swept : whether it runs at every setting of the sweep over prosody clusters (systems of cospeech itself).
    decoder : name of the system whose method this is: its own, except for controls under wrong speech.
    drive : the speech that it listens to.

    Raises
    ------
    ValueError : where the declaration contradicts itself.
    """

    name: str
    title: str
    method: str
    source: str = ""
    role: Role = "system"
    needs: tuple[Need, ...] = ("gestures", "prosody_labels")
    makes: Output = "phrases"
    shares: str = ""
    tables: Mapping[str, str] = field(default_factory=dict)
    schemas: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    order: int = 1000
    controls: tuple[str, ...] = ()
    swept: bool = False
    decoder: str = ""
    drive: Drive = "own"

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", self.name):
            raise ValueError(f"declares the name {self.name!r}; use letters, digits, '-' and '_' only")
        for attribute, known in (("role", ROLES), ("makes", get_args(Output)), ("drive", get_args(Drive))):
            value = getattr(self, attribute)
            if value not in known:
                raise ValueError(f"declares {attribute} {value!r}; known are {', '.join(known)}")
        for need in self.needs:
            if need not in get_args(Need):
                raise ValueError(f"declares that it needs {need!r}; known are {', '.join(get_args(Need))}")
        taken = [name for name in self.tables if name in RESERVED]
        if taken:
            raise ValueError(f"declares a table {taken[0]!r} of its model; that name is taken, use another")
        if not (isinstance(self.method, str) and self.method):
            raise ValueError("declares no method; give the import path of the module that trains and synthesises")
        if not self.decoder:
            object.__setattr__(self, "decoder", self.name)
        if self.role == "system" and not self.controls:
            object.__setattr__(self, "controls", tuple(f"{self.name}_{drive}" for drive in WRONG_SPEECH))

    @property
    def model(self) -> str:
        """The name of the system whose trained model it uses."""
        return self.shares or self.decoder

    @property
    def listens(self) -> bool:
        """Whether speech reaches it at all."""
        return bool({"prosody_labels", "prosody", "truth"} & set(self.needs))

    def under_wrong_speech(self) -> list[System]:
        """Return the controls that run this system's decoder under wrong speech."""
        return [
            replace(self, name=name, title=f"{self.title}: {what}", role="control", controls=(), drive=drive)
            for name, (drive, what) in zip(self.controls, WRONG_SPEECH.items(), strict=False)
        ]
