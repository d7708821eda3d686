"""Faults of the motion that a viewer would see, next to those of the recorded motion."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.page.tables import Table
from cospeech.report.systems import matched


class Column(NamedTuple):
    """A quantity as the table shows it: heading, factor to the unit shown, decimals, and how records are combined."""

    heading: str
    factor: float
    decimals: int
    over_records: str


COLUMNS = {
    "joins_within": Column("joins within the limits (%)", 1.0, 1, "mean"),
    "frames_within": Column("frames within (%)", 1.0, 1, "mean"),
    "foot_speed": Column("feet on the floor: speed (mm/s)", 1000.0, 1, "mean"),
    "foot_slip": Column("farthest in 1 s (mm)", 1000.0, 1, "max"),
    "off_floor": Column("off the floor (% of frames)", 1.0, 1, "mean"),
    "trunk_depth": Column("arms in the trunk: deepest (mm)", 1000.0, 1, "max"),
    "frames_deeper": Column("deeper than recorded (% of frames)", 1.0, 2, "mean"),
}
"""The quantities of schema ``motion_quality`` in the order of the table."""

NONE = "–"


def draw(run: Run, quality: pd.DataFrame) -> Drawing:
    """Return the quality of the motion of each system, over all records.

    Parameters
    ----------
    quality : the table ``motion_quality``.
    """
    rows = []
    for (system, name), group in quality.groupby(["system", "quantity"], sort=False):
        title, over = run.titles.get(str(system), str(system)), COLUMNS[str(name)].over_records
        combined = group[["value", "recorded"]].agg(over)
        rows.append(
            {"system": system, "title": title, "quantity": name, "over_records": over}
            | {"unit": group["unit"].iloc[0], "fps": group["fps"].iloc[0]}
            | {"value": combined["value"], "recorded": combined["recorded"]}
            | {"records": group["record"].nunique(), "n": group["n"].sum()}
        )
    return Drawing(pd.DataFrame(rows))


def table(run: Run, numbers: pd.DataFrame) -> Table:
    """Return the table for the page: the recorded motion in the first row, then one row per system.

    At the joins of a system, the value of the recorded motion at the same moments is added, since it has no joins.
    Matched controls, which are the same systems, are in the CSV file only.
    """
    rows = []
    shown = numbers[~numbers["system"].isin(matched(run.systems))]
    for title, group in shown.groupby("title", sort=False):
        own, recorded = (dict(zip(group["quantity"], group[name], strict=True)) for name in ("value", "recorded"))
        cells = [_cell(quantity, own[quantity]) for quantity in COLUMNS]
        if cells[0] != NONE:
            cells[0] += f" (recorded: {_cell('joins_within', recorded['joins_within'])})"
        rows.append([title, *cells])
    return Table.of(["motion", *(column.heading for column in COLUMNS.values())], rows)


def _cell(quantity: str, value: float) -> str:
    column = COLUMNS[quantity]
    return NONE if pd.isna(value) else f"{column.factor * value:.{column.decimals}f}"
