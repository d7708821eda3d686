"""The content of films in a few letters, so that a calibration is never used with footage it does not belong to."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from cospeech.errors import UserError


def of(path: str | Path) -> str:
    """Return the SHA-256 of a film's bytes, read piece by piece.

    Raises
    ------
    UserError : where there is no such film.
    """
    try:
        with Path(path).open("rb") as film:
            return hashlib.file_digest(film, "sha256").hexdigest()
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such film; every camera of the rig must have one") from error


def check(recorded: Mapping[str, str], films: Mapping[str, str | Path]) -> None:
    """Hold the films of the calibration take, by camera, against the fingerprints that the calibration recorded.

    Raises
    ------
    UserError : where a camera has no fingerprint or no film, or the film is another one.
    """
    for camera in sorted({*recorded, *films}):
        if camera not in films:
            raise UserError(f"calibration: was made with camera {camera}, which has no film here; calibrate this rig")
        if camera not in recorded:
            raise UserError(f"{films[camera]}: the calibration knows no camera {camera}; calibrate this rig")
        if of(films[camera]) != recorded[camera]:
            raise UserError(f"{films[camera]}: the calibration belongs to other footage; calibrate with this film")
