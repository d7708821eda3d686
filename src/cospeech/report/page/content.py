"""What the page of a run says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from cospeech.report.exhibits.run import Run
from cospeech.report.page import notes, provenance, sections
from cospeech.report.page.findings import Finding, findings
from cospeech.report.page.head_findings import head_findings
from cospeech.report.page.headline import headline
from cospeech.report.page.sections import Shown
from cospeech.report.page.tables import Table
from cospeech.report.scores import at_main
from cospeech.report.systems import Systems

Config = dict[str, Any]

LEAD = (
    "Which gestures go with which melody of speech? A system learns this from recordings of a person and then "
    "invents gestures for a recording that it has not heard before. This page shows how well that works."
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
    tables : sources by name: records; and annotations, session_scores, differences, motion_statistics, cameras and
        decoding where the run has them.
    shown : the exhibits.
    """
    return {
        "run": run,
        "lead": LEAD,
        "document": DOCUMENT,
        "config": config,
        "banner": provenance.banner(config, tables["records"], tables.get("annotations"), tables.get("cameras")),
        "findings": _findings(run, config, tables, {one.exhibit.name: one.numbers for one in shown}),
        "headline": _headline(run, config, tables),
        "parts": sections.parts(shown),
        "notes": notes.grouped(tables["records"]),
        "facts": provenance.facts(
            config, tables["records"], tables.get("motion_statistics"), bool(run.systems), bool(run.heads)
        ),
        "links": {one.exhibit.name: one.exhibit.files for one in shown},
    }


def _compared(run: Run, tables: Mapping[str, pd.DataFrame]) -> tuple[pd.DataFrame, pd.DataFrame, Systems]:
    """Return scores at the main setting, differences, and systems of phrases and motion."""
    return at_main(tables["session_scores"], run.systems), tables["differences"], run.systems


def _headline(run: Run, config: Config, tables: Mapping[str, pd.DataFrame]) -> Table | None:
    level = config["evaluation"]["bootstrap"]["level"]
    return headline(*_compared(run, tables), level) if run.systems else None


def _captured(numbers: Mapping[str, pd.DataFrame | None]) -> pd.DataFrame | None:
    """Return the errors of capture and what filming changes, as far as the run has them."""
    own = [numbers.get(name) for name in ("table-capture", "table-film-effect")]
    given = [table for table in own if table is not None]
    return pd.concat(given, ignore_index=True) if given else None


def _findings(
    run: Run, config: Config, tables: Mapping[str, pd.DataFrame], numbers: Mapping[str, pd.DataFrame | None]
) -> list[Finding]:
    """Return what the run found about gesture phrases and about heads, as far as it has them."""
    level = config["evaluation"]["bootstrap"]["level"]
    found = []
    if run.systems:
        found += findings(
            *_compared(run, tables),
            best_published_s=run.published["fig-7.2a"]["best_S"],
            level=level,
            recovery=numbers.get("fig-recovery"),
            motion=numbers.get("fig-motion"),
            capture=_captured(numbers),
            worlds=numbers.get("worlds"),
        )
    if run.heads:
        found += head_findings(run, numbers.get("fig-head-differences"), numbers.get("table-head-capture"))
    return found
