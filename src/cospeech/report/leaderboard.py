"""All systems on all measures, their controls and ceilings beside them, and which differences the corpus resolves."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cospeech.report import style, words

Systems = dict[str, dict[str, Any]]
"""By name, in the order of the table: title, role, controls (names of the same decoder under wrong speech)."""


def at_main(scores: pd.DataFrame, clusters: int, states: int) -> pd.DataFrame:
    """Return the session scores at the main setting."""
    return scores[(scores["clusters"] == clusters) & (scores["states"] == states)]


class Line(NamedTuple):
    """One line of the leaderboard: a system, its name there, and its role; matched controls follow their system."""

    name: str
    title: str
    role: str


def lines(systems: Systems) -> list[Line]:
    """Return the systems in the order of the leaderboard: each one above its own controls, then the others."""
    found = []
    for name, system in systems.items():
        if system["role"] == "system":
            found.append(Line(name, system["title"], "system"))
            for control in system["controls"]:
                short = systems[control]["title"].removeprefix(f"{system['title']}: ")
                found.append(Line(control, short, "wrong speech"))
    placed = {line.name for line in found}
    for role in ("control", "ceiling"):
        rest = [name for name, system in systems.items() if system["role"] == role and name not in placed]
        found += [Line(name, systems[name]["title"], role) for name in rest]
    return found


def table(scores: pd.DataFrame, systems: Systems) -> pd.DataFrame:
    """Return the session scores of the main setting with title and role, in the order of the leaderboard."""
    order = [line.name for line in lines(systems)]
    named = scores.assign(
        title=scores["system"].map({name: system["title"] for name, system in systems.items()}),
        role=scores["system"].map({name: system["role"] for name, system in systems.items()}),
        place=scores["system"].map({name: place for place, name in enumerate(order)}),
        measure_place=scores["measure"].map({name: place for place, name in enumerate(words.MEASURES)}),
    ).sort_values(["actor", "place", "part", "measure_place", "bin_s"], kind="stable")
    columns = ["system", "title", "role", "actor", "measure", "part", "bin_s", "value", "low", "high", "n"]
    return named[[*columns, "n_undefined", "n_records"]].reset_index(drop=True)


def columns(board: pd.DataFrame) -> list[tuple[str, float | None]]:
    """Return the measures of a leaderboard in their order, S once for each bin width."""
    bins = sorted(board["bin_s"].dropna().unique())
    heads: list[tuple[str, float | None]] = []
    for name in words.MEASURES:
        heads += [(name, bin_s) for bin_s in bins] if name == "S" else [(name, None)]
    return heads


def cells(board: pd.DataFrame, measure: str, bin_s: float | None) -> pd.DataFrame:
    """Return the rows of one column of the leaderboard."""
    own = board[board["measure"] == measure]
    return own if bin_s is None else own[np.isclose(own["bin_s"], bin_s)]


def figure(board: pd.DataFrame, systems: Systems) -> Figure:
    """Draw every system's scores over all actors: a dot and its interval on whole records, a ring on their interior.

    Parameters
    ----------
    board : from ``table``.
    systems : as there.
    """
    pooled = board[board["actor"] == "all"]
    bins = sorted(pooled["bin_s"].dropna().unique())
    heads = [head for head in columns(pooled) if head[1] is None or head[1] in (bins[0], bins[-1])]
    shown = lines(systems)
    places = _places(shown)
    drawn, axes = style.figure(1.1 + 0.225 * (places[-1] + 1), 1, len(heads), sharey=True)
    for panel, (measure, bin_s) in zip(axes[0], heads, strict=True):
        _column(panel, cells(pooled, measure, bin_s), shown, places)
        panel.set_title(words.measure(measure, bin_s).replace(" ", "\n", 1), fontsize=8.5)
        reference = 1 if measure == "phrase_ratio" else 0
        panel.axvline(reference, color=style.FAINT, lw=0.8, ls=(0, (4, 3)))
        panel.spines["left"].set_visible(False)
        style.ticks_off(panel, "y")
        panel.grid(axis="x")
        panel.locator_params(axis="x", nbins=3)
    axes[0, 0].set_yticks(places, [line.title for line in shown])
    for label, line in zip(axes[0, 0].get_yticklabels(), shown, strict=True):
        label.set_color(style.FAINT if line.role == "wrong speech" else style.INK)
    axes[0, 0].set_ylim(places[-1] + 0.7, -0.7)
    handles = [
        Line2D([], [], marker="o", ls="-", color=style.ROLE_COLOURS[role], label=words.ROLES[role], ms=5)
        for role in dict.fromkeys(line.role for line in shown)
    ]
    handles.append(Line2D([], [], marker="o", mfc="none", ls="none", color=style.INK, label="interior only", ms=5))
    drawn.legend(handles=handles, loc="outside lower center", ncols=2)
    return drawn


def _places(shown: list[Line]) -> list[float]:
    """Return the height of each line: matched controls close to their system, some room before another group."""
    places = [0.0]
    for before, line in pairwise(shown):
        together = line.role == "wrong speech" or (line.role == before.role and line.role != "system")
        places.append(places[-1] + (1.0 if together else 1.6))
    return places


def _column(axes: Axes, own: pd.DataFrame, shown: list[Line], places: list[float]) -> None:
    where = pd.DataFrame({"place": places, "colour": [style.ROLE_COLOURS[line.role] for line in shown]})
    where.index = pd.Index([line.name for line in shown], name="system")
    for part in ("interior", "whole"):
        rows = own[own["part"] == part].dropna(subset=["value"]).join(where, on="system")
        colours = rows["colour"].tolist()
        if part == "whole":
            axes.hlines(rows["place"], rows["low"], rows["high"], colors=colours, lw=1.6)
            axes.scatter(rows["value"], rows["place"], s=20, color=colours, zorder=3)
        else:
            axes.scatter(rows["value"], rows["place"], s=30, facecolors="none", edgecolors=colours, lw=1.0, zorder=2)


def pairs(differences: pd.DataFrame, systems: Systems, part: str, bin_s: float) -> pd.DataFrame:
    """Return the differences that matter: each speech-driven system against its controls, and the systems in order.

    Parameters
    ----------
    differences : the table of that name.
    systems : titles, roles and matched controls.
    part : whole or interior.
    bin_s : bin width of the S that is kept.

    Returns
    -------
    The rows of ``differences`` over all actors, with a column ``kind``: own controls, other controls, systems.
    """
    hearing = [name for name, system in systems.items() if system["role"] == "system"]
    matched = {control for name in hearing for control in _controls(systems, name)}
    general = [name for name, system in systems.items() if system["role"] == "control" and name not in matched]
    wanted: dict[tuple[str, str], str] = {}
    for name in hearing:
        wanted |= {(name, control): "own controls" for control in _controls(systems, name) if control in systems}
    for name in hearing:
        wanted |= {(name, control): "other controls" for control in general}
    for place, name in enumerate(hearing[1:], start=1):
        wanted |= {(name, other): "systems" for other in hearing[:place]}
    rows = differences[
        (differences["actor"] == "all")
        & (differences["part"] == part)
        & (differences["bin_s"].isna() | np.isclose(differences["bin_s"].fillna(-1), bin_s))
    ]
    key = pd.MultiIndex.from_frame(rows[["system", "other"]])
    order = {pair: place for place, pair in enumerate(wanted)}
    chosen = rows.assign(
        kind=[wanted.get(pair, "") for pair in key],
        place=[order.get(pair, -1) for pair in key],
    )
    chosen = chosen[chosen["kind"] != ""]
    return chosen.sort_values(["place", "measure"], kind="stable").drop(columns="place").reset_index(drop=True)


def _controls(systems: Systems, name: str) -> list[str]:
    return list(systems[name]["controls"])


def difference_figure(table: pd.DataFrame, systems: Systems, measures: list[str]) -> Figure:
    """Draw the differences of ``pairs`` with their intervals; a filled dot where the interval leaves out 0."""
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
        panel.set_title(words.measure(measure, bin_s).replace(" (", "\n("))
        panel.set_xlabel(arrow, color=style.FAINT)
        panel.grid(axis="x")
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
    one, two = systems[system]["title"], systems[other]["title"]
    return f"{one}  −  {two.replace(one + ': ', 'with ')}"


def _differences(axes: Axes, own: pd.DataFrame, places: list[int], measure: str) -> None:
    decided = (own["low"] > 0) | (own["high"] < 0)
    good = (own["difference"] > 0) == (words.MEASURES[measure].better == "more")
    colours = np.where(~decided, style.FAINT, np.where(good, style.BLUE, style.VERMILLION))
    axes.hlines(places, own["low"], own["high"], colors=colours.tolist(), lw=1.6)
    inside = np.where(decided, colours, style.PAPER)
    axes.scatter(own["difference"], places, s=24, facecolors=inside.tolist(), edgecolors=colours.tolist(), zorder=3)
