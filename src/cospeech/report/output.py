"""How an exhibit's numbers become a file."""

from __future__ import annotations

import pandas as pd

from cospeech import tables


def save_table(table: pd.DataFrame, path: str) -> None:
    """Write an exhibit's numbers as CSV: units in the headings, an empty cell where a value is missing."""
    with tables.replacing(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g", lineterminator="\n")
