"""The page: everything of a run in one file that needs nothing else."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import pandas as pd

from cospeech.report import words
from cospeech.report.captions import Caption
from cospeech.report.findings import number
from cospeech.report.leaderboard import Systems, cells, columns, lines
from cospeech.report.published import Pair

THEMED = {"#22262b": "var(--ink)", "#7b828c": "var(--faint)", "#dfe3e8": "var(--grid)", "#fffffe": "var(--paper)"}
"""Colours of the figures that follow the page from light to dark."""


@dataclass(frozen=True)
class Table:
    """A table as the page shows it; the first cell of a row is its heading, and ``words`` are columns of text."""

    headings: list[str]
    rows: list[list[str]]
    words: tuple[int, ...] = ()


@dataclass(frozen=True)
class Exhibit:
    """One exhibit: its caption, its picture or table, and what was published beside it."""

    name: str
    caption: Caption
    svg: str | None = None
    table: Table | None = None
    beside: list[Pair] = field(default_factory=list)


class Section(NamedTuple):
    """A part of the page."""

    anchor: str
    title: str
    short: str
    text: str
    exhibits: list[Exhibit]


LAYOUT = (
    ("speech", "From speech to gesture", "Speech", "", ("fig-timeline",)),
    (
        "capture",
        "From film to joint angles",
        "Capture",
        "The cameras are calibrated, the markers followed through five films and put together in space, and a body "
        "with the actor's own measures is moved until it carries them.",
        ("table-capture", "fig-rig", "table-observability"),
    ),
    (
        "watch",
        "Watch",
        "Watch",
        "From left to right: the original, and before it its film where there is one; what a system made of the "
        "speech; gestures drawn at random. All speak with the record's own voice.",
        ("fig-6.4", "fig-motion"),
    ),
    (
        "scores",
        "Scores",
        "Scores",
        "Each record was left out in turn: the system learned from the actor's other records, heard the speech of "
        "this one, and its gesture phrases are held against the actual ones.",
        ("leaderboard", "fig-differences"),
    ),
    (
        "thesis",
        "The experiments of the thesis",
        "Thesis",
        "The figures of Özkul 2012, drawn from this run, beside what was published. Its A-B test of animations "
        "(table 7.1) needs people to ask and is not repeated here. On a scale from −2 to 2, its 35 subjects put the "
        "original 0.43 before the synthesis and 1.06 before random gestures, and the synthesis 0.54 "
        "before random gestures.",
        ("fig-7.2a", "fig-7.2b", "fig-7.3", "fig-7.4", "fig-7.5", "fig-6.3"),
    ),
    ("corpus", "The corpus", "Corpus", "", ("table-3-scenarios", "table-4.1", "fig-4.3")),
    (
        "planted",
        "What was planted",
        "Planted",
        "On the virtual studio the truth is known, so each step can be held against it.",
        ("fig-recovery",),
    ),
)
"""The sections: anchor, title, title in short, text, exhibits. What a run lacks is left out, an empty section too."""


def sections(exhibits: dict[str, Exhibit]) -> list[Section]:
    """Return the sections of the page that have an exhibit."""
    found = []
    for anchor, title, short, text, names in LAYOUT:
        own = [exhibits[name] for name in names if name in exhibits]
        if own:
            found.append(Section(anchor, title, short, text, own))
    return found


def exhibit(name: str, caption: Caption, svg: str | None, numbers: pd.DataFrame | None, pairs: list[Pair]) -> Exhibit:
    """Return one exhibit from its files: the text of its picture, its numbers as they were written."""
    label = re.sub(r"<[^>]+>", "", caption.title)
    picture = None if svg is None else inline_svg(svg, name, label)
    as_table = {
        "table-3-scenarios": scenario_table,
        "table-4.1": class_table,
        "fig-recovery": recovery_table,
        "table-capture": capture_table,
        "table-observability": observability_table,
    }.get(name)
    table = as_table(numbers) if as_table is not None and numbers is not None else None
    return Exhibit(name, caption, picture, table, pairs)


def inline_svg(text: str, name: str, label: str) -> str:
    """Return an SVG file as an element of the page: its colours follow the theme, its ids are its own.

    Parameters
    ----------
    text : the file.
    name : of the exhibit; prefix of the ids.
    label : what a screen reader says.
    """
    body = text[text.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'href="#', f'href="#{name}-', body)
    body = body.replace("url(#", f"url(#{name}-")
    for colour, variable in THEMED.items():
        body = body.replace(colour, variable)
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    return f'{head} role="img" aria-label="{label}">{rest}'


def scenario_table(table: pd.DataFrame) -> Table:
    """Return the scenarios for the page."""
    rows = [
        [
            row["task"],
            row["records"],
            row["participants"],
            f"{row['minutes']:.1f}",
            f"{row['shortest_s']:.0f}–{row['longest_s']:.0f}",
            _given(row["language"]),
        ]
        for _, row in table.iterrows()
    ]
    return Table(["scenario", "records", "participants", "minutes", "length (s)", "language"], _text(rows), (5,))


def class_table(table: pd.DataFrame) -> Table:
    """Return the gesture classes for the page."""
    actors = [name for name in table.columns if name.startswith("phrases_")]
    rows = [
        [
            f"{_given(row['class'])} {row['gesture']}".strip(),
            _given(row["details"]),
            row["phrases"],
            *(row[actor] for actor in actors),
            number(row["mean_s"]),
            number(row["longest_s"]),
            f"{row['share_of_time_pct']:.1f}",
        ]
        for _, row in table.iterrows()
    ]
    heads = ["gesture", "what happens", "phrases", *(f"of {name.removeprefix('phrases_')}" for name in actors)]
    return Table([*heads, "mean (s)", "longest (s)", "% of time"], _text(rows), (1,))


def recovery_table(table: pd.DataFrame) -> Table:
    """Return the summary of what was found of the studio's plan for the page."""
    rows = [
        [
            row["meaning"],
            _given(row["on"]),
            number(row["mean"]),
            f"{number(row['lowest'])} to {number(row['highest'])}",
            row["values"],
        ]
        for _, row in table.iterrows()
    ]
    return Table(["quantity", "on", "mean", "range", "values"], _text(rows), (1,))


