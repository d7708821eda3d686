"""Heads that move to speech: one record, captured poses, and what is recovered of planted head gestures."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from cospeech.motion import head
from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.page.tables import Table
from cospeech.report.words import number

AXES = {"x_deg": "nod", "y_deg": "turn", "z_deg": "tilt"}
"""The angles of the head as the report calls them."""

SHOWN_S = 30.0
"""Longest stretch of a record that a figure shows."""

MOST_COLUMNS = 4
"""Largest number of actors next to one another in a figure."""

QUANTITIES = {
    "x": "nod",
    "y": "turn",
    "z": "tilt",
    "rotation": "angle of the rotation between captured and true head",
    "position": "position",
}
"""Errors of captured poses as the report calls them."""


def timeline(run: Run, original: pd.DataFrame, made: dict[str, pd.DataFrame]) -> Drawing:
    """Draw the angles of the head of one record, where it moves most: as recorded, and by systems.

    Parameters
    ----------
    original : angles of the recorded head (schema ``head``).
    made : angles that systems made of the record's speech, by system.
    """
    start_s, end_s = _liveliest(original)
    drawn, axes = style.figure(4.6, len(AXES), 1, sharex=True)
    colours = style.system_colours(made)
    for panel, (column, title) in zip(axes[:, 0], AXES.items(), strict=True):
        _curve(panel, original, column, (start_s, end_s), style.INK, "original", 1.8)
        for name, table in made.items():
            _curve(panel, table, column, (start_s, end_s), colours[name], run.heads[name].title, 1.2)
        panel.axhline(0.0, color=style.GRID, lw=0.8, zorder=0)
        panel.set_ylabel(f"{title}, degrees")
        panel.grid(axis="x")
    axes[-1, 0].set_xlabel("seconds")
    axes[-1, 0].set_xlim(start_s, end_s)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=3)
    tables = [original.assign(system="original"), *(table.assign(system=name) for name, table in made.items())]
    numbers = pd.concat(tables, ignore_index=True)
    return Drawing(numbers[numbers["time_s"].between(start_s, end_s)][["system", "time_s", *AXES]], drawn)


def _liveliest(original: pd.DataFrame) -> tuple[float, float]:
    """Return the start and end in seconds of the stretch in which a head turns by the largest angle in all."""
    fps = head.frame_rate(original)
    times_s = original["time_s"].to_numpy(dtype=float)
    turned = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(head.at_times(original, times_s), axis=0), axis=1)))
    span = min(round(SHOWN_S * fps), len(turned) - 1)
    start = int(np.argmax(turned[span:] - turned[: len(turned) - span]))
    return float(times_s[start]), float(times_s[start + span])


def _curve(
    panel: Axes, table: pd.DataFrame, column: str, span_s: tuple[float, float], colour: str, label: str, width: float
) -> None:
    own = table[table["time_s"].between(*span_s)]
    panel.plot(own["time_s"], own[column], color=colour, lw=width, label=label)


def captured(_: Run, errors: pd.DataFrame) -> Drawing:
    """Return the errors of the captured poses of virtual heads, over records.

    Parameters
    ----------
    errors : the table ``head_capture``.
    """
    grouped = errors.groupby(["quantity", "unit"], sort=False)
    summary = grouped.agg(mean=("mean", "mean"), p95=("p95", "max"), largest=("largest", "max")).reset_index()
    frames = errors[errors["quantity"] == "rotation"]
    for name in ("tracked", "predicted"):
        summary[f"{name}_pct"] = 100.0 * frames[f"n_{name}"].sum() / max(1, frames["n_frames"].sum())
    return Drawing(summary.assign(n_records=errors["record"].nunique()))


def captured_table(_: Run, summary: pd.DataFrame) -> Table:
    """Return these errors for the page."""
    rows = [
        [
            QUANTITIES[row["quantity"]],
            *(
                f"{number(row[name])} {'°' if row['unit'] == 'deg' else row['unit']}"
                for name in ("mean", "p95", "largest")
            ),
        ]
        for _, row in summary.iterrows()
    ]
    lost = 100.0 - summary["tracked_pct"].iloc[0] - summary["predicted_pct"].iloc[0]
    rows.append(["frames measured", f"{summary['tracked_pct'].iloc[0]:.1f} %", "", ""])
    rows.append(["frames predicted, and lost", f"{summary['predicted_pct'].iloc[0]:.1f} %, {lost:.1f} %", "", ""])
    return Table.of(["error of captured heads", "mean", "exceeded in 5 % of the frames", "largest"], rows)


def accuracy(_: Run, errors: pd.DataFrame) -> Drawing:
    """Return the errors of captured heads over image size, contrast and noise, the worst of the three axes.

    Parameters
    ----------
    errors : the table ``head_accuracy``.
    """
    key = ["width_px", "contrast", "noise", "flow", "depth"]
    worst = errors.groupby(key, sort=False)[["mean_deg", "max_deg", "share_lost"]].max().reset_index()
    return Drawing(worst.merge(errors[[*key, "n_frames"]].drop_duplicates(), on=key))


def accuracy_table(_: Run, worst: pd.DataFrame) -> Table:
    """Return these errors for the page."""
    rows = [
        [
            f"{row['width_px']} pixels",
            f"{row['contrast']:g}",
            f"{row['noise']:g}",
            "stereo" if row["depth"] == "disparity" else "one camera",
            "as printed" if row["flow"] == "printed" else "warped reference",
            number(row["mean_deg"]),
            number(row["max_deg"]),
            f"{100 * row['share_lost']:.0f} %",
        ]
        for _, row in worst.iterrows()
    ]
    headings = ["image width", "contrast", "noise", "depth", "flow", "mean error, °", "largest error, °", "lost"]
    return Table.of(headings, rows, words=(3, 4))


def readings(_: Run, readings: pd.DataFrame) -> Drawing:
    """Return what equations give as printed and as read.

    Parameters
    ----------
    readings : the table ``head_readings``.
    """
    return Drawing(readings)


def readings_table(_: Run, found: pd.DataFrame) -> Table:
    """Return these equations for the page."""
    rows = [
        [
            *(row[name] for name in ("equation", "printed", "read", "quantity")),
            *(f"{number(row[name])} {row['unit']}".rstrip() for name in ("as_printed", "as_read")),
        ]
        for _, row in found.fillna({"unit": ""}).iterrows()  # a CSV file has nothing for an empty unit
    ]
    return Table.of(["equation", "printed", "read as", "what is measured", "as printed", "as read"], rows, (1, 2, 3))


def recovered(_: Run, recovery: pd.DataFrame) -> Drawing:
    """Draw the information between patterns of head and melody over the lag, planted and found.

    Parameters
    ----------
    recovery : the table ``head_recovery``.
    """
    curves = recovery[recovery["quantity"] == "information"]
    lags = recovery[recovery["quantity"] == "lag"]
    actors = list(dict.fromkeys(recovery["actor"]))
    n_columns = min(len(actors), MOST_COLUMNS)
    n_rows = math.ceil(len(actors) / n_columns)
    drawn, axes = style.figure(1.0 + 1.8 * n_rows, n_rows, n_columns, sharex=True, sharey=True)
    colours = {"planted": style.AMBER, "found": style.BLUE}
    for panel, actor in zip(axes.flat, actors, strict=False):
        for source, colour in colours.items():
            own = curves[(curves["actor"] == actor) & (curves["source"] == source)]
            panel.plot(own["lag_s"], own["value"], color=colour, label=f"{source} patterns")
        planted = lags[(lags["actor"] == actor) & (lags["source"] == "planted")]["value"].iloc[0]
        panel.axvline(planted, color=style.FAINT, lw=0.9, ls=(0, (4, 3)), label="mean planted lag")
        panel.set_title(actor)
        panel.set_ylim(bottom=0)
        panel.grid(axis="y")
    for unused in range(len(actors), n_rows * n_columns):
        axes.flat[unused].axis("off")
        axes.flat[unused - n_columns].tick_params(labelbottom=True)
    drawn.supxlabel("time by which the head is earlier, s", fontsize=9)
    drawn.supylabel("mutual information, bits", fontsize=9)
    drawn.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return Drawing(recovery[recovery["quantity"] != "information"].reset_index(drop=True), drawn)


def recovery_table(_: Run, found: pd.DataFrame) -> Table:
    """Return the agreement of patterns and the lags for the page."""
    rows = []
    titles = {
        "head_ami": "head gestures: adjusted mutual information of found and planted patterns",
        "melody_ami": "pitch movements: the same",
    }
    for quantity, title in titles.items():
        own = found.loc[found["quantity"] == quantity, "value"]
        rows.append([title, number(own.mean()), f"{number(own.min())} to {number(own.max())}"])
    for actor, lags in found[found["quantity"] == "lag"].groupby("actor", sort=False):
        lag = lags.set_index("source")["value"]
        rows.append(
            [f"lag of the melody of {actor}", f"{number(lag['found'])} s", f"planted: {number(lag['planted'])} s"]
        )
    return Table.of(["what was planted", "found", "range over records, or truth"], rows)
