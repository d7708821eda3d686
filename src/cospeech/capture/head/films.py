"""The films of a face and their cameras: a stereo pair with its calibration, or one film with a focal length."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cospeech.capture.head import optics
from cospeech.capture.tracking import footage
from cospeech.capture.tracking.footage import Film
from cospeech.errors import UserError
from cospeech.formats import camera_toml
from cospeech.geometry.camera import Camera

LEAST_FOCAL, MOST_FOCAL = 0.3, 20.0
"""Range of plausible focal lengths, relative to the longer side of the image."""

LONGER_SIDE_35MM = 34.6
"""Longer side in mm of an image of 4:3, the shape of sensors in phones, whose diagonal is the 43.3 mm of 35 mm film.

A 35 mm equivalent focal length refers to the diagonal of the sensor (CIPA DCG-001), and a film shows its full width.
"""


def probed(paths: Sequence[str]) -> list[Film]:
    """Return the properties of the films of a head, one or two.

    Raises
    ------
    UserError : if there are more, or see ``footage.probe``.
    """
    if len(paths) not in (1, 2):
        raise UserError(f"{paths[0]}: {len(paths)} films of a head; give the two of a stereo pair, or one")
    return [footage.probe(path) for path in paths]


def cameras(
    films: Sequence[str], calibration: str | None, focal_px: float | None = None, focal_35mm: float | None = None
) -> list[Camera]:
    """Return the cameras of the films of a head, in the order of the films.

    Cameras belong to the films that are named after them. The two films of a pair may have other names, the left one
    first: then they belong to the left and the right camera, seen from behind them.

    Parameters
    ----------
    films : the film of a single camera, or those of a pair.
    calibration : camera file, TOML of Pose2Sim or caliscope. None for a single film whose focal length is declared.
    focal_px, focal_35mm : focal length of a single film without a calibration, in pixels of the film, or as 35 mm
        equivalent in mm; the other one is None.

    Raises
    ------
    UserError : if the cameras do not match the films, or nothing is known of them.
    """
    if calibration is None:
        if len(films) > 1:
            raise UserError(f"{films[0]}: the films of a stereo pair need a calibration; name a camera file")
        return [camera_of_focal_length(films[0], focal_px, focal_35mm)]
    known = camera_toml.read(calibration)
    by_name = {one.name: one for one in known}
    if all(Path(film).stem in by_name for film in films):
        return [by_name[Path(film).stem] for film in films]
    if len(known) != len(films):
        raise UserError(
            f"{calibration}: {len(known)} cameras for {len(films)} film{'s' * (len(films) > 1)}; name each film "
            f"after its camera ({', '.join(by_name)})"
        )
    left = optics.rectified(known)[1] if len(known) == 2 else 0
    return [known[left], *known[:left], *known[left + 1 :]]


def camera_of_focal_length(film: str, focal_px: float | None, focal_35mm: float | None) -> Camera:
    """Return the camera of a single film whose focal length is declared; its principal point is the middle.

    Raises
    ------
    UserError : if the focal length is missing or impossible for the size of the film.
    """
    width, height = footage.probe(film).size_px
    longer_px = max(width, height)
    if focal_px is not None:
        said = f"focal_px: {focal_px:g}"
        hint = "give it in pixels of this film (focal length in mm times image width / sensor width)"
    elif focal_35mm is not None:
        focal_px = focal_35mm / LONGER_SIDE_35MM * longer_px
        said = f"focal_35mm: {focal_35mm:g}"
        hint = "give the 35 mm equivalent in mm (24 to 28 for a phone), not the focal length of the lens itself"
    else:
        raise UserError(
            f"{film}: a single film needs the focal length of its camera; declare focal_35mm (35 mm equivalent, mm) "
            "or focal_px (pixels of the film), or name a calibration"
        )
    if not LEAST_FOCAL <= focal_px / longer_px <= MOST_FOCAL:
        raise UserError(f"{film}: {said} is impossible for images of {width} x {height} pixels; {hint}")
    return Camera(Path(film).stem, (width, height), (focal_px, focal_px), ((width - 1) / 2, (height - 1) / 2))