VERDICTS = {"True": "met", "False": "missed"}


def capture_table(table: pd.DataFrame) -> Table:
    """Return what capture found beside its goals for the page; what has no unit is counted."""
    rows = []
    for _, row in table.iterrows():
        unit = _given(row["unit"])
        mean, lowest, highest = (
            number(row[name]) if unit else f"{row[name]:g}" for name in ("mean", "lowest", "highest")
        )
        rows.append(
            [
                row["meaning"],
                _given(row["method"]),
                f"{mean}\N{NO-BREAK SPACE}{unit}",
                "" if row["values"] == 1 else f"{lowest} to {highest}",
                "" if pd.isna(row["goal"]) else f"{row['goal']:g}\N{NO-BREAK SPACE}{unit}",
                "" if pd.isna(row["goal"]) else VERDICTS.get(str(row["met"]), "may be chance"),
            ]
        )
    return Table(["error", "method", "mean", "over records", "goal", ""], _text(rows), (1, 5))


def observability_table(table: pd.DataFrame) -> Table:
    """Return in which share of the frames each angle of a joint was told, for the page, one row a joint."""
    written = {
        "measured": "{:.1f}\N{NO-BREAK SPACE}%",
        "flexion_dependent": "{:.1f}\N{NO-BREAK SPACE}%, elbow bent",
        "locked": "locked",
    }
    rows = []
    for part, own in table.groupby("part", sort=False):
        cells = [written[state].format(100 * share) for state, share in zip(own["state"], own["share"], strict=True)]
        rows.append([part, *cells, own["reason"].iloc[0]])
    return Table(["joint", "x", "y", "z", "why"], _text(rows), (1, 2, 3, 4))


def _given(value: Any) -> Any:
    return "" if pd.isna(value) else value


def _text(rows: list[list[Any]]) -> list[list[str]]:
    return [[str(cell) for cell in row] for row in rows]


class Cell(NamedTuple):
    """One score of the leaderboard: value, interval, and how many values were undefined."""

    value: str
    interval: str
    note: str


class Row(NamedTuple):
    """One system of the leaderboard."""

    title: str
    role: str
    cells: list[Cell]


def leaderboard(board: pd.DataFrame, systems: Systems, part: str) -> tuple[list[str], list[Row]]:
    """Return headings and rows of the leaderboard over all actors.

    Parameters
    ----------
    board : the leaderboard's table.
    part : whole or interior.
    """
    pooled = board[(board["actor"] == "all") & (board["part"] == part)]
    heads = columns(pooled)
    rows = []
    for line in lines(systems):
        own = pooled[pooled["system"] == line.name]
        found = [_cell(cells(own, measure, bin_s)) for measure, bin_s in heads]
        rows.append(Row(line.title, line.role, found))
    return [words.measure(measure, bin_s) for measure, bin_s in heads], rows


def _cell(own: pd.DataFrame) -> Cell:
    if len(own) == 0:
        return Cell("–", "", "")
    row = own.iloc[0]
    interval = "" if pd.isna(row["low"]) else f"{number(row['low'])} to {number(row['high'])}"
    undefined = int(row["n_undefined"])
    return Cell(
        number(row["value"]), interval, f"{undefined} of {undefined + int(row['n'])} undefined" if undefined else ""
    )


def render(template: str | Path, **content: Any) -> str:
    """Return a page.

    Parameters
    ----------
    template : file of the template; what it includes lies beside it.
    content : what it names: title, banner, findings, sections, videos, board, facts, absent, downloads and others.
    """
    path = Path(template)
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(path.parent), autoescape=True,
                                     undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True)  # fmt: skip
    return environment.get_template(path.name).render(words=words, **content)
