"""All systems on all measures, next to their controls and ceilings."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cospeech.report import style, words
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.scores import at_main
from cospeech.report.systems import Systems, driven
from cospeech.report.words import number

SEEN = "as seen in its motion"
"""Title of the line below a system that scores the phrases seen in its motion."""

UNSHOWN = ("beat_alignment", "frechet_distance")
"""Measures for which the page has no room; the CSV file and the cross table of worlds contain them."""


class Line(NamedTuple):
    """One line of the leaderboard.

    ``group`` is the role of the system, or ``wrong speech`` for a matched control; ``depth`` says how far the line is
    indented: 1 for a matched control, and one more for what was seen in the motion of the system above.
    """

    system: str
    phrases: str
    title: str
    group: str
    depth: int = 0
    origin: str | None = None


def draw(run: Run, scores: pd.DataFrame) -> Drawing:
    """Draw the scores of all systems at their main variants.

    Parameters
    ----------
    scores : the table ``session_scores``.
    """
    board = table(at_main(scores, run.systems), run.systems)
    return Drawing(board, figure(board, run.systems))


def lines(board: pd.DataFrame, systems: Systems) -> list[Line]:
    """Return the lines of the leaderboard in their order: each system above its own controls, then the others.

    Parameters
    ----------
    board : scores; a system has a line for each kind of ``phrases`` that was scored.
    systems : all systems.
    """
    scored = set(zip(board["system"], board["phrases"], strict=True))
    found: list[Line] = []

    def add(name: str, title: str, group: str, depth: int) -> None:
        kinds = [kind for kind in ("planned", "seen") if (name, kind) in scored]
        for place, kind in enumerate(kinds):
            origin = None if depth + place else systems[name].origin
            found.append(Line(name, kind, SEEN if place else title, group, depth + place, origin))

    for system in driven(systems):
        add(system.name, system.title, "system", 0)
        for control in system.controls:
            add(control, systems[control].title.removeprefix(f"{system.title}: "), "wrong speech", 1)
    placed = {line.system for line in found}
    for role in ("control", "ceiling"):
        for name, system in systems.items():
            if system.role == role and name not in placed:
                add(name, system.title, role, 0)
    return found


def table(scores: pd.DataFrame, systems: Systems) -> pd.DataFrame:
    """Return the session scores with title and role, in the order of the leaderboard."""
    order = {line[:2]: place for place, line in enumerate(lines(scores, systems))}
    named = scores.assign(
        title=[systems[name].title for name in scores["system"]],
        role=[systems[name].role for name in scores["system"]],
        place=[order[key] for key in zip(scores["system"], scores["phrases"], strict=True)],
        measure_place=scores["measure"].map({name: place for place, name in enumerate(words.MEASURES)}),
    ).sort_values(["actor", "place", "part", "measure_place", "bin_s"], kind="stable")
    heads = ["system", "variant", "phrases", "title", "role", "actor", "measure", "part", "bin_s"]
    return named[[*heads, "value", "low", "high", "n", "n_undefined", "n_records"]].reset_index(drop=True)


def columns(board: pd.DataFrame) -> list[tuple[str, float | None]]:
    """Return the measures of a leaderboard in their order, S once for each bin width."""
    bins = sorted(board["bin_s"].dropna().unique())
    heads: list[tuple[str, float | None]] = []
    known = set(board["measure"])
    for name in (name for name in words.MEASURES if name in known):
        heads += [(name, bin_s) for bin_s in bins] if name == "S" else [(name, None)]
    return heads


def shown_columns(board: pd.DataFrame) -> list[tuple[str, float | None]]:
    """Return the columns that fit the page: S in its finest and its widest bins only, and no ``UNSHOWN`` measure."""
    bins = sorted(board["bin_s"].dropna().unique())
    return [
        head
        for head in columns(board)
        if head[0] not in UNSHOWN and (head[1] is None or head[1] in (bins[0], bins[-1]))
    ]


def cells(board: pd.DataFrame, measure: str, bin_s: float | None) -> pd.DataFrame:
    """Return the rows of one column of the leaderboard."""
    own = board[board["measure"] == measure]
    return own if bin_s is None else own[np.isclose(own["bin_s"], bin_s)]


def figure(board: pd.DataFrame, systems: Systems) -> Figure:
    """Draw the scores over all actors: a dot and its interval for whole records, a ring for their interior.

    Scores of phrases that were seen in the motion are drawn as diamonds.

    Parameters
    ----------
    board : see ``table``.
    systems : all systems.
    """
    pooled = board[board["actor"] == "all"]
    heads = shown_columns(pooled)
    shown = lines(pooled, systems)
    places = line_places(shown)
    drawn, axes = style.figure(1.1 + 0.225 * (places[-1] + 1), 1, len(heads), sharey=True)
    for panel, (measure, bin_s) in zip(axes[0], heads, strict=True):
        _column(panel, cells(pooled, measure, bin_s), shown, places)
        panel.set_title(words.measure(measure, bin_s).replace(" ", "\n", 1), fontsize=7.5)
        reference = 1 if measure == "phrase_ratio" else 0
        panel.axvline(reference, color=style.FAINT, lw=0.8, ls=(0, (4, 3)))
        panel.spines["left"].set_visible(False)
        style.ticks_off(panel, "y")
        panel.grid(axis="x")
        panel.locator_params(axis="x", nbins=3)
        panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes[0, 0].set_yticks(places, [line.title for line in shown])
    for label, line in zip(axes[0, 0].get_yticklabels(), shown, strict=True):
        label.set_color(style.FAINT if line.depth else style.INK)
    axes[0, 0].set_ylim(places[-1] + 0.7, -0.7)
    handles = [
        Line2D([], [], marker="o", ls="-", color=style.ROLE_COLOURS[group], label=words.ROLES[group], ms=5)
        for group in dict.fromkeys(line.group for line in shown)
    ]
    handles.append(Line2D([], [], marker="o", mfc="none", ls="none", color=style.INK, label="interior only", ms=5))
    if any(line.title == SEEN for line in shown):
        handles.append(
            Line2D([], [], marker="D", ls="none", color=style.INK, label="phrases seen in the motion", ms=4)
        )
    drawn.legend(handles=handles, loc="outside lower center", ncols=2)
    return drawn


def line_places(shown: list[Line]) -> list[float]:
    """Return the height of each line: indented ones close to their system, some room before another group."""
    places = [0.0]
    for before, line in pairwise(shown):
        together = line.depth or (line.group == before.group and line.group != "system")
        places.append(places[-1] + (1.0 if together else 1.6))
    return places


def _column(axes: Axes, own: pd.DataFrame, shown: list[Line], places: list[float]) -> None:
    where = {line[:2]: (place, style.ROLE_COLOURS[line.group]) for line, place in zip(shown, places, strict=True)}
    for (phrases, part), rows in own.dropna(subset=["value"]).groupby(["phrases", "part"]):
        at, colours = zip(*(where[name, str(phrases)] for name in rows["system"]), strict=True)
        marker, scale = ("o", 1.0) if phrases == "planned" else ("D", 0.7)
        if part == "whole":
            axes.hlines(at, rows["low"], rows["high"], colors=colours, lw=1.6)
            axes.scatter(rows["value"], at, s=20 * scale, color=colours, marker=marker, zorder=3)
        else:
            size = 30 * scale
            axes.scatter(
                rows["value"], at, s=size, facecolors="none", edgecolors=colours, marker=marker, lw=1, zorder=2
            )


class Cell(NamedTuple):
    """One score on the page: value, interval, and how many values were undefined."""

    value: str
    interval: str
    note: str


class Row(NamedTuple):
    """One line of the leaderboard on the page."""

    line: Line
    cells: list[Cell]


class Boards(NamedTuple):
    """The leaderboard on the page: headings, and rows for whole records and for their interior."""

    heads: list[str]
    whole: list[Row]
    interior: list[Row]


def boards(run: Run, board: pd.DataFrame) -> Boards:
    """Return the leaderboard over all actors for the page."""
    pooled = board[board["actor"] == "all"]
    heads = [words.measure(measure, bin_s) for measure, bin_s in shown_columns(pooled)]
    return Boards(heads, *(_rows(pooled[pooled["part"] == part], run.systems) for part in ("whole", "interior")))


def _rows(pooled: pd.DataFrame, systems: Systems) -> list[Row]:
    heads = shown_columns(pooled)
    key = ["system", "phrases", "measure", "bin_s"]
    keyed = pooled.astype({"bin_s": object}).where(pooled.notna(), None)
    found = dict(zip(zip(*(keyed[name] for name in key), strict=True), map(_cell, pooled.itertuples()), strict=True))
    empty = Cell("–", "", "")
    return [Row(line, [found.get((*line[:2], *head), empty) for head in heads]) for line in lines(pooled, systems)]


def _cell(row: Any) -> Cell:
    interval = "" if pd.isna(row.low) else f"{number(row.low)} to {number(row.high)}"
    undefined = int(row.n_undefined)
    note = f"{undefined} of {undefined + int(row.n)} undefined" if undefined else ""
    return Cell(number(row.value), interval, note)
