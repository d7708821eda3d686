"""One actor's model driven by another actor's voice (Özkul 2012, chapter 8; Sargin 2006, 4.4.3)."""

from __future__ import annotations

import pandas as pd

from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.page.tables import Table
from cospeech.report.words import number


def draw(run: Run, transplant: pd.DataFrame) -> Drawing:
    """Return the phrases that both models make of each voice, with the title of the system.

    Parameters
    ----------
    transplant : the table ``transplant``.
    """
    return Drawing(transplant.assign(title=transplant["system"].map(run.titles)))


def heads(run: Run, transplant: pd.DataFrame) -> Drawing:
    """Return how the heads move that both models make of each voice, and the recorded ones, with the system's title.

    Parameters
    ----------
    transplant : the table ``head_transplant``.
    """
    return Drawing(transplant.assign(title=transplant["system"].map(lambda name: run.heads[name].title)))


SOURCES = {
    "voice_recorded": "recorded with this voice",
    "own_model": "own model",
    "transplant": "transplant",
    "model_recorded": "recorded",
}
"""What a head comes from, as the report calls it."""


def head_table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the table of heads for the page."""
    rows = [
        [
            "" if row["source"] == "model_recorded" else f"{row['record']} ({row['voice_actor']})",
            f"{row['model_actor']}, {SOURCES[row['source']]}",
            *(number(row[name]) for name in ("speed_deg_s", "spread_deg", "patterns_per_minute", "pattern_distance")),
            "" if pd.isna(row["melody_ami"]) else number(row["melody_ami"]),
        ]
        for _index, row in numbers.iterrows()
    ]
    headings = [
        "voice", "head", "mean speed, °/s", "spread, °", "patterns per minute", "distance of pattern shares",
        "agreement of melody patterns",
    ]  # fmt: skip
    return Table.of(headings, rows, (1,))


def table(_: Run, numbers: pd.DataFrame) -> Table:
    """Return the table for the page: below each record's own model, the models of other actors."""
    rows = [
        [
            f"{row['record']} ({row['voice_actor']})",
            f"{row['model_actor']}, {'own model' if row['source'] == 'own_model' else 'transplant'}",
            row["title"],
            row["n_phrases"],
            f"{row['phrases_per_minute']:.1f}",
            number(row["mean_phrase_s"]),
            f"{100 * row['share_rest']:.0f}",
            "" if pd.isna(row["kappa"]) else number(row["kappa"]),
        ]
        for _index, row in numbers.iterrows()
    ]
    heads = [
        "voice",
        "model",
        "system",
        "phrases",
        "per minute",
        "mean (s)",
        "at rest (%)",
        "kappa with the own model",
    ]
    return Table.of(heads, rows, (1, 2))
