"""Tables as the page shows them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd


@dataclass(frozen=True)
class Table:
    """A table as the page shows it.

    Attributes
    ----------
    headings : of the columns.
    rows : cells as text; the first cell of a row is its heading.
    words : columns that hold text rather than numbers, and are aligned to the left.
    """

    headings: list[str]
    rows: list[list[str]]
    words: tuple[int, ...] = ()

    @classmethod
    def of(cls, headings: list[str], rows: Iterable[Iterable[Any]], words: tuple[int, ...] = ()) -> Table:
        """Return a table of cells that may be numbers; one that is missing stays empty."""
        return cls(headings, [["" if pd.isna(cell) else str(cell) for cell in row] for row in rows], words)


class Pair(NamedTuple):
    """One published value next to ours."""

    what: str
    published: str
    ours: str
