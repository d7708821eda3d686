"""The films of a face and their cameras: a stereo pair with its calibration, or one film with a focal length."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from cospeech.capture.tracking import footage
from cospeech.capture.tracking.footage import Film
from cospeech.errors import UserError
from cospeech.formats import camera_toml
from cospeech.geometry import camera as cameras
from cospeech.geometry.camera import Camera

LEAST_FOCAL, MOST_FOCAL = 0.3, 20.0
"""Range of plausible focal lengths in image widths."""


def probed(paths: Sequence[str]) -> list[Film]:
    """Return the properties of the films of a head, one or two.

    Raises
    ------
    UserError : if there are more, or see ``footage.probe``.
    """
    if len(paths) not in (1, 2):
        raise UserError(f"{paths[0]}: {len(paths)} films of a head; give the two of a stereo pair, or one")
    return [footage.probe(path) for path in paths]


def cameras_of_file(path: str, films: Sequence[str]) -> list[Camera]:
    """Return the cameras of films, in their order, from a TOML file of Pose2Sim or caliscope.

    Each film has the name of its camera; a single film may have any name if there is one camera.
    """
    return _matched(camera_toml.read(path), films, path)


def cameras_of_table(table: pd.DataFrame, films: Sequence[str]) -> list[Camera]:
    """Return the cameras of films, in their order, from a table ``cameras``."""
    return _matched(cameras.from_table(table), films, "calibration")


def _matched(known: Sequence[Camera], films: Sequence[str], where: str) -> list[Camera]:
    if len(known) == len(films) == 1:
        return list(known)
    by_name = {one.name: one for one in known}
    for film in films:
        if Path(film).stem not in by_name:
            raise UserError(
                f"{where}: no camera called '{Path(film).stem}' for the film {film}; cameras are "
                f"{', '.join(by_name)}; name each film after its camera"
            )
    return [by_name[Path(film).stem] for film in films]


def camera_of_focal_length(film: str, focal_px: float | None) -> Camera:
    """Return the camera of a single film whose focal length is declared; its principal point is the middle.

    Raises
    ------
    UserError : if the focal length is missing or impossible for the size of the film.
    """
    width, height = footage.probe(film).size_px
    if focal_px is None:
        raise UserError(
            f"{film}: a single film needs the focal length of its camera; declare capture.head.focal_px in pixels "
            f"(a webcam has about {width}), or name a calibration"
        )
    if not LEAST_FOCAL <= focal_px / width <= MOST_FOCAL:
        raise UserError(
            f"{film}: capture.head.focal_px: {focal_px:g} is impossible for images {width} pixels wide; give it in "
            "pixels of this film (focal length in mm times image width / sensor width)"
        )
    return Camera(Path(film).stem, (width, height), (focal_px, focal_px), ((width - 1) / 2, (height - 1) / 2))
