"""The content of films in a few letters, so that a calibration is never used with a take it was not made from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

from cospeech.errors import UserError


def of(path: str | Path) -> str:
    """Return the SHA-256 of a file's bytes, read piece by piece.

    Raises
    ------
    UserError : where there is no such file.
    """
    try:
        with Path(path).open("rb") as film:
            return hashlib.file_digest(film, "sha256").hexdigest()
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; every camera of the rig must have one") from error


def of_take(names: Sequence[str], take: Sequence[str | Path]) -> dict[str, str]:
    """Return the fingerprint of what each camera was calibrated from.

    Parameters
    ----------
    names : of the cameras.
    take : a film for each camera, named like it; or the one file that gives them all.
    """
    if len(take) == 1:
        return dict.fromkeys(names, of(take[0]))
    return {Path(path).stem: of(path) for path in take}


def check(recorded: Mapping[str, str], take: Sequence[str | Path]) -> None:
    """Hold the calibration take as it lies there against the fingerprints, by camera, that the rig was written with.

    Raises
    ------
    UserError : where a camera's film is missing, new or another one.
    """
    lying = of_take(list(recorded), take)
    where = Path(take[0]).parent if len(take) > 1 else take[0]
    for camera in sorted({*recorded, *lying}):
        if recorded.get(camera) != lying.get(camera):
            raise UserError(
                f"{where}: the cameras were calibrated from another take (camera {camera} differs); delete "
                "capture/cameras.parquet and run again"
            )
