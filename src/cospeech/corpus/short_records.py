"""Notes on records that are too short for a control."""

from __future__ import annotations

import pandas as pd


def noted(records: pd.DataFrame, shortest_s: float | None, shift_s: float) -> pd.DataFrame:
    """Return the table of records with a note on each that the controls with shifted speech leave out.

    Parameters
    ----------
    records : the table ``records``.
    shortest_s : duration of the shortest record whose speech can be shifted; None if the run has no such control.
    shift_s : the smallest shift in seconds.
    """
    if shortest_s is None:
        return records
    notes = [
        f"{duration_s:.1f} s are too short for a shift of {shift_s:g} s: left out of the controls with shifted speech"
        if duration_s < shortest_s - 1e-6
        else None
        for duration_s in records["duration_s"]
    ]
    joined = [
        "; ".join(part for part in parts if isinstance(part, str)) or None
        for parts in zip(records["note"], notes, strict=True)
    ]
    return records.assign(note=pd.Series(joined, records.index, dtype=object))
