"""What a tracker found: where each marker stands in each view of each frame, and in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.capture.tracking import rigid_parts
from cospeech.data.arrays import Floats
from cospeech.geometry import kalman
from cospeech.geometry.camera import Camera, project
from cospeech.motion.markers import NAMES

SIGHT_SD_M = 4e-4
"""Standard deviation of a point from two views on each axis; more views make it surer."""

CARRIED_SD_M = 5e-3
"""Standard deviation of a hidden marker that the others of its part carry: no part of a body is quite rigid."""

JERK = 25.0
"""Spectral density of the change of a gesturing hand's acceleration, see ``kalman.motion_model``."""


STATUSES = ("lost", "predicted", "seen", "corrected")
"""How a row of the tables came to be."""
LOST, PREDICTED, SEEN, CORRECTED = range(len(STATUSES))


@dataclass(frozen=True)
class Sights:
    """One frame, or with a leading axis T a film, of M markers in C views.

    pixels (..., M, C, 2), NaN where unseen; n_pixels (..., M, C) that each rests on; corrected (..., M, C) by a
    person; used (..., M, C) views that the point rests on; points_m (..., M, 3), NaN where unseen; residual_px
    (..., M) of the used views.
    """

    pixels: Floats
    n_pixels: npt.NDArray[np.int64]
    corrected: npt.NDArray[np.bool_]
    used: npt.NDArray[np.bool_]
    points_m: Floats
    residual_px: Floats


def film(frames: Sequence[Sights]) -> Sights:
    """Return the frames of a film as one."""
    return Sights(*(np.stack(field) for field in zip(*(vars(frame).values() for frame in frames), strict=True)))


def confirmed(sights: Sights) -> Sights:
    """Return a film without the points that two views alone show in one frame, hidden in the frames beside it.

    Of discs that one view each sees, two rays may meet where no marker is: by chance in one frame, hardly in two.
    """
    seen = np.pad(np.isfinite(sights.points_m[..., 0]), ((1, 1), (0, 0)), constant_values=True)
    alone = seen[1:-1] & ~seen[:-2] & ~seen[2:]
    chance = alone & (sights.used.sum(axis=-1) == 2) & ~sights.corrected.any(axis=-1)
    return Sights(
        pixels=np.where(chance[..., None, None], np.nan, sights.pixels),
        n_pixels=np.where(chance[..., None], 0, sights.n_pixels),
        corrected=sights.corrected,
        used=sights.used & ~chance[..., None],
        points_m=np.where(chance[..., None], np.nan, sights.points_m),
        residual_px=np.where(chance, np.nan, sights.residual_px),
    )


def world_table(sights: Sights, fps: float, longest_hidden_s: float) -> pd.DataFrame:
    """Return the smoothed markers in the world (schema ``markers_3d``).

    A hidden marker of a rigid part is carried by the others. Another one that is hidden for longer than
    ``longest_hidden_s``, or before its first or after its last sight, is lost.
    """
    n_frames, n_markers = sights.points_m.shape[:2]
    n_views = sights.used.sum(axis=-1)
    sd = SIGHT_SD_M * np.sqrt(2.0 / np.maximum(n_views, 1))
    points, status = filled(sights.points_m, sd, fps, longest_hidden_s)
    status[(status == SEEN) & np.any(sights.corrected & sights.used, axis=-1)] = CORRECTED
    frame = np.repeat(np.arange(n_frames), n_markers)
    flat = points.reshape(-1, 3)
    return pd.DataFrame(
        {
            "frame": frame,
            "time_s": (frame + 0.5) / fps,
            "marker": named(NAMES, np.tile(np.arange(n_markers), n_frames)),
            "x_m": flat[:, 0],
            "y_m": flat[:, 1],
            "z_m": flat[:, 2],
            "n_views": n_views.ravel(),
            "residual_px": sights.residual_px.ravel(),
            "status": named(STATUSES, status),
        }
    )


