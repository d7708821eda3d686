"""S and D against the number of prosody clusters and of their states (Özkul 2012, fig. 7.2)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.report import style, words

Axis = Literal["clusters", "states"]

REFERENCES = ("another", "shifted")
"""What is drawn as a level beside the sweep: the ceiling of S, and the strictest control."""


def table(session_scores: pd.DataFrame, axis: Axis, main: dict[str, int], systems: list[str]) -> pd.DataFrame:
    """Return S and D of the swept systems along one axis of the sweep, the other at its main value.

    Parameters
    ----------
    session_scores : the table of that name.
    axis : what varies.
    main : clusters and states of the main setting.
    systems : the systems that were swept.
    """
    other = "states" if axis == "clusters" else "clusters"
    chosen = session_scores[
        session_scores["measure"].isin(["S", "D"])
        & (session_scores["part"] == "whole")
        & (session_scores[other] == main[other])
        & session_scores["system"].isin(systems)
    ]
    columns = ["system", "actor", "measure", "bin_s", axis, other, "value", "low", "high", "n", "n_undefined"]
    order = ["system", "actor", "measure", "bin_s", axis]
    return chosen[columns].sort_values(order, kind="stable").reset_index(drop=True)


def references(session_scores: pd.DataFrame, clusters: int, states: int) -> pd.DataFrame:
    """Return S and D of the reference systems at the main setting, all actors pooled."""
    return session_scores[
        session_scores["system"].isin(REFERENCES)
        & (session_scores["clusters"] == clusters)
        & (session_scores["states"] == states)
        & (session_scores["actor"] == "all")
        & (session_scores["part"] == "whole")
        & session_scores["measure"].isin(["S", "D"])
    ]


def best_published(published: dict[str, dict[str, Any]], axis: Axis) -> dict[str, float]:
    """Return the best value of the thesis on one axis (``at``), and S and D there where it printed them."""
    known = published["fig-7.2a" if axis == "clusters" else "fig-7.2b"]
    names = {f"best_{axis}": "at", "best_S": "S", "best_D_s": "D"}
    return {short: known[name] for name, short in names.items() if name in known}


def figure(
    swept: pd.DataFrame, levels: pd.DataFrame, axis: Axis, titles: dict[str, str], published: dict[str, float]
) -> Figure:
    """Draw S at the finest and the widest bins, and D, against one axis of the sweep, all actors pooled.

    Parameters
    ----------
    swept : from ``table``.
    levels : from ``references``.
    axis : what varies.
    titles : title of each system.
    published : ``at`` (the best value of the axis), and where known ``S`` and ``D`` there.
    """
    pooled = swept[swept["actor"] == "all"]
    bins = sorted(pooled["bin_s"].dropna().unique())
    panels: list[tuple[str, float | None]] = [("S", bin_s) for bin_s in dict.fromkeys([bins[0], bins[-1]])]
    panels.append(("D", None))
    systems = list(dict.fromkeys(pooled["system"]))
    colours = style.system_colours(systems)
    drawn, axes = style.figure(3.3, 1, len(panels))
    for panel, (measure, bin_s) in zip(axes[0], panels, strict=True):
        for system in systems:
            _line(
                panel, _of(pooled[pooled["system"] == system], measure, bin_s), axis, titles[system], colours[system]
            )
        _levels(panel, _of(levels, measure, bin_s), titles)
        if measure in published:
            panel.plot(published["at"], published[measure], ls="none", marker="D", ms=6, mfc="none", mew=1.5,
                       color=style.INK, label="published (another corpus)")  # fmt: skip
        panel.set_title(words.measure(measure, bin_s))
        panel.set_xlabel(f"prosody {axis}")
        panel.set_xticks(sorted(pooled[axis].unique()))
        panel.set_ylim(0, 1 if measure == "S" else None)
        panel.grid(axis="y")
    handles: dict[str, Artist] = {}
    for panel in axes[0]:
        handles |= {label: handle for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    drawn.legend(list(handles.values()), list(handles), loc="outside upper center", ncols=3)
    return drawn


def _of(table: pd.DataFrame, measure: str, bin_s: float | None) -> pd.DataFrame:
    own = table[table["measure"] == measure]
    return own if bin_s is None else own[np.isclose(own["bin_s"], bin_s)]


def _line(axes: Axes, own: pd.DataFrame, axis: Axis, title: str, colour: str) -> None:
    axes.fill_between(own[axis], own["low"], own["high"], color=colour, alpha=0.16, lw=0)
    axes.plot(own[axis], own["value"], marker="o", ms=4, color=colour, label=title)


def _levels(axes: Axes, levels: pd.DataFrame, titles: dict[str, str]) -> None:
    dashes = {"another": (0, (5, 3)), "shifted": (0, (1, 2))}
    for system, value in zip(levels["system"], levels["value"], strict=True):
        axes.axhline(value, color=style.FAINT, ls=dashes[system], lw=1.3, label=titles.get(system, system))
