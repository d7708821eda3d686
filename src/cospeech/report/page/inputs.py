"""What every page is made from: tables of the run, and the exhibits as they were drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from cospeech.report.exhibits import drawing
from cospeech.report.exhibits.run import Run
from cospeech.report.page import sections
from cospeech.report.page.sections import Shown
from cospeech.workflow.job import Job


class Inputs(NamedTuple):
    """The run, its tables by the name of their source (see ``drawing.read``), and its exhibits."""

    run: Run
    tables: dict[str, Any]
    shown: list[Shown]


def read(work: Job) -> Inputs:
    """Return what a job that makes a page is given: exhibits and sources by its parameters, captions by its files."""
    run = Run.of(work.params, work.input.published)
    tables = {name: drawing.read(work, name, run) for name in work.params["sources"]}
    files, captions = (
        {Path(path).name: path for path in paths} for paths in (work.input.exhibits, work.input.captions)
    )
    return Inputs(run, tables, sections.show(run, drawing.named(work.params["exhibits"]), files, captions))
