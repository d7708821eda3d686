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

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera
from cospeech.geometry.rotation import from_vectors, to_vectors

NEEDED = ("size", "matrix", "distortions", "rotation", "translation")

FROM_Z_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From a world with z up to one with y up, with the convention of Pose2Sim: (x, y, z) becomes (y, z, x)."""

EXPORT = "export the calibration again"

LARGEST = 1e9
"""Limit of the absolute value of every number; larger ones are errors of the file."""

LEAST_FOCAL, MOST_FOCAL = 0.2, 50.0
"""Range of focal lengths in image sizes: a field of view of 136 degrees, and of 1 degree."""

FARTHEST_M = 50.0
"""Largest distance of a camera from the origin, beyond which the translation cannot be in metres."""

APART_M = 0.01
"""Smallest distance between two cameras; closer ones cannot triangulate."""


def read(path: str | Path, up: Literal["y", "z"] = "y") -> list[Camera]:
    """Return the cameras of a TOML file in their order in the file.

    Parameters
    ----------
    up : the axis that points up in the world of the file. In Pose2Sim it is z for cameras and y for points.

    Raises
    ------
    UserError : if the file is missing or not TOML, or a camera is incomplete, impossible or a fisheye camera.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"{path}: no such file; give the path of a TOML file of Pose2Sim or caliscope")
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: not a TOML file ({error}); give a camera file of Pose2Sim or caliscope") from error
    except RecursionError:
        raise UserError(
            f"{path}: nested too deeply for a camera file; give a camera file of Pose2Sim or caliscope"
        ) from None
    nested = raw.get("cameras")
    entries = {f"cam_{key}": value for key, value in nested.items()} if isinstance(nested, dict) else raw
    cameras = [
        _camera(f"{path}: camera {key}", str(value.get("name", key)), value, up)
        for key, value in entries.items()
        if isinstance(value, dict) and "matrix" in value
    ]
    if not cameras:
        raise UserError(f"{path}: has no camera with a 'matrix'; give a camera file of Pose2Sim or caliscope")
    _check_places(cameras, path)
    return cameras


def _camera(where: str, name: str, raw: dict[str, Any], up: str) -> Camera:
    for key in NEEDED:
        if key not in raw:
            raise UserError(f"{where}: '{key}' is missing; calibrate the camera's intrinsic and extrinsic parameters")
    if raw.get("fisheye"):
        raise UserError(f"{where}: fisheye lenses are not supported; undistort the video first")
    size, matrix, lens, turn, shift = (_numbers(where, key, raw[key]) for key in NEEDED)
    for key, part, shapes, expected in (
        ("size", size, ((2,),), "a width and a height"),
        ("matrix", matrix, ((3, 3),), "3 rows of 3 numbers"),
        ("rotation", turn, ((3,), (3, 3)), "a rotation vector of 3 numbers, or a matrix of 3 rows of 3"),
        ("translation", shift, ((3,),), "3 numbers"),
    ):
        if part.shape not in shapes:
            raise UserError(f"{where}: '{key}' has the shape {_shape(part)}, but must be {expected}; {EXPORT}")
    _check_matrix(where, size, matrix)
    vector = to_vectors(_rotation(where, turn) @ (FROM_Z_UP.T if up == "z" else np.eye(3)))
    return Camera(
        name,
        (int(size[0]), int(size[1])),
        (float(matrix[0, 0]), float(matrix[1, 1])),
        (float(matrix[0, 2]), float(matrix[1, 2])),
        _lens(where, lens),
        (float(vector[0]), float(vector[1]), float(vector[2])),
        (float(shift[0]), float(shift[1]), float(shift[2])),
    )


def _numbers(where: str, key: str, value: Any) -> Floats:
    """Return a list as an array without axes of length 1, as OpenCV writes vectors as columns or rows."""
    try:
        numbers = np.array(value, dtype=float).squeeze()
    except (TypeError, ValueError):
        raise UserError(
            f"{where}: '{key}' holds something other than numbers, or rows of different length; {EXPORT}"
        ) from None
    if not (np.abs(numbers) < LARGEST).all():
        raise UserError(f"{where}: '{key}' holds missing, infinite or much too large numbers; {EXPORT}")
    return numbers


def _shape(part: Floats) -> str:
    return "x".join(map(str, part.shape)) or "of a single number"


