"""What a synthesis system says about itself.

A declaration is a light object: importing it loads neither numpy nor compiled kernels, so that the Snakefile can list
all systems whenever it starts. The method is a separate module, which is imported only where it runs.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

Role = Literal["system", "control", "ceiling"]
Drive = Literal["own", "shuffled", "shifted"]
Need = Literal[
    "gestures", "prosody_labels", "prosody", "syllables", "melody", "motion", "phases", "subunits", "head", "truth"
]
Output = Literal["phrases", "motion", "head"]

ROLES: tuple[Role, ...] = get_args(Role)
SPEECH: tuple[Need, ...] = ("prosody_labels", "prosody", "syllables", "melody")
"""The kinds of speech that can drive a system."""

HEAD_NEEDS: frozenset[Need] = frozenset({"melody", "head"})
"""What systems that make angles of the head can need; they run apart from all others, at the frames of the melody."""

NAME = r"[A-Za-z0-9][A-Za-z0-9_-]*"
ORIGINAL = "original"
"""The name of the actor's own motion in tables of results."""

RESERVED = (
    *("phrases", "phrases_seen", "motion", "head", "units", "decoding"),
    *("gestures", "gesture_model", "prosody_model"),
)
"""Names of tables that lie next to those of a model, which a model can therefore not use."""

DRAWS = 8
"""The number of other records, or shifts of its own speech, that drive a matched control, if there are as many."""

WRONG_SPEECH: dict[Drive, str] = {
    "shuffled": "another record's speech",
    "shifted": "own speech, shifted",
}


def shortest_shifted_s(shift_s: float, head_s: float, tail_s: float) -> float:
    """Return the duration of the shortest speech whose interior can be shifted by ``shift_s`` in either direction."""
    return 2 * shift_s + head_s + tail_s


class DeclarationError(ValueError):
    """What a system says about itself is impossible."""


