"""Which differences between systems the corpus can resolve."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.report import style, words
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.scores import common_phrases
from cospeech.report.systems import Systems, driven, general_controls

MEASURES = ["kappa", "D", "boundary_f1", "S", "hand_speed_r"]
"""What the figure shows, as far as it was measured: without motion, hands have no speed."""


def draw(run: Run, differences: pd.DataFrame, bins_s: list[float]) -> Drawing:
    """Draw the differences on the interior of records.

    Parameters
    ----------
    differences : the table ``differences``.
    bins_s : bin widths of S; the widest one is used.
    """
    table = pairs(differences, run.systems, "interior", max(bins_s))
    measured = [measure for measure in MEASURES if (table["measure"] == measure).any()]
    return Drawing(table, figure(table, run.systems, measured))


def pairs(differences: pd.DataFrame, systems: Systems, part: str, bin_s: float) -> pd.DataFrame:
    """Return the differences between each system and its controls, the other controls, and the systems before it.

    Parameters
    ----------
    differences : the table ``differences``.
    systems : all systems.
    part : whole or interior.
    bin_s : bin width of the S that is kept.

    Returns
    -------
    The rows of ``differences`` over all actors, with a column ``kind``: own controls, other controls, systems.
    """
    listening = driven(systems)
    wanted: dict[tuple[str, str], str] = {}
    for system in listening:
        wanted |= {(system.name, control): "own controls" for control in system.controls if control in systems}
    for system in listening:
        wanted |= {(system.name, control.name): "other controls" for control in general_controls(systems)}
    for place, system in enumerate(listening[1:], start=1):
        wanted |= {(system.name, other.name): "systems" for other in listening[:place]}
    rows = common_phrases(differences, systems)
    rows = rows[
        (rows["actor"] == "all")
        & (rows["part"] == part)
        & (rows["bin_s"].isna() | np.isclose(rows["bin_s"].fillna(-1), bin_s))
    ]
    key = pd.MultiIndex.from_frame(rows[["system", "other"]])
    order = {pair: place for place, pair in enumerate(wanted)}
    chosen = rows.assign(
        kind=[wanted.get(pair, "") for pair in key],
        place=[order.get(pair, -1) for pair in key],
    )
    chosen = chosen[chosen["kind"] != ""]
    return chosen.sort_values(["place", "measure"], kind="stable").drop(columns="place").reset_index(drop=True)


def figure(table: pd.DataFrame, systems: Systems, measures: list[str]) -> Figure:
    """Draw the differences of ``pairs`` with their intervals; a dot is filled if the interval excludes 0."""
    chosen = table[table["measure"].isin(measures)]
    rows = list(dict.fromkeys(zip(chosen["system"], chosen["other"], chosen["kind"], strict=True)))
    drawn, axes = style.figure(1.0 + 0.225 * len(rows), 1, len(measures), sharey=True)
    order = {pair[:2]: place for place, pair in enumerate(rows)}
    for panel, measure in zip(axes[0], measures, strict=True):
        own = chosen[chosen["measure"] == measure].dropna(subset=["difference"])
        places = [order[pair] for pair in zip(own["system"], own["other"], strict=True)]
        _differences(panel, own, places, measure)
        panel.axvline(0, color=style.INK, lw=0.8)
        arrow = {"more": "better →", "less": "← better"}.get(words.MEASURES[measure].better, "")
        bin_s = own["bin_s"].iloc[0] if len(own) else None
        panel.set_title(words.measure(measure, bin_s).replace(" ", "\n", 1))
        panel.set_xlabel(arrow, color=style.FAINT)
        panel.grid(axis="x")
        panel.locator_params(axis="x", nbins=3)
        panel.xaxis.set_major_formatter(lambda value, _: words.number(value) if value else "0")
        panel.spines["left"].set_visible(False)
        panel.tick_params(axis="y", length=0)
    axes[0, 0].set_yticks(range(len(rows)), [_comparison(systems, system, other) for system, other, _ in rows])
    axes[0, 0].set_ylim(len(rows) - 0.4, -0.6)
    for place, (one, two) in enumerate(pairwise(rows)):
        if one[2] != two[2]:
            for panel in axes[0]:
                panel.axhline(place + 0.5, color=style.GRID, lw=0.8)
    return drawn


def _comparison(systems: Systems, system: str, other: str) -> str:
    one, two = systems[system].title, systems[other].title
    return f"{one}  −  {two.replace(one + ': ', 'with ')}"


def _differences(axes: Axes, own: pd.DataFrame, places: list[int], measure: str) -> None:
    decided = (own["low"] > 0) | (own["high"] < 0)
    good = (own["difference"] > 0) == (words.MEASURES[measure].better == "more")
    colours = np.where(~decided, style.FAINT, np.where(good, style.BLUE, style.VERMILLION))
    axes.hlines(places, own["low"], own["high"], colors=colours.tolist(), lw=1.6)
    inside = np.where(decided, colours, style.PAPER)
    axes.scatter(own["difference"], places, s=24, facecolors=inside.tolist(), edgecolors=colours.tolist(), zorder=3)
