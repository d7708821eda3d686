"""The page of the viewer, and its parts for other pages."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from cospeech.data import vocabulary
from cospeech.formats.glb_mesh import Mesh
from cospeech.motion.body import Body
from cospeech.motion.library import Poses
from cospeech.viewer import surface
from cospeech.viewer.takes import Articulated, Take, Version, packed

FOLDER = Path(__file__).parent


def script_data(data: Any) -> str:
    """Return data as JSON that can stand in a script element."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def stage(labels: Sequence[str] = (), meshes: Sequence[Mesh] = ()) -> dict[str, Any]:
    """Return what all takes share: surfaces, that of the standard body first, and the colours of gesture classes."""
    return {
        "surfaces": [surface.packed(mesh) for mesh in (surface.standard(), *meshes)],
        "colours": {label: vocabulary.gesture_colour(label) for label in labels},
    }


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
    worn = {id(version.mesh): version.mesh for take in takes for version in take.versions if version.mesh is not None}
    meshes = list(worn.values())
    calls = [f"viewer.add({script_data(packed(take, meshes))});" for take in takes]
    return _rendered(title, stage(sorted(labels), meshes), calls)


def _rendered(title: str, shared: Mapping[str, Any], calls: Sequence[str]) -> str:
    """Return a page on which a viewer is mounted and called; ``shared`` is its ``stage``."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("page.html.jinja").render(
        title=title, parts=parts(), stage=script_data(shared), calls=calls
    )


def live_page(
    body: Body, fps: float, styles: Sequence[str], keywords: Sequence[str], socket: str, skinned: bool
) -> str:
    """Return a page that shows a body as its poses arrive at a websocket.

    Parameters
    ----------
    body, fps : the body, and the rate of its frames.
    styles, keywords : what can be chosen on the page.
    socket : path of the websocket.
    skinned : whether the body is drawn with the surface of the standard body.
    """
    still = Poses(np.zeros((1, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (1, len(body.joints), 1)))
    take = Take("Live", [Version("Live", Articulated(body, still), fps, skinned=skinned)])
    followed = {"socket": socket, "styles": list(styles), "keywords": list(keywords)}
    return _rendered("Live", stage(), [f"viewer.follow({script_data(packed(take))}, {script_data(followed)});"])


def take_script(source: str, take: Take) -> str:
    """Return the script that brings a take to a page; ``source`` is its address, relative to the page.

    Raises
    ------
    UserError : if the take cannot be shown (see ``takes.packed``).
    """
    return f"CospeechViewer.receive({script_data(source)}, {script_data(packed(take))});\n"


def embedded(
    scripts: Mapping[str, str], sources: Sequence[str], labels: Sequence[str], budget: int
) -> dict[str, Any]:
    """Return what a page needs to contain the viewer.

    Parameters
    ----------
    scripts : the script of each take (see ``take_script``) by title.
    sources : their addresses, relative to the page.
    labels : the gesture classes.
    budget : bytes that scripts in the page may take; the others are loaded from next to it when they are chosen.
    """
    inside: list[str] = []
    for script in scripts.values():
        if len(script) <= budget:
            inside.append(script)
            budget -= len(script)
    takes = [{"title": title, "source": source} for title, source in zip(scripts, sources, strict=True)]
    return {
        "parts": parts(),
        "stage": script_data(stage(labels)),
        "inside": inside,
        "takes": script_data(takes),
        "outside": len(scripts) - len(inside),
    }


def parts() -> dict[str, str]:
    """Return the style and the scripts of the viewer by name: style, three, viewer."""
    files = {"style": "viewer.css", "three": "vendor/three.js", "viewer": "viewer.js"}
    return {name: (FOLDER / file).read_text(encoding="utf-8") for name, file in files.items()}
