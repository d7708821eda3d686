"""The output of a tracker: the position of each marker in each view and frame, and in 3D."""

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

DETECTION_SD_M = 4e-4
"""Standard deviation per axis of a point triangulated from two views; more views reduce it."""

CARRIED_SD_M = 5e-3
"""Standard deviation of a hidden marker predicted from the others of its body part, which is not perfectly rigid."""

JERK = 25.0
"""Spectral density of the jerk of a gesturing hand, see ``kalman.motion_model``."""


STATUSES = ("lost", "predicted", "seen", "corrected")
"""Status of a row: how its position was obtained."""
LOST, PREDICTED, SEEN, CORRECTED = range(len(STATUSES))


@dataclass(frozen=True)
class Detections:
    """M markers in C views in one frame, or in a whole take with a leading axis T.

    Attributes
    ----------
    pixels : (..., M, C, 2) positions, NaN where not detected.
    n_pixels : (..., M, C) numbers of pixels that the positions are based on.
    corrected : (..., M, C) whether a person set the position.
    used : (..., M, C) whether the view was used to triangulate the point.
    points_m : (..., M, 3) triangulated points, NaN where not detected.
    residual_px : (..., M) RMS reprojection error over the used views.
    """

    pixels: Floats
    n_pixels: npt.NDArray[np.int64]
    corrected: npt.NDArray[np.bool_]
    used: npt.NDArray[np.bool_]
    points_m: Floats
    residual_px: Floats


def stack(frames: Sequence[Detections]) -> Detections:
    """Return the detections of single frames stacked along a leading axis T."""
    return Detections(*(np.stack(field) for field in zip(*(vars(frame).values() for frame in frames), strict=True)))


def confirmed(detections: Detections) -> Detections:
    """Return the detections of a take without isolated points: seen by only two views, and in a single frame.

    Two rays through discs of different markers may intersect by chance where there is no marker. This can happen in
    one frame, but hardly in two successive ones.
    """
    seen = np.pad(np.isfinite(detections.points_m[..., 0]), ((1, 1), (0, 0)), constant_values=True)
    alone = seen[1:-1] & ~seen[:-2] & ~seen[2:]
    chance = alone & (detections.used.sum(axis=-1) == 2) & ~detections.corrected.any(axis=-1)
    return Detections(
        pixels=np.where(chance[..., None, None], np.nan, detections.pixels),
        n_pixels=np.where(chance[..., None], 0, detections.n_pixels),
        corrected=detections.corrected,
        used=detections.used & ~chance[..., None],
        points_m=np.where(chance[..., None], np.nan, detections.points_m),
        residual_px=np.where(chance, np.nan, detections.residual_px),
    )


def world_table(detections: Detections, fps: float, longest_hidden_s: float) -> pd.DataFrame:
    """Return the smoothed 3D markers (schema ``markers_3d``).

    A hidden marker on a rigid body part is predicted from the other markers of the part. Any other marker is lost if
    it is hidden for longer than ``longest_hidden_s``, or before its first or after its last detection.
    """
    n_frames, n_markers = detections.points_m.shape[:2]
    n_views = detections.used.sum(axis=-1)
    sd = DETECTION_SD_M * np.sqrt(2.0 / np.maximum(n_views, 1))
    points, status = fill_gaps(detections.points_m, sd, fps, longest_hidden_s)
    status[(status == SEEN) & np.any(detections.corrected & detections.used, axis=-1)] = CORRECTED
    frame = np.repeat(np.arange(n_frames), n_markers)
    flat = points.reshape(-1, 3)
    return pd.DataFrame(
        {
            "frame": frame,
            "time_s": (frame + 0.5) / fps,
            "marker": label_column(NAMES, np.tile(np.arange(n_markers), n_frames)),
            "x_m": flat[:, 0],
            "y_m": flat[:, 1],
            "z_m": flat[:, 2],
            "n_views": n_views.ravel(),
            "residual_px": detections.residual_px.ravel(),
            "status": label_column(STATUSES, status),
        }
    )


def label_column(names: Sequence[str], numbers: npt.NDArray[np.integer]) -> pd.api.extensions.ExtensionArray:
    """Return a column of names given their indices.

    Arrays of Python strings would take up most of the memory of a long film.
    """
    return pd.array(names, dtype="str").take(numbers.ravel())


def fill_gaps(
    points_m: Floats, sd_m: Floats, fps: float, longest_hidden_s: float
) -> tuple[Floats, npt.NDArray[np.int8]]:
    """Return the smoothed markers (T, M, 3), NaN where lost, and their status (T, M) as an index of ``STATUSES``.

    Parameters
    ----------
    points_m : (T, M, 3) positions of ``markers.NAMES``, NaN where hidden.
    sd_m : (T, M) standard deviation per axis of the visible markers.
    longest_hidden_s : longest gap to fill, unless a rigid body part determines the position.
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
    """Return the hidden markers (T, M, 3) predicted from the rest of their rigid part; NaN elsewhere."""
    carried = np.full(points_m.shape, np.nan)
    missing = np.isnan(points_m[..., 0])
    hidden = missing[:, ~missing.all(axis=0)].any(axis=1)
    if not hidden.all():
        reference = points_m[int(np.argmin(hidden))]
        for frame in np.flatnonzero(hidden):
            carried[frame] = rigid_parts.carried(reference, points_m[frame])
    return carried


def _bridged(seen: npt.NDArray[np.bool_], longest: int) -> npt.NDArray[np.bool_]:
    """Return which frames (T,) lie in a gap of at most ``longest`` frames between two detections."""
    bridged = np.zeros(len(seen), dtype=bool)
    shown = np.flatnonzero(seen)
    for before, after in pairwise(shown):
        if after - before - 1 <= longest:
            bridged[before + 1 : after] = True
    return bridged


def view_table(detections: Detections, world: pd.DataFrame, cameras: Sequence[Camera]) -> pd.DataFrame:
    """Return the markers in each view (schema ``markers_2d``).

    A position that was not detected is projected from ``world``, or lost if it is lost there.
    """
    n_frames, n_markers, n_views = detections.n_pixels.shape
    points = world[["x_m", "y_m", "z_m"]].to_numpy().reshape(n_frames, n_markers, 3)
    pixels = np.stack([project(camera, points) for camera in cameras], axis=2)
    seen = np.isfinite(detections.pixels[..., 0])
    status = np.where(np.isfinite(pixels[..., 0]), np.int8(PREDICTED), np.int8(LOST))
    status[seen] = np.where(detections.corrected[seen], CORRECTED, SEEN)
    pixels[seen] = detections.pixels[seen]
    x_px, y_px = pixels.reshape(-1, 2).T
    marker, view = (number.ravel() for number in np.indices((n_markers, n_views)))
    return pd.DataFrame(
        {
            "frame": np.repeat(np.arange(n_frames), n_markers * n_views),
            "camera": label_column([camera.name for camera in cameras], np.tile(view, n_frames)),
            "marker": label_column(NAMES, np.tile(marker, n_frames)),
            "x_px": x_px,
            "y_px": y_px,
            "n_pixels": pd.arrays.IntegerArray(detections.n_pixels.ravel(), (status != SEEN).ravel()),
            "status": label_column(STATUSES, status),
        }
    )
