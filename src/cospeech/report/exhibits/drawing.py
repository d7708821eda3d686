"""One job that draws many exhibits: starting a process takes longer than drawing an exhibit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from cospeech.report import output, style
from cospeech.report.exhibits import DIRECTIONS, EXHIBITS, IDENTITY, SOURCES, pictures
from cospeech.report.exhibits.declaration import Exhibit, load
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.workflow.job import Job


def draw_all(work: Job) -> None:
    """Draw the exhibits that a job names in its parameters, reading each source once."""
    run = Run.of(work.params, work.input.published)
    files = {Path(path).name: path for path in work.output}
    tables: dict[str, Any] = {}
    for exhibit in named(work.params["exhibits"]):
        for name in exhibit.sources.values():
            if name not in tables:
                tables[name] = read(work, name, run)
        arguments = {argument: tables[name] for argument, name in exhibit.sources.items()}
        settings = {argument: work.params["settings"][path] for argument, path in exhibit.settings.items()}
        save(exhibit, load(exhibit.draw)(run, **arguments, **settings), files)


def named(names: Iterable[str]) -> list[Exhibit]:
    """Return the exhibits with these names."""
    known = {exhibit.name: exhibit for exhibit in (*EXHIBITS, *IDENTITY, *DIRECTIONS)}
    return [known[name] for name in names]


def read(work: Job, name: str, run: Run) -> Any:
    """Read one source of a job, whose files its parameter ``sources`` lists by name.

    Returns
    -------
    The bytes of a picture; or a table, its files one below the other; or such a table for each system, by name, where
    the files are those of several systems. A system with an empty file has failed, and is left out.
    """
    source, paths = SOURCES[name], list(work.params["sources"][name])
    if source.schema is None:
        return pictures.checked(Path(paths[0]).read_bytes(), paths[0])
    groups = {
        "pictured": run.pictured,
        "in_timeline": run.in_timeline,
        "third_party": run.third_party,
        "shown_head": run.shown_heads,
    }
    systems = groups.get(next(iter(source.placeholders), ""), [])
    if not systems:
        return work.read(paths, source.schema)
    each = len(paths) // len(systems)  # the files come system by system
    found = {
        system: [work.read(path, source.schema) for path in paths[place * each : (place + 1) * each]]
        for place, system in enumerate(systems)
    }
    complete = {system: tables for system, tables in found.items() if all(len(table) for table in tables)}
    return {system: pd.concat(tables, ignore_index=True) for system, tables in complete.items()}


def save(exhibit: Exhibit, drawn: Drawing, files: Mapping[str, str]) -> None:
    """Write the files of an exhibit; ``files`` are their paths by name."""
    if drawn.figure is not None:
        style.save(drawn.figure, files[f"{exhibit.name}.svg"], files[f"{exhibit.name}.png"])
    if drawn.picture is not None:
        output.save_bytes(pictures.as_svg(drawn.picture).encode(), files[f"{exhibit.name}.svg"])
        output.save_bytes(drawn.picture, files[f"{exhibit.name}.png"])
    if drawn.numbers is not None:
        output.save_table(drawn.numbers, files[f"{exhibit.name}.csv"])
