"""Captions: written once in reStructuredText, for Snakemake's report and for the page."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import NamedTuple


class Caption(NamedTuple):
    """A caption as HTML: its heading, its text, and the tables that it names as its source."""

    title: str
    body: str
    source: str


def read(path: str) -> Caption:
    """Read one caption: a paragraph that opens with its **title**, others, and a last one ``From ...``.

    Only paragraphs, bold, italics and literals of reStructuredText are understood.
    """
    paragraphs = [" ".join(part.split()) for part in Path(path).read_text(encoding="utf-8").strip().split("\n\n")]
    first = re.fullmatch(r"\*\*(.+?)\*\*\s*(.*)", paragraphs[0])
    if first is None or not paragraphs[-1].startswith("From "):
        raise ValueError(f"{path}: a caption opens with its title in bold and ends with a paragraph 'From ...'")
    body = [first[2], *paragraphs[1:-1]]
    return Caption(
        title=inline(first[1]).rstrip(".,:"),
        body="".join(f"<p>{inline(text)}</p>" for text in body if text),
        source=inline(paragraphs[-1].removeprefix("From ").rstrip(".")),
    )


def inline(text: str) -> str:
    """Return one paragraph of reStructuredText as HTML."""
    return "".join(_span(span) for span in re.split(r"(``.+?``|\*\*.+?\*\*|\*[^*]+\*)", text))


def _span(text: str) -> str:
    for mark, tag in (("``", "code"), ("**", "strong"), ("*", "em")):
        if len(text) > 2 * len(mark) and text.startswith(mark) and text.endswith(mark):
            return f"<{tag}>{html.escape(text[len(mark) : -len(mark)], quote=False)}</{tag}>"
    return html.escape(text, quote=False)
