"""Exhibits: every figure and table of the report, declared once (see README.md in this folder).

A declaration drives the rule that draws the exhibit, the page and the lists of files. Importing this package loads
neither pandas nor matplotlib.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cospeech.report.exhibits.catalogue import (
    CONDITIONS,
    DIRECTIONS,
    EXHIBITS,
    IDENTITY,
    IDENTITY_CONDITIONS,
    SECTIONS,
    SOURCES,
)
from cospeech.report.exhibits.declaration import Absent, Condition, Exhibit, Names, modules, setting

__all__ = [
    "CONDITIONS",
    "DIRECTIONS",
    "EXHIBITS",
    "IDENTITY",
    "IDENTITY_CONDITIONS",
    "SECTIONS",
    "SOURCES",
    "Absent",
    "Exhibit",
    "Names",
    "absent",
    "modules",
    "of_run",
    "setting",
    "sources",
]


def of_run(met: Iterable[str], among: Sequence[Exhibit] = EXHIBITS) -> list[Exhibit]:
    """Return the exhibits of a run that meets some conditions, in the order of the page."""
    known = set(met)
    return [exhibit for exhibit in among if known.issuperset(exhibit.needs)]


def absent(
    met: Iterable[str], among: Sequence[Exhibit] = EXHIBITS, conditions: Sequence[Condition] = CONDITIONS
) -> list[Absent]:
    """Return what such a run does not show: for each condition that it fails, why and which exhibits."""
    known = set(met)
    found = []
    for condition in conditions:
        if condition.name not in known:
            # An exhibit that misses several conditions is named once, with the first of them.
            lacking = [
                exhibit for exhibit in among if [n for n in exhibit.needs if n not in known][:1] == [condition.name]
            ]
            found.append(
                Absent(
                    condition.absent, [exhibit.name for exhibit in lacking] + [condition.also] * bool(condition.also)
                )
            )
    return [entry for entry in found if entry.names]


def sources(exhibits: Iterable[Exhibit], names: Names) -> dict[str, list[str]]:
    """Return the files that some exhibits are made from, below the run's results, by the name of their source."""
    used = dict.fromkeys(name for exhibit in exhibits for name in exhibit.sources.values())
    return {name: SOURCES[name].paths(names) for name in used}
