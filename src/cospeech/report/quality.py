"""The quality sheet of a filmed record: markers that were not seen, the worst moments, the cameras."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from cospeech.report import style
from cospeech.report.page.tables import Table
from cospeech.report.words import number

STATUS_COLOURS = {"seen": style.GRID, "corrected": style.PURPLE, "predicted": style.AMBER, "lost": style.VERMILLION}

MOST_SPANS = 12
"""How many spans the sheet lists; the record's table has all of them."""


class Moment(NamedTuple):
    """One of the worst moments: its title, its picture as a data URI, and its lines for a file of corrections."""

    title: str
    picture: str
    lines: str


def timeline(world: pd.DataFrame) -> Figure:
    """Draw the status of each marker over the time of a record.

    Parameters
    ----------
    world : the table ``markers_3d``.
    """
    names = list(dict.fromkeys(world["marker"]))
    drawn, axes = style.figure(0.9 + 0.19 * len(names))
    panel = axes[0, 0]
    frame_s = 2 * float(world["time_s"].iloc[0])
    for row, name in enumerate(names):
        status = world.loc[world["marker"] == name, "status"].to_numpy()
        starts = np.flatnonzero(np.r_[True, status[1:] != status[:-1]])
        ends = np.r_[starts[1:], len(status)]
        for kind, colour in STATUS_COLOURS.items():
            own = [(a * frame_s, (b - a) * frame_s) for a, b in zip(starts, ends, strict=True) if status[a] == kind]
            panel.broken_barh(own, (row - 0.36, 0.72), facecolor=colour, lw=0)
    for kind, colour in STATUS_COLOURS.items():
        panel.plot([], [], lw=6, color=colour, label=kind)
    panel.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
    panel.set(xlim=(0, float(world["time_s"].max()) + frame_s / 2), ylim=(len(names) - 0.4, -0.6), xlabel="s")
    panel.legend(ncols=len(STATUS_COLOURS), loc="lower right", bbox_to_anchor=(1, 1), handlelength=1)
    style.ticks_off(panel, "y")
    panel.spines["left"].set_visible(False)
    return drawn


def marker_table(world: pd.DataFrame) -> Table:
    """Return the share of each marker's frames by status, and its reprojection residual."""
    rows = []
    for name, own in world.groupby("marker", sort=False):
        share = own["status"].value_counts(normalize=True)
        residual = (
            np.sqrt(np.mean(own["residual_px"].dropna().to_numpy() ** 2))
            if own["residual_px"].notna().any()
            else np.nan
        )
        rows.append([str(name), *(f"{100 * share.get(kind, 0.0):.1f}" for kind in STATUS_COLOURS), number(residual)])
    return Table(["marker", *(f"{kind} (%)" for kind in STATUS_COLOURS), "residual (px)"], rows)


def span_table(spans: pd.DataFrame) -> Table:
    """Return the longest spans in which a marker was not seen, lost ones first."""
    order = spans.sort_values(["status", "duration_s", "first_frame"], ascending=[True, False, True], kind="stable")
    rows = [
        [row["marker"], row["status"], f"{row['first_frame']} to {row['end_frame'] - 1}", number(row["duration_s"])]
        for _, row in order.head(MOST_SPANS).iterrows()
    ]
    return Table(["marker", "status", "frames", "duration (s)"], rows, (1,))


def camera_table(quality: pd.DataFrame) -> Table:
    """Return how good the calibration of each camera is."""
    rows = [
        [
            row["camera"],
            f"{row['rms_px']:.3f}",
            *map(str, row[["n_points", "n_outliers"]]),
            f"{100 * row['coverage']:.0f}",
        ]
        for _, row in quality.iterrows()
    ]
    return Table(["camera", "residual (px)", "points", "outliers", "picture area with points (%)"], rows)


def moments(table: pd.DataFrame, pictures: list[str]) -> list[Moment]:
    """Return the worst moments; ``pictures`` are the data URIs of their pictures.

    Their lines hold the tracker's position in every view, for a person to correct.
    """
    found = []
    for (_, rows), picture in zip(table.groupby("moment"), pictures, strict=True):
        first = rows.iloc[0]
        residual = "" if pd.isna(first["residual_px"]) else f", residual {number(first['residual_px'])} px"
        title = f"{first['marker']}, {first['time_s']:.2f} s (frame {first['frame']}): {first['status']}{residual}"
        known = rows.dropna(subset=["x_px"])
        lines = known[["frame", "camera", "marker", "x_px", "y_px"]].to_csv(
            header=False, index=False, float_format="%.1f", lineterminator="\n"
        )
        found.append(Moment(title, picture, lines.rstrip()))
    return found
