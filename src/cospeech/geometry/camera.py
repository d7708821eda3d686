"""The pinhole camera with Brown's lens distortion, for rendering and for measuring.

A camera looks along its z axis; in the image, x points to the right and y down. A point X of the world (x to the
actor's left, y up, z in the direction that the actor faces, metres) has the coordinates R X + t in the frame of the
camera. Pixel coordinates are 0 at the centre of the first pixel. The distortion is that of OpenCV, with radial
coefficients k1, k2, k3 and tangential coefficients p1, p2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry.rotation import from_vectors, to_vectors

NEWTON_STEPS = 20
"""Maximum number of steps to invert the distortion; four or five suffice unless the lens folds the image."""


@dataclass(frozen=True)
class Camera:
    """One camera.

    Attributes
    ----------
    name : as in the column ``camera`` of tables.
    size_px : width and height of the image.
    focal_px, centre_px : fx, fy and cx, cy.
    lens : k1, k2, p1, p2, k3.
    turn : rotation vector of R, from world to camera, radians.
    shift_m : t, the origin of the world in the frame of the camera, metres.
    """

    name: str
    size_px: tuple[int, int]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    lens: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shift_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> Floats:
        """R (3, 3), from world to camera."""
        return from_vectors(np.array(self.turn))

    @property
    def place_m(self) -> Floats:
        """The centre of projection (3,) in the world in metres."""
        return -self.rotation.T @ np.array(self.shift_m)

    @property
    def pose(self) -> Floats:
        """[R | t], (3, 4), from the world to homogeneous normalised image coordinates."""
        return np.column_stack([self.rotation, self.shift_m])

    @property
    def intrinsic(self) -> Floats:
        """K (3, 3), from homogeneous normalised image coordinates to pixels."""
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def look(name: str, place_m: npt.ArrayLike, target_m: npt.ArrayLike) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return ``turn`` and ``shift_m`` of an upright camera at ``place_m`` (3,) that looks at ``target_m`` (3,).

    Raises
    ------
    ValueError : if the camera, called ``name``, would look straight up or down.
    """
    place = np.asarray(place_m, dtype=float)
    ahead = np.asarray(target_m, dtype=float) - place
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    if np.linalg.norm(right) < 1e-9:
        raise ValueError(f"camera {name} looks straight up or down, so that its image has no upright orientation")
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    return tuple(to_vectors(rotation)), tuple(-rotation @ place)


def distort(camera: Camera, flat: Floats) -> Floats:
    """Return the distorted normalised coordinates (..., 2) of ideal ones ``flat`` (..., 2)."""
    k1, k2, p1, p2, k3 = camera.lens
    x, y = flat[..., 0], flat[..., 1]
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=-1,
    )


def project(camera: Camera, points_m: Floats) -> Floats:
    """Return the pixels (..., 2) of world points (..., 3) in metres; NaN for points behind the camera."""
    seen = points_m @ camera.rotation.T + np.array(camera.shift_m)
    depth = np.where(seen[..., 2:] > 1e-6, seen[..., 2:], np.nan)
    return distort(camera, seen[..., :2] / depth) * camera.focal_px + camera.centre_px


def flatten(camera: Camera, pixels: Floats) -> Floats:
    """Return the ideal normalised coordinates (..., 2) of pixels (..., 2), inverting ``distort`` by Newton's method.

    The result is NaN for pixels that no point is projected to, where the lens folds the image.
    """
    bent = (np.asarray(pixels, dtype=float) - camera.centre_px) / camera.focal_px
    k1, k2, p1, p2, k3 = camera.lens
    flat = bent.copy()
    for _ in range(NEWTON_STEPS):
        x, y = flat[..., 0], flat[..., 1]
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        slope = 2.0 * (k1 + square * (2.0 * k2 + 3.0 * square * k3))  # d radial / d x is slope * x
        a = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
        b = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
        d = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
        error = distort(camera, flat) - bent
        determinant = a * d - b * b
        step = (
            np.stack([d * error[..., 0] - b * error[..., 1], a * error[..., 1] - b * error[..., 0]], axis=-1)
            / determinant[..., None]
        )
        flat = flat - step
        if np.nanmax(np.abs(step), initial=0.0) < 1e-13:
            break
    missed = np.abs(distort(camera, flat) - bent).max(axis=-1) > 1e-9
    return np.where(missed[..., None], np.nan, flat)


def rays(camera: Camera, pixels: Floats) -> Floats:
    """Return the directions (..., 3) of the rays of pixels (..., 2) in the world, as unit vectors."""
    flat = flatten(camera, pixels)
    ahead = np.concatenate([flat, np.ones_like(flat[..., :1])], axis=-1) @ camera.rotation
    return ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)


COLUMNS = (
    "camera", "width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3",
    "rx", "ry", "rz", "tx_m", "ty_m", "tz_m",
)  # fmt: skip


def to_table(cameras: Sequence[Camera]) -> pd.DataFrame:
    """Return the cameras as a table with ``COLUMNS`` (schema ``cameras`` without its quality columns)."""
    rows = [(c.name, *c.size_px, *c.focal_px, *c.centre_px, *c.lens, *c.turn, *c.shift_m) for c in cameras]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def from_table(table: pd.DataFrame) -> list[Camera]:
    """Return the cameras of a table with ``COLUMNS``."""
    cameras = []
    for row in table[list(COLUMNS)].itertuples(index=False):
        values = [float(value) for value in row[3:]]
        cameras.append(
            Camera(
                str(row[0]), (int(row[1]), int(row[2])), (values[0], values[1]), (values[2], values[3]),
                (values[4], values[5], values[6], values[7], values[8]),
                (values[9], values[10], values[11]), (values[12], values[13], values[14]),
            )
        )  # fmt: skip
    return cameras