@dataclass(frozen=True)
class System:
    """A synthesis system, a control or a ceiling: one row of every table of results.

    Attributes
    ----------
    name : name in paths, tables and configurations.
    title : name that readers see.
    method : import path of the module that trains and synthesises (see ``interface.Method``).
    source : where the method is described.
    role : a ``system`` is driven by the record's own speech; a ``control`` by no speech or by the wrong speech; a
        ``ceiling`` knows what no system can know.
    needs : what it learns from and what drives it. ``gestures``: the gesture phrases of the training records;
        ``prosody_labels``: the prosody cluster of every frame; ``prosody``: the prosody features of every frame;
        ``syllables``: the syllables with their pitch, intensity and length; ``melody``: pitch and intensity at
        100 Hz; ``motion``: the joint angles of the training records; ``phases``: their gesture phases; ``subunits``:
        their gesture subunits of head, arms and legs; ``head``: the angles of the head in the training records;
        ``truth``: what the virtual studio planted.
    makes : ``phrases``, which unit selection turns into motion; ``motion``, which the actor's gesture model segments
        into phrases; or ``head``, the angles of the head alone.
    shares : name of the system whose trained model it uses, if that is not its own.
    tables : tables of its trained model, name to schema.
    reports : tables about what it does with the speech of a record, name to schema (see ``interface.Reporting``).
    schemas : import path of the package whose folder contains the schemas in ``tables`` and ``reports``, one
        ``<schema>.yaml`` each. Schemas that are not there are those of cospeech.
    settings : names and default values of its own settings, ``synthesis.systems.<name>`` in the configuration.
    order : position among the systems of its role; small numbers come first, and other packages after cospeech.
    controls : names of its two matched controls, which are the same decoder driven by ``shuffled`` and by ``shifted``
        speech; by default they are formed from the name of the system.
    swept : whether it runs at every setting of the sweep over prosody clusters (systems of cospeech itself only).
    live : whether it can run frame by frame as speech is heard (see ``live.LiveMethod``).
    decoder : name of the system that the method belongs to: its own name, except for matched controls.
    drive : the speech that drives it.
    draws : how often a control that depends on chance synthesises each record. Its scores are averages over draws.

    Raises
    ------
    DeclarationError : if the declaration is impossible or contradicts itself.
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
    reports: Mapping[str, str] = field(default_factory=dict)
    schemas: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    order: int = 1000
    controls: tuple[str, ...] = ()
    swept: bool = False
    live: bool = False
    decoder: str = ""
    drive: Drive = "own"
    draws: int = 1

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and re.fullmatch(NAME, self.name)):
            raise DeclarationError(f"declares the name {self.name!r}; use letters, digits, '-' and '_' only")
        if self.name == ORIGINAL:
            raise DeclarationError(f"declares the name '{ORIGINAL}', which stands for the actor's own motion")
        for attribute, kind in _TYPES.items():
            value = getattr(self, attribute)
            if not isinstance(value, kind):
                raise DeclarationError(f"declares {attribute} {value!r}; expected {kind.__name__.lower()}")
        for attribute, known in (("role", ROLES), ("makes", get_args(Output)), ("drive", get_args(Drive))):
            value = getattr(self, attribute)
            if value not in known:
                raise DeclarationError(f"declares {attribute} {value!r}; known are {', '.join(known)}")
        for need in self.needs:
            if need not in get_args(Need):
                raise DeclarationError(f"declares that it needs {need!r}; known are {', '.join(get_args(Need))}")
        alien = sorted(set(self.needs) - HEAD_NEEDS if self.makes == "head" else set(self.needs) & HEAD_NEEDS)
        if alien:
            raise DeclarationError(
                f"declares that it makes {self.makes} and needs {alien[0]!r}; systems that make head can need "
                "'melody' and 'head', and no others can"
            )
        if self.role == "system" and not set(SPEECH) & set(self.needs):
            raise DeclarationError(
                f"declares the role 'system', but needs none of {', '.join(map(repr, SPEECH))}: no speech would "
                "drive it; declare one of them, or the role 'control'"
            )
        for table in self.reports.keys() & self.tables.keys():
            raise DeclarationError(f"declares a table '{table}' both of its model and among its reports; rename one")
        for named, where in ((self.tables, "of its model"), (self.reports, "among its reports")):
            for table, schema in named.items():
                if table in RESERVED:
                    raise DeclarationError(f"declares a table '{table}' {where}; the name is reserved, use another")
                if not all(isinstance(word, str) and re.fullmatch(NAME, word) for word in (table, schema)):
                    raise DeclarationError(
                        f"declares the table {table!r} with the schema {schema!r}; both must be names"
                    )
        if self.draws < 1 or (self.draws > 1 and self.role != "control"):
            raise DeclarationError(f"declares {self.draws} draws; only a control can have more than one")
        if not self.method:
            raise DeclarationError(
                "declares no method; give the import path of the module that trains and synthesises"
            )
        if not self.decoder:
            object.__setattr__(self, "decoder", self.name)
        if self.role == "system" and not self.controls:
            object.__setattr__(self, "controls", tuple(f"{self.name}_{drive}" for drive in WRONG_SPEECH))
        if len(self.controls) not in (0, len(WRONG_SPEECH)) or not all(
            isinstance(control, str) and re.fullmatch(NAME, control) for control in self.controls
        ):
            raise DeclarationError(
                f"declares the controls {self.controls!r}; give two names, for {' and '.join(WRONG_SPEECH)} speech"
            )

    @property
    def model(self) -> str:
        """The name of the system whose trained model it uses."""
        return self.shares or self.decoder

    @property
    def table_schemas(self) -> dict[str, str]:
        """The schema of each of its model's tables, as ``data.tables.schema`` finds it."""
        return self._found(self.tables)

    @property
    def report_schemas(self) -> dict[str, str]:
        """The schema of each of its reports, as ``data.tables.schema`` finds it."""
        return self._found(self.reports)

    def _found(self, named: Mapping[str, str]) -> dict[str, str]:
        package = f"{self.schemas}:" if self.schemas else ""
        return {table: f"{package}{schema}" for table, schema in named.items()}

    def matched_controls(self) -> list[System]:
        """Return the controls that run this system's decoder on the wrong speech."""
        return [
            replace(
                self, name=name, title=f"{self.title}: {what}", role="control", controls=(), drive=drive, draws=DRAWS
            )
            for name, (drive, what) in zip(self.controls, WRONG_SPEECH.items(), strict=False)
        ]


_TYPES: dict[str, type] = {
    **dict.fromkeys(("title", "method", "source", "shares", "schemas"), str),
    **dict.fromkeys(("needs", "controls"), tuple),
    **dict.fromkeys(("tables", "reports", "settings"), Mapping),
    **dict.fromkeys(("order", "draws"), int),
}
