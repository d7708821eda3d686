"""The page of the viewer, and its parts for other pages."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2

from cospeech.data import vocabulary
from cospeech.viewer import surface
from cospeech.viewer.takes import Take, packed

FOLDER = Path(__file__).parent


def script_data(data: Any) -> str:
    """Return data as JSON that can stand in a script element."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def stage(labels: Sequence[str] = ()) -> dict[str, Any]:
    """Return what all takes share: the surface of the standard body, and the colours of gesture classes."""
    return {"surface": surface.packed(), "colours": {label: vocabulary.gesture_colour(label) for label in labels}}


def page(title: str, takes: Sequence[Take]) -> str:
    """Return a page that shows takes, which contains everything it needs.

    Raises
    ------
    UserError : if a take cannot be shown (see ``takes.packed``).
    """
    labels = {
        label
        for take in takes
        for version in take.versions
        if version.phrases is not None
        for label in version.phrases["label"]
    }
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("page.html.jinja").render(
        title=title,
        parts=parts(),
        stage=script_data(stage(sorted(labels))),
        takes=[script_data(packed(take)) for take in takes],
    )


def parts() -> dict[str, str]:
    """Return the style and the scripts of the viewer by name: style, three, viewer."""
    files = {"style": "viewer.css", "three": "vendor/three.js", "viewer": "viewer.js"}
    return {name: (FOLDER / file).read_text(encoding="utf-8") for name, file in files.items()}
