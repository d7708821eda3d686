"""The scene in front of the cameras: the actor's suit and skin as capsules, and the empty room."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats, Singles
from cospeech.geometry.camera import Camera, flatten
from cospeech.motion import skeleton
from cospeech.motion.markers import COLOURS, MARKERS

SUIT, SKIN = (34, 34, 38), (205, 150, 120)
WALL, FLOOR = (16.0, 20.0)
"""Luma of the room, which has no colour."""

PALM_M = -0.030
"""Outward offset of the centres of wrist and palm from the axis of forearm rotation, which runs through the head of
the
ulna (I. A. Kapandji, The Physiology of the Joints, vol. 1)."""

LIMBS = (
    ("hips", (-0.07, 0.02, 0.0), "hips", (0.07, 0.02, 0.0), 0.105, SUIT),
    ("hips", (-0.05, 0.10, 0.0), "chest", (-0.07, 0.12, 0.0), 0.100, SUIT),
    ("hips", (0.05, 0.10, 0.0), "chest", (0.07, 0.12, 0.0), 0.100, SUIT),
    ("hips", (0.0, 0.10, 0.0), "chest", (0.0, 0.11, 0.0), 0.105, SUIT),
    ("chest", (-0.14, 0.19, 0.0), "chest", (0.14, 0.19, 0.0), 0.060, SUIT),
    ("chest", (0.0, 0.20, 0.0), "head", (0.0, 0.0, 0.0), 0.052, SKIN),
    ("head", (0.0, 0.04, 0.02), "head", (0.0, 0.11, 0.01), 0.085, SKIN),
    *(
        limb
        for side, out in (("left", 1.0), ("right", -1.0))
        for limb in (
            (f"{side}_arm", (0.0, 0.0, 0.0), f"{side}_forearm", (0.0, 0.0, 0.0), 0.050, SUIT),
            (f"{side}_forearm", (0.0, 0.0, 0.0), f"{side}_hand", (PALM_M * out, 0.0, 0.0), 0.034, SUIT),
            (f"{side}_hand", (PALM_M * out, -0.03, 0.0), f"{side}_hand", (PALM_M * out, -0.14, 0.0), 0.032, SKIN),
            (f"{side}_thigh", (0.0, 0.0, 0.0), f"{side}_shin", (0.0, 0.0, 0.0), 0.078, SUIT),
            (f"{side}_shin", (0.0, 0.0, 0.0), f"{side}_foot", (0.0, 0.0, 0.0), 0.052, SUIT),
            (f"{side}_foot", (0.0, -0.02, -0.03), f"{side}_foot", (0.0, -0.03, 0.15), 0.040, SUIT),
        )
    ),
)
"""Capsules: joint and position in its frame of both ends, metres; radius, metres; colour."""

RADII_M = np.array([limb[4] for limb in LIMBS])


def ycbcr(rgb: npt.ArrayLike) -> Singles:
    """Return full-range Y, Cb, Cr (..., 3) (JFIF 1.02, section 7) of red, green and blue (..., 3)."""
    red, green, blue = np.moveaxis(np.asarray(rgb, dtype=float), -1, 0)
    luma = 0.299 * red + 0.587 * green + 0.114 * blue
    return np.stack([luma, 128 + (blue - luma) / 1.772, 128 + (red - luma) / 1.402], axis=-1).astype(np.float32)


PAINT = ycbcr([limb[5] for limb in LIMBS] + [COLOURS[marker.colour] for marker in MARKERS])
"""Y, Cb, Cr of the limbs, then of the markers, in full light."""


def limbs(motion: pd.DataFrame) -> Floats:
    """Return the ends of the capsules in each frame of a motion table, (T, n, 2, 3) in the world, metres."""
    turned, joints = skeleton.chain(
        motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float), skeleton.angles(motion)
    )
    ends = []
    for start, at_start, end, at_end, _, _ in LIMBS:
        for name, place in ((start, at_start), (end, at_end)):
            index = skeleton.JOINTS.index(name)
            ends.append(joints[:, index] + turned[:, index] @ np.array(place))
    return np.stack(ends, axis=1).reshape(len(motion), len(LIMBS), 2, 3)


def ray_slopes(camera: Camera) -> Singles:
    """Return the slopes x / z and y / z (2, H, W) of the ray through each pixel, in camera coordinates."""
    width, height = camera.size_px
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
    return np.ascontiguousarray(np.moveaxis(flatten(camera, grid), -1, 0), dtype=np.float32)


def room(camera: Camera, slopes: Singles) -> Singles:
    """Return Y, Cb, Cr (3, H, W) of the empty room: a dark wall, and a floor that is slightly lighter near the actor.

    ``slopes`` (2, H, W) are the ``ray_slopes`` of ``camera``.
    """
    width, height = camera.size_px
    right, below = slopes.astype(float)
    down = np.stack([right, below, np.ones((height, width))], axis=-1) @ camera.rotation
    place = camera.place_m
    along = np.where(down[..., 1] < -1e-9, -place[1] / np.minimum(down[..., 1], -1e-9), np.inf)
    far = np.minimum(along, 99.0)
    off = np.hypot(place[0] + far * down[..., 0], place[2] + far * down[..., 2])
    picture = np.full((3, height, width), 128.0, dtype=np.float32)
    picture[0] = WALL + FLOOR * np.exp(-((off / 2.0) ** 2)) * (along < 99.0)
    return picture
