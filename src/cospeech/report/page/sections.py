"""The exhibits of a run as the page shows them, section by section."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from cospeech.report.exhibits import SECTIONS
from cospeech.report.exhibits.declaration import Exhibit, Section, load
from cospeech.report.exhibits.run import Run
from cospeech.report.page import captions, svg
from cospeech.report.page.captions import Caption
from cospeech.report.page.tables import Pair


class Shown(NamedTuple):
    """One exhibit on the page: its declaration, caption, picture and numbers.

    ``content`` is what its template renders next to the picture, and ``published`` are published values next to ours.
    """

    exhibit: Exhibit
    caption: Caption
    picture: str | None
    numbers: pd.DataFrame | None
    content: Any
    published: list[Pair]


class Part(NamedTuple):
    """A section of the page and its exhibits."""

    section: Section
    exhibits: list[Shown]


def show(
    run: Run, exhibits: Iterable[Exhibit], files: Mapping[str, str], caption_files: Mapping[str, str]
) -> list[Shown]:
    """Return exhibits from their files.

    Parameters
    ----------
    run : the run.
    exhibits : what to show.
    files, caption_files : paths of the files of exhibits and of their captions, by file name.
    """
    return [_shown(run, exhibit, files, caption_files[f"{exhibit.name}.rst"]) for exhibit in exhibits]


def _shown(run: Run, exhibit: Exhibit, files: Mapping[str, str], caption_file: str) -> Shown:
    caption = captions.read(caption_file)
    picture, numbers, content = None, None, None
    pairs: list[Pair] = []
    if exhibit.figure:
        text = Path(files[f"{exhibit.name}.svg"]).read_text(encoding="utf-8")
        picture = svg.inline(text, exhibit.name, re.sub(r"<[^>]+>", "", caption.title))
    if exhibit.numbers:
        numbers = pd.read_csv(files[f"{exhibit.name}.csv"])
        content = load(exhibit.show)(run, numbers) if exhibit.show else None
        if exhibit.compare and exhibit.published:
            pairs = load(exhibit.compare)(run, numbers, run.published[exhibit.published])
    return Shown(exhibit, caption, picture, numbers, content, pairs)


def parts(shown: Iterable[Shown]) -> list[Part]:
    """Return the sections of the page that have an exhibit."""
    every = list(shown)
    found = [Part(section, [one for one in every if one.exhibit.section == section.anchor]) for section in SECTIONS]
    return [part for part in found if part.exhibits]
