"""Pages from their templates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2

from cospeech.report import words
from cospeech.report.page import videos
from cospeech.report.page.videos import Clip

MOST_BYTES = 25_000_000
"""The largest page; videos for which there is no room are linked."""


def render(template: str | Path, **content: Any) -> str:
    """Return a page.

    Parameters
    ----------
    template : file of the template; the templates that it includes are in the same folder.
    content : what the template uses.
    """
    path = Path(template)
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(path.parent), autoescape=True,
                                     undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True)  # fmt: skip
    return environment.get_template(path.name).render(words=words, **content)


def render_with_videos(template: str | Path, content: dict[str, Any], clips: Sequence[Clip]) -> str:
    """Return a page with as many videos as fit into it."""
    free = MOST_BYTES - len(render(template, videos=[], **content).encode())
    return render(template, videos=videos.embed(clips, free), **content)