def named(names: Sequence[str], numbers: npt.NDArray[np.integer]) -> pd.api.extensions.ExtensionArray:
    """Return a column of names by their numbers; whole arrays of strings would be most of a long film's memory."""
    return pd.array(names, dtype="str").take(numbers.ravel())


def filled(
    points_m: Floats, sd_m: Floats, fps: float, longest_hidden_s: float
) -> tuple[Floats, npt.NDArray[np.int8]]:
    """Return the smoothed markers (T, M, 3), NaN where lost, and the number (T, M) of how each came to be.

    Parameters
    ----------
    points_m : (T, M, 3) of ``markers.NAMES``, NaN where hidden.
    sd_m : (T, M) standard deviation of a seen one on each axis.
    longest_hidden_s : a marker that is hidden for longer is lost, if no rigid part carries it.
    """
    points, status = np.full(points_m.shape, np.nan), np.full(points_m.shape[:2], LOST, dtype=np.int8)
    carried = _carried(points_m)
    for marker in range(points_m.shape[1]):
        seen = np.isfinite(points_m[:, marker, 0])
        measured = np.where(seen[:, None], points_m[:, marker], carried[:, marker])
        smoothed, _ = kalman.smooth(measured, np.where(seen, sd_m[:, marker], CARRIED_SD_M), fps, JERK)
        known = np.isfinite(measured[:, 0]) | _bridged(seen, round(longest_hidden_s * fps))
        points[known, marker] = smoothed[known]
        status[known, marker] = PREDICTED
        status[seen, marker] = SEEN
    return points, status


def _carried(points_m: Floats) -> Floats:
    """Return the hidden markers (T, M, 3) where the rest of their rigid part carries them; NaN where it does not."""
    carried = np.full(points_m.shape, np.nan)
    missing = np.isnan(points_m[..., 0])
    hidden = missing[:, ~missing.all(axis=0)].any(axis=1)
    if not hidden.all():
        reference = points_m[int(np.argmin(hidden))]
        for frame in np.flatnonzero(hidden):
            carried[frame] = rigid_parts.carried(reference, points_m[frame])
    return carried


def _bridged(seen: npt.NDArray[np.bool_], longest: int) -> npt.NDArray[np.bool_]:
    """Return the hidden frames (T,) between two sights that are at most ``longest`` hidden frames apart."""
    bridged = np.zeros(len(seen), dtype=bool)
    shown = np.flatnonzero(seen)
    for before, after in pairwise(shown):
        if after - before - 1 <= longest:
            bridged[before + 1 : after] = True
    return bridged


def view_table(sights: Sights, world: pd.DataFrame, cameras: Sequence[Camera]) -> pd.DataFrame:
    """Return the markers in each view (schema ``markers_2d``): seen, else predicted from ``world``, else lost."""
    n_frames, n_markers, n_views = sights.n_pixels.shape
    points = world[["x_m", "y_m", "z_m"]].to_numpy().reshape(n_frames, n_markers, 3)
    pixels = np.stack([project(camera, points) for camera in cameras], axis=2)
    seen = np.isfinite(sights.pixels[..., 0])
    status = np.where(np.isfinite(pixels[..., 0]), np.int8(PREDICTED), np.int8(LOST))
    status[seen] = np.where(sights.corrected[seen], CORRECTED, SEEN)
    pixels[seen] = sights.pixels[seen]
    x_px, y_px = pixels.reshape(-1, 2).T
    marker, view = (number.ravel() for number in np.indices((n_markers, n_views)))
    return pd.DataFrame(
        {
            "frame": np.repeat(np.arange(n_frames), n_markers * n_views),
            "camera": named([camera.name for camera in cameras], np.tile(view, n_frames)),
            "marker": named(NAMES, np.tile(marker, n_frames)),
            "x_px": x_px,
            "y_px": y_px,
            "n_pixels": pd.arrays.IntegerArray(sights.n_pixels.ravel(), (status != SEEN).ravel()),
            "status": named(STATUSES, status),
        }
    )
