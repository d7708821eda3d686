"""The calibration take: the red spot of a laser pointer rests on marked points, then roams the capture volume.

The studio is dark. The positions of the marks are stated in the configuration (``capture.calibration.facts``), like
those measured by a person.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera, project
from cospeech.studio import film, paint, stage

Planes = npt.NDArray[np.uint8]

LOW_M, HIGH_M = (-0.8, 0.1, -0.6), (0.8, 1.9, 0.8)
HIDDEN = 0.15
"""Fraction of views in which the spot is hidden."""
REFLECTED = 0.10
"""Fraction of views with a weaker false spot, a reflection."""
NOISE = 1.0
RANGE = (6.0, 248.0)
"""Range of the sensor on a scale of 255, with room for noise at both ends."""
SPOT_PX, BLOOM_PX = 1.3, 6.0
"""Standard deviations of the spot and its bloom in an image 1392 pixels wide."""
RED = stage.ycbcr((255, 60, 60))


MARKS_M = ((0.0, 0.0, 0.0), (0.0, 1.5, 0.0), (0.7, 1.5, 0.0), (0.0, 1.5, 0.7))
"""The origin on the floor, and the top of a staff of 1.5 m at the origin, at a mark to the left, and at one ahead."""
REST, WAY = 24, 16
"""Number of frames in which the spot rests on a mark, and in which it moves to the next."""
N_FRAMES = 700


def walk(n_frames: int, seed: int) -> Floats:
    """Return the positions (n_frames, 3) of the spot in metres: resting on each mark in turn, then roaming."""
    roamed = _roam(n_frames - len(MARKS_M) * (REST + WAY), seed)
    stops = np.array([*MARKS_M, roamed[0]])
    way = 0.5 - 0.5 * np.cos(np.pi * (np.arange(WAY)[:, None] + 1) / (WAY + 1))
    pieces = [
        np.vstack([np.repeat(here[None], REST, axis=0), here + way * (there - here)])
        for here, there in pairwise(stops)
    ]
    return np.vstack([*pieces, roamed])


def _roam(n_frames: int, seed: int) -> Floats:
    """Return a smooth random path (n_frames, 3) through the volume."""
    rng = np.random.default_rng([seed, 7])
    time = np.arange(n_frames)[:, None, None]
    waves, phases = rng.uniform(0.01, 0.06, (3, 4)), rng.uniform(0.0, 2.0 * np.pi, (3, 4))
    share = 0.5 + 0.5 * np.sin(1.2 * np.sin(2.0 * np.pi * waves * time + phases).sum(axis=2))
    return np.array(LOW_M) + share * (np.array(HIGH_M) - np.array(LOW_M))


def visible_spots(cameras: Sequence[Camera], spots_m: Floats, seed: int) -> pd.DataFrame:
    """Return the true positions of the spot in the views that see it, as a table ``laser``."""
    rng = np.random.default_rng([seed, 8])
    views = []
    for camera in cameras:
        pixels = project(camera, spots_m)
        inside = ((pixels >= 0) & (pixels <= np.array(camera.size_px) - 1)).all(axis=1)
        seen = np.flatnonzero(inside & (rng.random(len(spots_m)) >= HIDDEN))
        views.append(
            pd.DataFrame({"camera": camera.name, "frame": seen, "x_px": pixels[seen, 0], "y_px": pixels[seen, 1]})
        )
    return pd.concat(views, ignore_index=True)


def frames(camera: Camera, seen: pd.DataFrame, n_frames: int, seed: int, noise: float = NOISE) -> Iterator[Planes]:
    """Yield the planes (3, H, W) of the take in one camera; they are one array that is overwritten in every frame.

    ``seen`` holds the rows of ``visible_spots`` for this camera.
    """
    width, height = camera.size_px
    rng = np.random.default_rng([seed, *camera.name.encode(), 9])
    grain = film.grain(noise, rng)
    dim = stage.room(camera, stage.ray_slopes(camera)) * np.array([0.4, 1.0, 1.0], dtype=np.float32)[:, None, None]
    empty = np.rint(paint.STEPS * np.clip(dim, *RANGE)).astype(np.int16)
    spots = dict(zip(seen["frame"], seen[["x_px", "y_px"]].to_numpy(), strict=True))
    picture, planes = np.empty_like(empty), np.empty(empty.shape, dtype=np.uint8)
    for frame in range(n_frames):
        picture[:] = empty
        if frame in spots:
            _glow(picture, spots[frame], 1.0, width / 1392)
        if rng.random() < REFLECTED:
            _glow(picture, rng.uniform((0, 0), (width, height)), 0.35, width / 1392)
        paint.add_grain(picture, grain, int(rng.integers(len(grain))), planes)
        yield planes


def _glow(picture: npt.NDArray[np.int16], spot_px: Floats, strength: float, scale: float) -> None:
    """Add a Gaussian spot with Gaussian bloom at ``spot_px`` to Y, Cb and Cr, in steps of 1 / ``paint.STEPS``."""
    x, y = spot_px
    reach = int(4 * BLOOM_PX * scale) + 1
    left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
    patch = picture[:, top : int(y) + reach + 1, left : int(x) + reach + 1]
    rows, columns = np.indices(patch.shape[1:])
    square = ((columns + left - x) ** 2 + (rows + top - y) ** 2) / scale**2
    light = strength * (0.85 * np.exp(-square / (2 * SPOT_PX**2)) + 0.15 * np.exp(-square / (2 * BLOOM_PX**2)))
    colour = np.array([RED[0], RED[1] - 128, RED[2] - 128])[:, None, None]
    least, most = (paint.STEPS * limit for limit in RANGE)
    patch[:] = np.clip(patch + np.rint(paint.STEPS * light * colour), least, most)
