"""What the page of a run says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from cospeech.report.exhibits.run import Run
from cospeech.report.page import notes, provenance, sections
from cospeech.report.page.findings import findings, headline
from cospeech.report.page.sections import Shown
from cospeech.report.scores import at_main

Config = dict[str, Any]


LEAD = (
    "Which gestures go with which melody of speech? A system learns this from recordings of a person and then invents "
    "gestures for a recording that it has not heard before. This page shows how well that works."
)

DOCUMENT = (
    "Serkan Özkul", "Speech Driven Upper Body Gesture Analysis and Synthesis",
    "master's thesis, Koç University, September 2012",
)  # fmt: skip
"""Author, title and kind of the document whose published values the page shows."""


class Failure(NamedTuple):
    """A system that failed, and why."""

    system: str
    message: str


def failures(decodings: Mapping[str, pd.DataFrame]) -> list[Failure]:
    """Return the systems that failed on some records, with the first reason of each.

    Parameters
    ----------
    decodings : the tables ``decoding`` of systems that may fail, by name.
    """
    found = []
    for name, table in decodings.items():
        reasons = table["failure"].dropna()
        if len(reasons):
            found.append(Failure(name, f"{reasons.iloc[0]} ({len(reasons)} of {len(table)} records)"))
    return found


def content(run: Run, config: Config, tables: Mapping[str, pd.DataFrame], shown: Sequence[Shown]) -> dict[str, Any]:
    """Return what the template of the page uses, apart from its videos and what the run lacks.

    Parameters
    ----------
    run : the run.
    config : its configuration.
    tables : sources by name: records, annotations, session_scores, differences; and motion_statistics, cameras and
        decoding where the run has them.
    shown : the exhibits.
    """
    numbers = {one.exhibit.name: one.numbers for one in shown}
    compared = at_main(tables["session_scores"], run.systems), tables["differences"], run.systems
    level = config["evaluation"]["bootstrap"]["level"]
    found = findings(
        *compared,
        best_published_s=run.published["fig-7.2a"]["best_S"],
        level=level,
        recovery=numbers.get("fig-recovery"),
        motion=numbers.get("fig-motion"),
        capture=numbers.get("table-capture"),
        worlds=numbers.get("worlds"),
    )
    return {
        "run": run,
        "lead": LEAD,
        "document": DOCUMENT,
        "config": config,
        "banner": provenance.banner(config, tables["records"], tables["annotations"], tables.get("cameras")),
        "headline": headline(*compared, level),
        "findings": found,
        "parts": sections.parts(shown),
        "notes": notes.grouped(tables["records"]),
        "facts": provenance.facts(config, tables["records"], tables.get("motion_statistics")),
        "links": {one.exhibit.name: one.exhibit.files for one in shown},
    }