def _check_matrix(where: str, size: Floats, matrix: Floats) -> None:
    """Raise UserError unless ``matrix`` (3, 3) is that of a pinhole camera with an image of ``size`` (2,)."""
    if min(size) < 1 or (size != np.round(size)).any():
        raise UserError(
            f"{where}: 'size' is {size[0]:g} x {size[1]:g}; give the width and height of the image in pixels"
        )
    if not np.allclose(matrix[2], (0, 0, 1), atol=1e-6):
        transposed = np.allclose(matrix[:, 2], (0, 0, 1), atol=1e-6)
        advice = "transpose it, as MATLAB stores the matrix transposed" if transposed else EXPORT
        raise UserError(f"{where}: the last row of 'matrix' is not 0 0 1; {advice}")
    focal, centre = matrix[[0, 1], [0, 1]], matrix[:2, 2]
    if min(focal) <= 0:
        raise UserError(
            f"{where}: the focal lengths in 'matrix' are {focal[0]:g} and {focal[1]:g}; they must be positive"
        )
    if not LEAST_FOCAL <= min(focal) / max(size) <= max(focal) / max(size) <= MOST_FOCAL:
        raise UserError(
            f"{where}: focal lengths of {focal[0]:g} and {focal[1]:g} px are impossible for an image of {size[0]:g}x"
            f"{size[1]:g} px; give 'matrix' in pixels of this image size"
        )
    if np.abs(matrix[[0, 1], [1, 0]]).max() > 1e-3 * min(focal):
        raise UserError(f"{where}: 'matrix' has skew, which is not supported; calibrate without it")
    if (centre < 0).any() or (centre > size).any():
        raise UserError(
            f"{where}: the principal point ({centre[0]:g}, {centre[1]:g}) lies outside the image of {size[0]:g}x"
            f"{size[1]:g} px; give 'matrix' and 'size' in pixels of the same image"
        )


def _lens(where: str, lens: Floats) -> tuple[float, float, float, float, float]:
    """Return k1, k2, p1, p2 and k3 of the coefficients of OpenCV, whose order they have."""
    if lens.shape not in ((4,), (5,), (8,), (12,), (14,)):
        raise UserError(
            f"{where}: 'distortions' has the shape {_shape(lens)}, but must be k1, k2, p1, p2 and perhaps k3; "
            f"{EXPORT}"
        )
    k1, k2, p1, p2, k3, *others = [*lens.tolist(), 0.0][: max(len(lens), 5)]
    if any(others):
        raise UserError(
            f"{where}: 'distortions' has nonzero coefficients beyond k3, which are not supported; calibrate with "
            "k1, k2, p1, p2 and k3 only"
        )
    return k1, k2, p1, p2, k3


def _rotation(where: str, turn: Floats) -> Floats:
    """Return the rotation (3, 3) of a rotation vector (3,) or matrix (3, 3)."""
    if turn.shape == (3,):
        angle = float(np.linalg.norm(turn))
        if angle > np.pi + 1e-3:
            raise UserError(
                f"{where}: the rotation vector has a length of {angle:.4g}, more than pi; give it in radians, not in "
                "degrees"
            )
        return from_vectors(turn)
    if not np.allclose(turn @ turn.T, np.eye(3), atol=1e-4):
        raise UserError(f"{where}: 'rotation' is not a rotation matrix, as its rows are not orthonormal; {EXPORT}")
    if np.linalg.det(turn) < 0:
        raise UserError(
            f"{where}: 'rotation' is a reflection (determinant -1); give all axes of a right-handed world and camera"
        )
    return turn


def _check_places(cameras: Sequence[Camera], path: Path) -> None:
    """Raise UserError if two cameras have one name or one place, or if one is too far from the origin."""
    for number, camera in enumerate(cameras):
        away = float(np.linalg.norm(camera.place_m))
        if away > FARTHEST_M:
            raise UserError(
                f"{path}: camera {camera.name} is {away:.4g} m from the origin; give 'translation' in metres (not "
                "centimetres or millimetres), and put the origin where the actor stands"
            )
        for other in cameras[:number]:
            if other.name == camera.name:
                raise UserError(f"{path}: two cameras are called '{camera.name}'; give each its own name")
            if np.linalg.norm(camera.place_m - other.place_m) < APART_M:
                raise UserError(
                    f"{path}: cameras {other.name} and {camera.name} are in the same place; calibrate their poses in "
                    "one world"
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
