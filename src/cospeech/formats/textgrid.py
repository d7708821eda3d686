"""TextGrid files of Praat: interval tiers that cover the whole record, including unlabelled intervals."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple

from praatio import textgrid
from praatio.data_classes.interval_tier import IntervalTier

from cospeech.data import tables
from cospeech.data.segments import Spans
from cospeech.errors import UserError
from cospeech.formats import plain_text
from cospeech.formats.plain_text import shown
from cospeech.formats.tiers import Interval

TOKEN = re.compile(r'"(?P<text>[^"]*(?:""[^"]*)*)"|![^\n]*|(?P<word>[^\s"=]+)')
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class Grid(NamedTuple):
    """A TextGrid: its time range in seconds, and its tiers by name in the order of the file (None: a point tier)."""

    start_s: float
    end_s: float
    tiers: list[tuple[str, list[Interval] | None]]


def read(path: str | Path) -> Grid:
    """Read a TextGrid in the long or the short text format, in any encoding that Praat writes.

    As in Praat, only quoted texts, flags in angle brackets and numbers that stand alone count, not the words between
    them.

    Raises
    ------
    UserError : if the file is not a TextGrid in text format, or ends early.
    """
    content = plain_text.read_bytes(path)
    if content.startswith(b"ooBinaryFile"):
        raise UserError(f"{path}: is a binary file of Praat; save it as a text file in Praat")
    text = plain_text.decode(content, path)
    if text.lstrip().startswith('"Praat chronological'):
        raise UserError(f"{path}: is a chronological TextGrid; save it as a text file in Praat")
    tokens = _Tokens(text, path)
    kind = tokens.text("the file type") if tokens.left() else ""
    name = tokens.text("the object class") if kind.startswith("ooTextFile") else ""
    if not name.startswith("TextGrid"):
        found = (
            f"holds a Praat object of class {shown(name)}" if name else "does not begin as a text file of Praat does"
        )
        raise UserError(f"{path}: is not a TextGrid ({found}); save the TextGrid as a text file in Praat")
    start_s, end_s = tokens.number("its xmin"), tokens.number("its xmax")
    if not tokens.exists():
        return Grid(start_s, end_s, [])
    tiers = [_read_tier(tokens, number) for number in range(1, int(tokens.number("the number of tiers")) + 1)]
    return Grid(start_s, end_s, tiers)


def _read_tier(tokens: _Tokens, number: int) -> tuple[str, list[Interval] | None]:
    kind, name = tokens.text(f"the class of tier {number}"), tokens.text(f"the name of tier {number}")
    for limit in ("xmin", "xmax"):
        tokens.number(f"{limit} of tier '{shown(name)}'")
    count = int(tokens.number(f"the number of intervals of tier '{shown(name)}'"))
    intervals = []
    for entry in range(1, count + 1):
        place = f"interval {entry}"
        where = f"{place} of tier '{shown(name)}'"
        start_s = tokens.number(f"the time of {where}")
        end_s = start_s if kind == "TextTier" else tokens.number(f"the end of {where}")
        intervals.append(Interval(start_s, end_s, tokens.text(f"the text of {where}"), place))
    return name, None if kind == "TextTier" else intervals


class _Tokens:
    """The texts, numbers and flags of a file of Praat, one after the other."""

    def __init__(self, text: str, path: str | Path) -> None:
        self._matches = TOKEN.finditer(text)
        self._path = path
        self._ahead = self._next()

    def left(self) -> bool:
        """Return whether there is another token."""
        return self._ahead is not None

    def text(self, what: str) -> str:
        found = self._take(what)
        if not isinstance(found, str):
            raise self._fault(what, f"the number {found:g} stands there")
        return found

    def number(self, what: str) -> float:
        found = self._take(what)
        if isinstance(found, str):
            raise self._fault(what, f"the text '{shown(found, 20)}' stands there")
        return found

    def exists(self) -> bool:
        """Return whether the flag <exists> comes next, and pass it."""
        return self._take("the flag <exists>") == "<exists>"

    def _take(self, what: str) -> str | float:
        found, self._ahead = self._ahead, self._next()
        if found is None:
            raise self._fault(what, "the file ends there")
        return found

    def _next(self) -> str | float | None:
        for match in self._matches:
            if match["text"] is not None:
                return match["text"].replace('""', '"')
            word = match["word"] or ""
            if word in ("<exists>", "<absent>"):
                return word
            if NUMBER.fullmatch(word) and math.isfinite(float(word)):
                return float(word)
        return None

    def _fault(self, what: str, found: str) -> UserError:
        return UserError(f"{self._path}: {what} is missing ({found}); save the TextGrid again in Praat")


def write(path: str | Path, tier: str, spans: Spans, duration_s: float) -> None:
    """Write spans (start, end, label) in seconds, in order, as the only tier of a TextGrid of ``duration_s``."""
    grid = textgrid.Textgrid(0, duration_s)
    grid.addTier(IntervalTier(tier, spans, 0, duration_s))
    with tables.replacing(path) as temporary:
        grid.save(str(temporary), format="long_textgrid", includeBlankSpaces=True)
