"""Motion in figures: smoothing filters (fig. 6.3), and how fast original and synthesised hands move."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.report import style
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.systems import matched

FILTERS = {
    "none": ("none", style.INK),
    "exponential": ("exponential", style.VERMILLION),
    "moving_average": ("moving average", style.BLUE),
    "gaussian": ("Gaussian", style.GREEN),
    "median": ("median", "#cc79a7"),
}

JOINTS = {"left_hand": "left wrist", "right_hand": "right wrist"}
"""The joints whose motion the figure pools."""


def smoothing(_: Run, trial: pd.DataFrame) -> Drawing:
    """Draw one joint angle around a phrase boundary with each smoothing filter.

    Parameters
    ----------
    trial : the table ``smoothing_trial``.
    """
    return Drawing(trial, smoothing_figure(trial))


def speeds(run: Run, statistics: pd.DataFrame, histograms: pd.DataFrame) -> Drawing:
    """Draw how fast original and synthesised hands move.

    Parameters
    ----------
    statistics, histograms : the tables ``motion_statistics`` and ``motion_histograms``.

    Matched controls are in the table only: they are the same systems, and move alike.
    """
    summary = distances(statistics)
    drawn, counted = (table[~table["system"].isin(matched(run.systems))] for table in (summary, histograms))
    return Drawing(summary, figure(counted, drawn, run.titles))


def smoothing_figure(trial: pd.DataFrame) -> Figure:
    """Draw the curves of a smoothing trial."""
    drawn, axes = style.figure(3.2)
    panel = axes[0, 0]
    boundary = float(trial["boundary_s"].iloc[0])
    for name, (title, colour) in FILTERS.items():
        own = trial[trial["filter"] == name]
        if len(own):
            plain = name == "none"
            panel.plot(own["time_s"], own["angle_deg"], color=colour, lw=1.0 if plain else 1.6, label=title,
                       ls=(0, (3, 2)) if plain else "-", marker=".", ms=3 if plain else 4)  # fmt: skip
    panel.axvline(boundary, color=style.FAINT, lw=1.0)
    panel.annotate("phrase boundary", (boundary, 0.03), xycoords=("data", "axes fraction"), xytext=(4, 0),
                   textcoords="offset points", va="bottom", color=style.FAINT, fontsize=8)  # fmt: skip
    joint, axis = trial["joint"].iloc[0].replace("_", " "), trial["axis"].iloc[0]
    panel.set(xlabel="time (s)", ylabel=f"{joint}, {axis} angle (°)")
    panel.grid(axis="y")
    drawn.legend(loc="outside upper center", ncols=5)
    return drawn


def distances(statistics: pd.DataFrame) -> pd.DataFrame:
    """Return the mean speed, acceleration and jerk of wrists and elbows by system, and their Hellinger distances.

    Parameters
    ----------
    statistics : the table ``motion_statistics``.

    Returns
    -------
    Columns system, quantity, unit, fps, mean, hellinger, lowest, highest (hellinger by record), records.
    """
    by_record = statistics.groupby(["system", "quantity", "unit", "fps", "record"], sort=False)[["mean", "hellinger"]]
    rows = []
    for (system, quantity, unit, fps), group in by_record.mean().groupby(level=[0, 1, 2, 3], sort=False):
        rows.append(
            {"system": system, "quantity": quantity, "unit": unit, "fps": fps, "mean": group["mean"].mean()}
            | {"hellinger": group["hellinger"].mean(), "lowest": group["hellinger"].min()}
            | {"highest": group["hellinger"].max(), "records": len(group)}
        )
    return pd.DataFrame(rows)


def figure(histograms: pd.DataFrame, summary: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Draw how speed, acceleration and jerk of the wrists are distributed, and how far from the original that is.

    Parameters
    ----------
    histograms : the table ``motion_histograms``.
    summary : see ``distances``.
    titles : title of each system.
    """
    quantities = list(dict.fromkeys(histograms["quantity"]))
    systems = [name for name in dict.fromkeys(histograms["system"]) if name != "original"]
    colours = style.system_colours(systems)
    lower = 0.24 * (len(systems) + 1)
    drawn, axes = style.figure(3.2 + lower, 2, len(quantities), gridspec_kw={"height_ratios": [1.5, lower]})
    wrists = histograms[histograms["joint"].isin(JOINTS)]
    for column, quantity in enumerate(quantities):
        own = wrists[wrists["quantity"] == quantity]
        upper = axes[0, column]
        for name in ["original", *systems]:
            curve = own[own["system"] == name].groupby("bin")[["low", "share"]].mean()
            first = name == "original"
            upper.step(curve["low"], 100 * curve["share"], where="post", color=style.INK if first else colours[name],
                       lw=2.2 if first else 1.3, label=titles.get(name, name))  # fmt: skip
        upper.set(yscale="log", xlabel=f"{quantity} ({own['unit'].iloc[0].replace('^2', '²').replace('^3', '³')})")
        upper.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        upper.grid(axis="y")
        _distance_panel(axes[1, column], summary[summary["quantity"] == quantity], systems, colours, titles)
    axes[0, 0].set_ylabel("frames (%)")
    for column in range(1, len(quantities)):
        axes[1, column].set_yticklabels([])
    drawn.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return drawn


def _distance_panel(
    axes: Axes, own: pd.DataFrame, systems: list[str], colours: dict[str, str], titles: dict[str, str]
) -> None:
    names = [*systems, "another original"]
    for place, name in enumerate(names):
        row = own[own["system"] == name]
        if len(row):
            colour = colours.get(name, style.FAINT)
            axes.plot([row["lowest"].iloc[0], row["highest"].iloc[0]], [place, place], color=colour, lw=1.6)
            axes.plot(row["hellinger"].iloc[0], place, marker="o", ms=5, color=colour)
    axes.set_yticks(range(len(names)), [titles.get(name, name) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(0, max(0.1, float(np.nanmax(own["highest"])) * 1.08))
    axes.set_xlabel("Hellinger distance to the original")
    axes.grid(axis="x")
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
