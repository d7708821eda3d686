"""Files of the report, written whole or not at all."""

from __future__ import annotations

import pandas as pd

from cospeech.data import tables


def save_table(table: pd.DataFrame, path: str) -> None:
    """Write an exhibit's numbers as CSV: units in the headings, a missing value as an empty cell."""
    with tables.replacing(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g", lineterminator="\n")


def save_bytes(content: bytes, path: str) -> None:
    """Write a picture or a page."""
    with tables.replacing(path) as temporary:
        temporary.write_bytes(content)
