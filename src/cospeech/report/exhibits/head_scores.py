"""All heads that systems moved, next to those of their controls, compared with the recorded head."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from cospeech.report import style, words
from cospeech.report.exhibits import leaderboard
from cospeech.report.exhibits.leaderboard import Cell, Line, Row
from cospeech.report.exhibits.run import Drawing, Facts, Run
from cospeech.report.page.tables import Pair
from cospeech.report.systems import Systems, driven
from cospeech.report.words import HEAD_MEASURES, number

PUBLISHED = ("normalised", "mahalanobis", "euclidean")
"""The measures of the published table, in its order."""


LEGEND_COLUMNS = 2


class Board(NamedTuple):
    """The scores on the page: headings and rows."""

    heads: list[str]
    rows: list[Row]


def systems_of(run: Run) -> Systems:
    """Return the systems with heads: those that move the head alone, then those that move the whole body."""
    return run.heads | {name: system for name, system in run.systems.items() if name not in run.heads}


def board(run: Run, sessions: pd.DataFrame) -> Drawing:
    """Draw the mean scores of all heads (table 4.1), with intervals over records and over minutes.

    Parameters
    ----------
    sessions : the table ``head_sessions``.
    """
    own = sessions[sessions["other"].isna() & sessions["lag_s"].isna()].drop(columns=["other", "lag_s"])
    systems = systems_of(run)
    order = {line.system: place for place, line in enumerate(_lines(own, systems))}
    numbers = own.assign(
        title=[systems[name].title for name in own["system"]],
        role=[systems[name].role for name in own["system"]],
        place=own["system"].map(order),
        measure_place=own["measure"].map({name: place for place, name in enumerate(HEAD_MEASURES)}),
    ).sort_values(["place", "measure_place", "unit"], kind="stable", ignore_index=True)
    numbers = numbers.drop(columns=["place", "measure_place"])
    shown = _lines(numbers, systems)
    places = leaderboard.line_places(shown)
    measures = [name for name in HEAD_MEASURES if name in set(numbers["measure"])]
    drawn, axes = style.figure(1.0 + 0.24 * (places[-1] + 1), 1, len(measures), sharey=True)
    for panel, measure in zip(axes[0], measures, strict=True):
        _column(panel, numbers[numbers["measure"] == measure], shown, places)
        panel.set_title(words.head_measure(measure).replace(" ", "\n", 1), fontsize=8)
        panel.spines["left"].set_visible(False)
        style.ticks_off(panel, "y")
        panel.grid(axis="x")
        panel.locator_params(axis="x", nbins=4)
    axes[0, 0].set_yticks(places, [line.title for line in shown])
    for label, line in zip(axes[0, 0].get_yticklabels(), shown, strict=True):
        label.set_color(style.FAINT if line.depth else style.INK)
    axes[0, 0].set_ylim(places[-1] + 0.7, -0.7)
    handles = [
        Line2D([], [], marker="o", ls="-", color=style.ROLE_COLOURS[group], label=words.ROLES[group], ms=5)
        for group in dict.fromkeys(line.group for line in shown)
    ]
    handles.append(
        Line2D([], [], color=style.INK, lw=3.2, alpha=0.35, label="interval over records (thin: over minutes)")
    )
    drawn.legend(handles=handles, loc="outside lower center", ncols=2)
    return Drawing(numbers, drawn)


def _lines(own: pd.DataFrame, systems: Systems) -> list[Line]:
    return leaderboard.lines(own.assign(phrases="planned"), systems)


def _column(panel: Axes, own: pd.DataFrame, shown: list[Line], places: list[float]) -> None:
    where = {line.system: (place, style.ROLE_COLOURS[line.group]) for line, place in zip(shown, places, strict=True)}
    for unit, width, faint in (("record", 3.2, 0.35), ("minute", 1.1, 1.0)):
        rows = own[own["unit"] == unit].dropna(subset=["value"])
        if len(rows):
            at, colours = zip(*(where[name] for name in rows["system"]), strict=True)
            panel.hlines(at, rows["low"], rows["high"], colors=colours, lw=width, alpha=faint)
            if unit == "record":
                panel.scatter(rows["value"], at, s=20, color=colours, zorder=3)


def table(run: Run, numbers: pd.DataFrame) -> Board:
    """Return the scores for the page, with intervals over records."""
    own = numbers[numbers["unit"] == "record"]
    systems = systems_of(run)
    measures = [name for name in HEAD_MEASURES if name in set(own["measure"])]
    found = {(row.system, row.measure): _cell(row) for row in own.itertuples()}
    empty = Cell("–", "", "")
    rows = [
        Row(line, [found.get((line.system, measure), empty) for measure in measures]) for line in _lines(own, systems)
    ]
    return Board([words.head_measure(measure) for measure in measures], rows)


def _cell(row: Any) -> Cell:
    interval = "" if pd.isna(row.low) else f"{number(row.low)} to {number(row.high)}"
    return Cell(number(row.value), interval, "")


def compare(run: Run, numbers: pd.DataFrame, facts: Facts) -> list[Pair]:
    """Return the published distances of the proposed system and of its baseline next to ours.

    The proposed one is the first; the baseline is the first that another section describes.
    """
    own = numbers[numbers["unit"] == "record"].set_index(["system", "measure"])["value"]
    listening = driven(run.heads)
    baseline = [system for system in listening if system.source != listening[0].source][:1]
    pairs = []
    for place, system in enumerate([listening[0], *baseline]):
        for measure in PUBLISHED:
            if (system.name, measure) in own.index:
                what = f"{words.head_measure(measure)}, {system.title}"
                pairs.append(Pair(what, f"{facts[measure][place]:.3f}", f"{own[system.name, measure]:.3f}"))
    return pairs


def differences(run: Run, sessions: pd.DataFrame) -> Drawing:
    """Draw the differences between systems of heads and what they are compared with.

    Parameters
    ----------
    sessions : the table ``head_sessions``.
    """
    systems = systems_of(run)
    own = sessions[sessions["other"].notna() & sessions["lag_s"].isna()].drop(columns="lag_s")
    own = own[own["system"].isin(list(run.heads))].reset_index(drop=True)
    measures = [name for name in HEAD_MEASURES if name in set(own["measure"])]
    labels = _labels(own, systems)
    places = {key: place for place, key in enumerate(labels)}
    drawn, axes = style.figure(0.9 + 0.22 * len(labels), 1, len(measures), sharey=True)
    for panel, measure in zip(axes[0], measures, strict=True):
        for unit, width, faint in (("record", 3.2, 0.35), ("minute", 1.1, 1.0)):
            rows = own[(own["measure"] == measure) & (own["unit"] == unit)].dropna(subset=["value"])
            at = [places[pair] for pair in zip(rows["system"], rows["other"], strict=True)]
            colours = [_verdict(row, HEAD_MEASURES[measure].better) for _, row in rows.iterrows()]
            panel.hlines(at, rows["low"], rows["high"], colors=colours, lw=width, alpha=faint)
            if unit == "record":
                panel.scatter(rows["value"], at, s=18, color=colours, zorder=3)
        panel.axvline(0.0, color=style.FAINT, lw=0.8)
        panel.set_title(words.head_measure(measure).replace(" ", "\n", 1), fontsize=8)
        panel.spines["left"].set_visible(False)
        style.ticks_off(panel, "y")
        panel.grid(axis="x")
        panel.locator_params(axis="x", nbins=4)
    axes[0, 0].set_yticks(range(len(labels)), list(labels.values()))
    for text, (_, other) in zip(axes[0, 0].get_yticklabels(), labels, strict=True):
        text.set_color(style.FAINT if other else style.INK)
    axes[0, 0].set_ylim(len(labels) - 0.4, -0.6)
    return Drawing(own, drawn)


def _labels(own: pd.DataFrame, systems: Systems) -> dict[tuple[str, str], str]:
    """Return the labels of the lines: for each system its title, and what is subtracted from it below."""
    found: dict[tuple[str, str], str] = {}
    for name, other in zip(own["system"], own["other"], strict=True):
        title = systems[name].title
        found.setdefault((name, ""), title)
        found.setdefault((name, other), f"minus {systems[other].title.removeprefix(f'{title}: ')}")
    return found


def _verdict(row: pd.Series, better: str) -> str:
    """Return the colour of a difference: whether its interval excludes 0, and on which side."""
    if not (row["low"] > 0 or row["high"] < 0):
        return style.FAINT
    return style.GREEN if (row["low"] > 0) == (better == "more") else style.VERMILLION


def lags(run: Run, sessions: pd.DataFrame) -> Drawing:
    """Draw the correlation of the angular speeds of made and recorded heads over the lag between them.

    Parameters
    ----------
    sessions : the table ``head_sessions``.
    """
    own = sessions[sessions["other"].isna() & sessions["lag_s"].notna() & (sessions["unit"] == "record")]
    systems = systems_of(run)
    shown = [*run.shown_heads, *(system.name for system in driven(systems) if system.name not in run.shown_heads)]
    shown = [name for name in shown if name in set(own["system"])]
    drawn, axes = style.figure(2.9 + 0.2 * math.ceil(len(shown) / LEGEND_COLUMNS))
    panel = axes[0, 0]
    for name, colour in style.system_colours(shown).items():
        rows = own[own["system"] == name].sort_values("lag_s")
        panel.plot(rows["lag_s"], rows["value"], color=colour, label=systems[name].title)
        panel.fill_between(rows["lag_s"], rows["low"], rows["high"], color=colour, alpha=0.12, lw=0)
    panel.axhline(0.0, color=style.FAINT, lw=0.8)
    panel.axvline(0.0, color=style.FAINT, lw=0.8, ls=(0, (4, 3)))
    panel.set_xlabel("time by which the made head is later than the recorded one, s")
    panel.set_ylabel("correlation of angular speeds")
    panel.grid(axis="y")
    drawn.legend(loc="outside lower center", ncols=LEGEND_COLUMNS)
    return Drawing(own[own["system"].isin(shown)].drop(columns="other").reset_index(drop=True), drawn)
