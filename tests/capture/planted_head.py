"""A head with a real face that turns by planted angles in front of a rectified stereo pair.

The head is an ellipsoid that carries a photograph of a face (the astronaut that comes with scikit-image), projected
onto it from the front. Every pixel is the colour where its ray meets the ellipsoid, or the background.
"""

import functools
from typing import NamedTuple

import cv2
import numpy as np
from skimage import data

from cospeech.geometry.camera import Camera, project
from cospeech.geometry.rotation import from_euler

HALF_AXES_M = np.array([0.075, 0.115, 0.095])
FACE_PX, SPAN_PX = np.array([223.0, 115.0]), 104.0
"""In the photograph: the middle of the head, and the width of the head."""
DISTANCE_M, BASELINE_M = 0.8, 0.1


class Scene(NamedTuple):
    """Left and right camera; person, contrast, noise (grey levels) and seed of the pictures."""

    cameras: tuple[Camera, Camera]
    contrast: float = 1.0
    noise: float = 1.0
    seed: int = 0


def cameras(width_px=640, focal=1.4):
    """A pair that looks along -z at the origin, which lies at ``DISTANCE_M``."""
    size = (width_px, width_px * 3 // 4)
    optics = (focal * width_px,) * 2, ((width_px - 1) / 2, (size[1] - 1) / 2)
    turn = (np.pi, 0.0, 0.0)
    return tuple(
        Camera(name, size, *optics, turn=turn, shift_m=(-x, 0.0, DISTANCE_M))
        for name, x in (("left", -BASELINE_M / 2), ("right", BASELINE_M / 2))
    )


@functools.cache
def photograph():
    return cv2.cvtColor(data.astronaut(), cv2.COLOR_RGB2BGR)


@functools.cache
def background(size):
    draw = np.random.default_rng(7)
    rough = draw.uniform(70, 130, (size[1] // 16, size[0] // 16, 3)).astype(np.float32)
    return cv2.resize(rough * [1.1, 1.0, 0.7], size, interpolation=cv2.INTER_CUBIC).astype(np.float32)


def view(camera, rotation, middle_m, scene):
    """The picture (H, W, 3) in BGR of one camera, float."""
    picture = background(camera.size_px).copy()
    (u0, v0), reach = project(camera, middle_m), 1.2 * camera.focal_px[0] * HALF_AXES_M.max() / DISTANCE_M
    rows = slice(max(0, int(v0 - reach)), max(0, int(v0 + reach)))
    columns = slice(max(0, int(u0 - reach)), max(0, int(u0 + reach)))
    v, u = np.indices(picture.shape[:2], dtype=np.float32)[:, rows, columns]
    if not v.size:
        return picture
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    flat = np.stack(
        [(u - np.float32(cx)) / np.float32(fx), (v - np.float32(cy)) / np.float32(fy), u * 0 + 1], axis=-1
    )
    half = HALF_AXES_M.astype(np.float32)
    ray = flat @ (camera.rotation @ rotation).astype(np.float32)
    start = (rotation.T @ (camera.place_m - middle_m)).astype(np.float32)
    a, b = ((ray / half) ** 2).sum(-1), (ray / half) @ (start / half)
    inside = b * b - a * ((start / half) @ (start / half) - 1)
    hit = (inside > 0) & (b < 0)
    place = start + ((-b - np.sqrt(np.maximum(inside, 0))) / a)[..., None] * ray
    scale = SPAN_PX / (2 * HALF_AXES_M[0])
    across = (FACE_PX[0] + scale * place[..., 0]).astype(np.float32)
    down = (FACE_PX[1] - scale * place[..., 1]).astype(np.float32)
    colour = cv2.remap(photograph(), across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    window = picture[rows, columns]
    window[hit] = 128 + scene.contrast * (colour[hit].astype(np.float32) - 128)
    return picture


def planes(picture, scene, draw):
    """Y, Cb and Cr (H, W) of a picture, with noise."""
    noisy = picture + draw.normal(0, scene.noise, picture.shape).astype(np.float32) if scene.noise else picture
    bgr = np.clip(np.round(noisy), 0, 255).astype(np.uint8)
    y, cr, cb = cv2.split(cv2.cvtColor(bgr, cv2.COLOR_BGR2YCrCb))
    return y, cb, cr


def pair(scene, angles_deg, shift_m=(0.0, 0.0, 0.0), frame=0, change=None):
    """The planes of both views of one frame; ``change(picture, camera)`` may paint over each picture."""
    rotation = from_euler("XYZ", np.asarray(angles_deg, dtype=float))
    draw = np.random.default_rng([scene.seed, frame])
    result = []
    for camera in scene.cameras:
        picture = view(camera, rotation, np.asarray(shift_m, dtype=float), scene)
        if change:
            change(picture, camera)
        result.append(planes(picture, scene, draw))
    return result
