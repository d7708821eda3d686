"""Fingerprints of calibration films, so that a stale calibration is never used with a different take."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

from cospeech.errors import UserError


def of(path: str | Path) -> str:
    """Return the SHA-256 of a file, read in blocks.

    Raises
    ------
    UserError : if the file does not exist.
    """
    try:
        with Path(path).open("rb") as film:
            return hashlib.file_digest(film, "sha256").hexdigest()
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; every camera of the rig needs one") from error


def of_take(names: Sequence[str], take: Sequence[str | Path]) -> dict[str, str]:
    """Return the fingerprint of the file that each camera was calibrated from.

    Parameters
    ----------
    names : names of the cameras.
    take : one film per camera, named after the camera; or a single camera file for the whole rig.
    """
    if len(take) == 1:
        return dict.fromkeys(names, of(take[0]))
    return {Path(path).stem: of(path) for path in take}


def check(recorded: Mapping[str, str], take: Sequence[str | Path]) -> None:
    """Compare the calibration take on disk with the fingerprints recorded for each camera.

    Raises
    ------
    UserError : if the film of a camera is missing, new or different.
    """
    present = of_take(list(recorded), take)
    where = Path(take[0]).parent if len(take) > 1 else take[0]
    for camera in sorted({*recorded, *present}):
        if recorded.get(camera) != present.get(camera):
            raise UserError(
                f"{where}: the cameras were calibrated from another take (camera {camera} differs); delete "
                "capture/cameras.parquet and run again"
            )
