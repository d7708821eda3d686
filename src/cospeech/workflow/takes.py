"""What is to be captured: the films or marker files of each take, and the films of the calibration."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from cospeech.errors import MissingFileError, UserError
from cospeech.workflow import paths

MARKER_FILES = (".c3d", ".trc")
"""Endings of files that hold markers in the world, where a record enters at the skeleton."""

FILMS = (".mkv", ".mp4", ".mov", ".m4v", ".avi", ".mts", ".m2ts", ".mpg", ".mpeg", ".mxf", ".webm", ".wmv")
"""Endings of films; what else lies in a folder of views is left alone."""

STUDIO_VIEWS = ("c1", "c2", "c3", "c4", "c5")
"""The studio's cameras."""


def is_marker_file(path: str | None) -> bool:
    """Return whether a file holds markers in the world, by its ending."""
    return path is not None and Path(path).suffix.lower() in MARKER_FILES


def takes(config: dict[str, Any], listed: dict[str, dict[str, Any]], results: str) -> dict[str, list[str]]:
    """Return what is to be captured: for each take its marker file, or its films, one of each camera.

    The takes are the records that come as markers or films, by name, and ``range~<actor>``, the range-of-motion take
    of each of their actors.

    Raises
    ------
    UserError : an actor without such a take, or a path where there is no marker file or folder of films.
    """
    given = {
        name: record["views"] or record["motion"]
        for name, record in listed.items()
        if record["views"] or is_marker_file(record["motion"])
    }
    virtual = config["corpus"]["source"] == "studio"
    for name, record in listed.items():
        if record["views"] and not virtual and not calibrates(config):
            raise UserError(
                f"config: record '{name}' comes as films, whose cameras must be known; name films or a file of their "
                "calibration in capture.calibration"
            )
    for actor in dict.fromkeys(listed[name]["actor"] for name in given):
        path = f"{results}/corpus/raw/range~{actor}" if virtual else config["capture"]["ranges"].get(actor)
        if path is None:
            raise UserError(
                f"config: records of actor '{actor}' come as markers or films, which a body model of the actor turns "
                f"into joint angles; name a range-of-motion take, marker file or folder, in capture.ranges.{actor}"
            )
        given[f"range~{actor}"] = path
    if virtual:
        return {take: [f"{path}/{view}.mkv" for view in STUDIO_VIEWS] for take, path in given.items()}
    found = {take: _marker_file(path) if is_marker_file(path) else films(path) for take, path in given.items()}
    _check_offsets(config["capture"]["offsets_s"], found)
    return found


def offsets_s(config: dict[str, Any], take: str) -> dict[str, float]:
    """Return how much later the views of a take began, where a person says so: under its name, or for every take."""
    given = config["capture"]["offsets_s"]
    of_all = {view: seconds for view, seconds in given.items() if not isinstance(seconds, dict)}
    own: dict[str, float] = given.get(take, {})
    return of_all | own


def films(folder: str) -> list[str]:
    """Return the films in a folder, each named as its camera, in the order of these names.

    Raises
    ------
    UserError : no such folder, no film in it, or two of one camera.
    """
    if not Path(folder).is_dir():
        raise MissingFileError(
            folder, f"config: {folder}: no such folder of films, and no marker file ({', '.join(MARKER_FILES)})"
        )
    found = sorted(path for path in Path(folder).glob("[!.]*") if path.suffix.lower() in FILMS)
    if not found:
        raise UserError(f"config: {folder}: no film lies there; known are {', '.join(FILMS)}")
    for name, count in Counter(path.stem for path in found).items():
        if count > 1:
            raise UserError(f"config: {folder}: two films are called '{name}'; leave one for each camera")
    return [paths.plain(str(path), "film") for path in found]


def check_paths(config: dict[str, Any]) -> None:
    """Raise UserError where the configuration of the capture names a file or folder that cannot be used."""
    capture = config["capture"]
    calibration = capture["calibration"]
    named = {f"capture.{key}": capture[key] for key in ("clicks", "corrections")}
    key = {"board": "board", "given": "file"}.get(calibration["method"])
    if key:
        named[f"capture.calibration.{key}"] = calibration[key]
    for what, path in named.items():
        if path:
            paths.existing(path, what)


def calibrates(config: dict[str, Any]) -> bool:
    """Return whether the configuration names a calibration of its own, in films or as a file."""
    calibration = config["capture"]["calibration"]
    return calibration["method"] == "given" or bool(calibration["films"])


def calibration_films(config: dict[str, Any]) -> dict[str, str]:
    """Return the films of a calibration take of one's own by camera, sorted; none where it is given or the studio's.

    Raises
    ------
    UserError : where the folder is missing or holds no films, or two of one camera.
    """
    calibration = config["capture"]["calibration"]
    if calibration["method"] == "given" or not calibration["films"]:
        return {}
    return {Path(path).stem: path for path in films(calibration["films"])}


def _marker_file(path: str) -> list[str]:
    if not Path(path).is_file():
        raise MissingFileError(path, f"config: no marker file {path}")
    return [paths.plain(path, "marker file")]


def _check_offsets(given: dict[str, Any], found: dict[str, list[str]]) -> None:
    """Raise UserError where an offset is that of no take, or of a view that the take does not have."""
    views = {take: [Path(path).stem for path in paths] for take, paths in found.items()}
    every = sorted({view for names in views.values() for view in names})
    for key, value in given.items():
        if isinstance(value, dict) and key not in views:
            raise UserError(f"config: capture.offsets_s: no take is called '{key}'; takes are {', '.join(views)}")
        known, asked = (views[key], list(value)) if isinstance(value, dict) else (every, [key])
        for view in asked:
            if view not in known:
                meant = [name for name in known if name.lstrip("0") == str(view)]
                hint = f"; write '{meant[0]}' in quotes" if meant else ""
                raise UserError(
                    f"config: capture.offsets_s: no view is called '{view}'; views are {', '.join(known)}{hint}"
                )
