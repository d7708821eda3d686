"""What the page of a run says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from cospeech.report.exhibits.run import Run
from cospeech.report.page import notes, provenance, sections
from cospeech.report.page.findings import Finding, findings
from cospeech.report.page.sections import Shown
from cospeech.report.scores import at_main

Config = dict[str, Any]


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
        "config": config,
        "banner": provenance.banner(config, tables["records"], tables.get("annotations"), tables.get("cameras")),
        "findings": _findings(run, config, tables, {one.exhibit.name: one.numbers for one in shown}),
        "parts": sections.parts(shown),
        "notes": notes.grouped(tables["records"]),
        "facts": provenance.facts(config, tables["records"], tables.get("motion_statistics")),
        "links": {one.exhibit.name: one.exhibit.files for one in shown},
    }


def _findings(
    run: Run, config: Config, tables: Mapping[str, pd.DataFrame], numbers: Mapping[str, pd.DataFrame | None]
) -> list[Finding]:
    """Return what the run found about gesture phrases and about heads, as far as it has them."""
    found = []
    if run.systems:
        found += findings(
            at_main(tables["session_scores"], run.systems),
            tables["differences"],
            run.systems,
            best_published_s=run.published["fig-7.2a"]["best_S"],
            level=config["evaluation"]["bootstrap"]["level"],
            recovery=numbers.get("fig-recovery"),
            motion=numbers.get("fig-motion"),
            capture=numbers.get("table-capture"),
            worlds=numbers.get("worlds"),
        )
    return found
