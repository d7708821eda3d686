"""Camera files in the TOML format of Pose2Sim and caliscope.

There is one table per camera with ``size``, ``matrix`` (3, 3), ``distortions`` (k1, k2, p1, p2, and k3 if there is
one), ``rotation`` (rotation vector or matrix) and ``translation``, from world to camera, in metres. The tables are at
the top level in Pose2Sim (``[cam_01]``) and in a table of all cameras in caliscope (``[cameras.0]``).
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
"""From a world with z up to one with y up, with the convention of Pose2Sim: (x, y, z) becomes (y, z, x)."""


def read(path: str | Path, up: Literal["y", "z"] = "y") -> list[Camera]:
    """Return the cameras of a TOML file in their order in the file.

    Parameters
    ----------
    up : the axis that points up in the world of the file. In Pose2Sim it is z for cameras and y for points.

    Raises
    ------
    UserError : if the file is missing or not TOML, or a camera is incomplete, invalid or a fisheye camera.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"{path}: no such file; give the path of a TOML file of Pose2Sim or caliscope")
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: not a TOML file ({error}); give a camera file of Pose2Sim or caliscope") from error
    nested = raw.get("cameras")
    entries = {f"cam_{key}": value for key, value in nested.items()} if isinstance(nested, dict) else raw
    cameras = [
        _camera(f"{path}: camera {key}", str(value.get("name", key)), value, up)
        for key, value in entries.items()
        if isinstance(value, dict) and "matrix" in value
    ]
    if not cameras:
        raise UserError(f"{path}: has no camera with a 'matrix'; give a camera file of Pose2Sim or caliscope")
    return cameras


def _camera(where: str, name: str, raw: dict[str, Any], up: str) -> Camera:
    for key in NEEDED:
        if key not in raw:
            raise UserError(f"{where}: '{key}' is missing; calibrate the camera's intrinsic and extrinsic parameters")
    if raw.get("fisheye"):
        raise UserError(f"{where}: fisheye lenses are not supported; undistort the video first")
    try:
        size, matrix, lens, turn, shift = (np.array(raw[key], dtype=float) for key in NEEDED)
    except (TypeError, ValueError) as error:
        raise UserError(f"{where}: holds something other than numbers; export the calibration again") from error
    shapes = (size.shape, matrix.shape, shift.shape) == ((2,), (3, 3), (3,))
    if not shapes or lens.shape not in ((4,), (5,)) or turn.shape not in ((3,), (3, 3)):
        raise UserError(f"{where}: a vector or matrix has the wrong size; export the calibration again")
    if not all(np.isfinite(part).all() for part in (size, matrix, lens, turn, shift)):
        raise UserError(f"{where}: holds infinite or missing numbers; export the calibration again")
    if min(size) < 1 or min(matrix[0, 0], matrix[1, 1]) <= 0:
        raise UserError(f"{where}: image size and focal lengths must be positive; export the calibration again")
    if turn.shape == (3, 3) and not np.allclose(turn @ turn.T, np.eye(3), atol=1e-4):
        raise UserError(f"{where}: 'rotation' is not a rotation; export the calibration again")
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
    """Return the cameras as the text of a TOML file, for ``read`` with the same ``up``, or with z for Pose2Sim.

    Numbers are written in full precision. k3 is omitted if it is zero, because Pose2Sim's own files do not have it.
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
