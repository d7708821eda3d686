"""What was adjusted when the files of records were read, grouped so that hundreds of records remain readable."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

SEPARATOR = "; "
"""What stands between two notes of a record."""

FEW = 12
"""Number of records whose names stand in the line of a note; more are folded away."""

_GAP = "\0"
"""Takes the place of numbers; notes do not contain it."""

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?!\w)")


class Note(NamedTuple):
    """A note and the records that have it. If only numbers differ between many records, it contains their range."""

    text: str
    records: list[str]
    all: bool

    @property
    def folded(self) -> bool:
        """Whether there are too many records to name all of them in the line."""
        return len(self.records) > FEW and not self.all


def grouped(records: pd.DataFrame) -> list[Note]:
    """Return the notes of all records, those of most records first.

    Parameters
    ----------
    records : the table ``records``.
    """
    found: dict[str, dict[str, list[str]]] = {}
    for name, note in zip(records["record"], records["note"], strict=True):
        for text in dict.fromkeys(note.split(SEPARATOR) if isinstance(note, str) else ()):
            found.setdefault(NUMBER.sub(_GAP, text), {}).setdefault(text, []).append(str(name))
    notes = []
    for pattern, own in found.items():
        if sum(map(len, own.values())) > FEW:
            numbers = [_range(values) for values in zip(*map(NUMBER.findall, own), strict=True)]
            text = "".join(part for pair in zip(pattern.split(_GAP), [*numbers, ""], strict=True) for part in pair)
            named = {name for names in own.values() for name in names}
            own = {text: [name for name in map(str, records["record"]) if name in named]}
        notes += [Note(text, names, len(names) == len(records) > 1) for text, names in own.items()]
    return sorted(notes, key=lambda note: -len(note.records))


def _range(values: Sequence[str]) -> str:
    low, high = min(values, key=float), max(values, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"
