"""A calibration that was made elsewhere, or goes there: the TOML that Pose2Sim and caliscope share.

One table per camera with ``size``, ``matrix`` (3, 3), ``distortions`` (k1, k2, p1, p2 and k3 where there is one),
``rotation`` (Rodrigues vector or matrix) and ``translation``, world to camera, in metres. Pose2Sim puts the tables at
the top (``[cam_01]``), caliscope under ``[cameras.0]``.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cospeech.errors import UserError
from cospeech.geometry.camera import Camera
from cospeech.geometry.rotation import from_vectors, to_vectors

NEEDED = ("size", "matrix", "distortions", "rotation", "translation")

FROM_Z_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From a world with z up to one with y up, as Pose2Sim turns it: (x, y, z) becomes (y, z, x)."""


def read(path: str | Path, up: Literal["y", "z"] = "y") -> list[Camera]:
    """Return the cameras of a TOML file, in its order.

    Parameters
    ----------
    up : the axis of the file's world that points up; Pose2Sim's cameras live with z up, its points with y up.

    Raises
    ------
    UserError : where the file is missing or no TOML, or a camera is incomplete, contradictory or a fisheye.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"{path}: no such calibration; give the path of a TOML file of Pose2Sim or caliscope")
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: no TOML ({error}); give the calibration of Pose2Sim or caliscope") from error
    nested = raw.get("cameras")
    entries = {f"cam_{key}": value for key, value in nested.items()} if isinstance(nested, dict) else raw
    cameras = [
        _camera(f"{path}: camera {key}", str(value.get("name", key)), value, up)
        for key, value in entries.items()
        if isinstance(value, dict) and "matrix" in value
    ]
    if not cameras:
        raise UserError(f"{path}: holds no camera with a 'matrix'; give the calibration of Pose2Sim or caliscope")
    return cameras


def _camera(where: str, name: str, raw: dict[str, Any], up: str) -> Camera:
    for key in NEEDED:
        if key not in raw:
            raise UserError(f"{where}: '{key}' is missing; calibrate the camera, inside and out")
    if raw.get("fisheye"):
        raise UserError(f"{where}: is a fisheye, which has no place in this camera's model; undistort the film first")
    try:
        size, matrix, lens, turn, shift = (np.array(raw[key], dtype=float) for key in NEEDED)
    except (TypeError, ValueError) as error:
        raise UserError(f"{where}: holds what is no number; export the calibration again") from error
    shapes = (size.shape, matrix.shape, shift.shape) == ((2,), (3, 3), (3,))
    if not shapes or lens.shape not in ((4,), (5,)) or turn.shape not in ((3,), (3, 3)):
        raise UserError(f"{where}: a vector or matrix has the wrong size; export the calibration again")
    if not all(np.isfinite(part).all() for part in (size, matrix, lens, turn, shift)):
        raise UserError(f"{where}: holds infinite or missing numbers; export the calibration again")
    if min(size) < 1 or min(matrix[0, 0], matrix[1, 1]) <= 0:
        raise UserError(f"{where}: picture size and focal lengths must be above 0; export the calibration again")
    if turn.shape == (3, 3) and not np.allclose(turn @ turn.T, np.eye(3), atol=1e-4):
        raise UserError(f"{where}: 'rotation' is no rotation; export the calibration again")
    rotation = turn if turn.shape == (3, 3) else from_vectors(turn)
    if up == "z":
        rotation = rotation @ FROM_Z_UP.T
    vector = to_vectors(rotation)
    k1, k2, p1, p2, k3 = [*lens.tolist(), 0.0][:5]
    return Camera(
        name,
        (int(size[0]), int(size[1])),
        (float(matrix[0, 0]), float(matrix[1, 1])),
        (float(matrix[0, 2]), float(matrix[1, 2])),
        (k1, k2, p1, p2, k3),
        (float(vector[0]), float(vector[1]), float(vector[2])),
        (float(shift[0]), float(shift[1]), float(shift[2])),
    )


def toml(cameras: Sequence[Camera], up: Literal["y", "z"] = "y") -> str:
    """Return the cameras as the text of a TOML file: what ``read`` takes with the same ``up``, and Pose2Sim with z.

    The numbers are written in full. k3 is left out where it is zero, as Pose2Sim's own files have no place for it.
    """
    parts = []
    for camera in cameras:
        rotation = camera.rotation @ FROM_Z_UP if up == "z" else camera.rotation
        k3 = camera.lens[4]
        values = {
            "name": camera.name,
            "size": list(camera.size_px),
            "matrix": camera.intrinsic.tolist(),
            "distortions": list(camera.lens if k3 else camera.lens[:4]),
            "rotation": to_vectors(rotation).tolist(),
            "translation": list(camera.shift_m),
            "fisheye": False,
        }
        lines = [f"{key} = {json.dumps(value)}" for key, value in values.items()]
        parts.append("\n".join([f"[{json.dumps(camera.name)}]", *lines]))
    return "\n\n".join([*parts, "[metadata]\nadjusted = false\nerror = 0.0\n"])
