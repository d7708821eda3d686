"""Where the markers are in the first frame: from a person's clicks, or found by colour and by how a person stands.

Without clicks, the discs of each colour are found in the whole pictures, combined over the views into points, and the
points are given to the markers so that the sum of distances to the planned places is least. The actor stands upright
in the middle with hanging arms, facing z (Özkul 2012, 2.4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import linear_sum_assignment

from cospeech.capture.tracking import disc, reacquisition
from cospeech.capture.tracking.colour import Mixer
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera, project
from cospeech.geometry.triangulate import packed, triangulate
from cospeech.motion.markers import MARKERS, NAMES, RADIUS_M

PLAN_M = {
    "head_left": (0.09, 1.65, 0.02),
    "head_right": (-0.09, 1.65, 0.02),
    "head_front": (0.0, 1.69, 0.11),
    "chest": (0.0, 1.31, 0.10),
    "back": (0.0, 1.31, -0.12),
    "left_shoulder": (0.18, 1.46, -0.02),
    "right_shoulder": (-0.18, 1.46, -0.02),
    "left_elbow": (0.24, 1.11, -0.02),
    "right_elbow": (-0.24, 1.11, -0.02),
    "left_hand": (0.20, 0.84, 0.01),
    "right_hand": (-0.20, 0.84, 0.01),
    "left_leg": (0.12, 0.67, 0.08),
    "right_leg": (-0.12, 0.67, 0.08),
    "left_foot": (0.09, 0.09, 0.12),
    "right_foot": (-0.09, 0.09, 0.12),
}
"""Where each marker of an adult of 1.75 m is, who stands at the origin with hanging arms."""

OPTIONAL = ("back",)
"""Markers that two views need not see in the first frame; they are found when they appear."""

MIDDLE_M = np.array([0.0, 0.95, 0.0])
STAGE_M = 1.3
"""The actor is sought this far around ``MIDDLE_M``."""

FARTHEST_M = 0.35
"""A point farther than this from a marker's planned place is another's."""

CLICKED_PX = 6.0
"""Clicks on one marker that miss their common point by more contradict each other."""

FOUND_RADII = 0.25
"""Discs that miss their common point by less than this share of a radius are of one marker."""

PAIR_COST_M = 0.1
"""What a point that only two views see must be nearer to its plan than one that three see."""


def from_clicks(clicks: pd.DataFrame, cameras: Sequence[Camera], where: str) -> Floats:
    """Return the markers (M, 3) in the first frame, metres, from rows frame, camera, marker, x_px, y_px of frame 0.

    An optional marker that was not clicked in two views is at its planned place.

    Raises
    ------
    UserError : where a marker is not clicked in two views, or the clicks on it contradict each other.
    """
    names = [camera.name for camera in cameras]
    pixels = np.full((len(NAMES), len(cameras), 2), np.nan)
    first = clicks[clicks["frame"] == 0]
    for camera, marker, x, y in first[["camera", "marker", "x_px", "y_px"]].itertuples(index=False):
        pixels[NAMES.index(marker), names.index(camera)] = x, y
    clicked = np.isfinite(pixels[..., 0]).sum(axis=1)
    points, _, _ = triangulate(cameras, pixels, CLICKED_PX)
    for marker, name in enumerate(NAMES):
        if clicked[marker] < 2 and name not in OPTIONAL:
            raise UserError(
                f"{where}: marker {name} is clicked in {clicked[marker]} views of frame 0; click it in two"
            )
        if clicked[marker] >= 2 and np.isnan(points[marker, 0]):
            raise UserError(
                f"{where}: the clicks on marker {name} in frame 0 do not meet in one point; is left taken for right?"
            )
    return _planned_where_missing(points)


def find(pictures: Sequence[Planes], cameras: Sequence[Camera], mixers: Mapping[str, Mixer], where: str) -> Floats:
    """Return the markers (M, 3) in the first frame, metres, found in one picture of each camera.

    Raises
    ------
    UserError : where a marker is not found.
    """
    points = np.full((len(NAMES), 3), np.nan)
    for colour, mixer in mixers.items():
        members = [index for index, marker in enumerate(MARKERS) if marker.colour == colour]
        found, n_views = _points(pictures, cameras, mixer)
        if not len(found):
            continue
        plan = np.array([PLAN_M[NAMES[index]] for index in members])
        away = np.linalg.norm(plan[:, None] - found[None], axis=2)
        cost = np.minimum(away, FARTHEST_M) + np.where(n_views == 2, PAIR_COST_M, 0.0)
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if away[row, column] < FARTHEST_M:
                points[members[row]] = found[column]
    missing = [name for index, name in enumerate(NAMES) if np.isnan(points[index, 0]) and name not in OPTIONAL]
    if missing:
        raise UserError(f"{where}: {', '.join(missing)} not found in frame 0; click them in two views of frame 0")
    return _planned_where_missing(points)


def _planned_where_missing(points: Floats) -> Floats:
    """Return the points with unknown ones at their planned places, moved with the actor."""
    plan = np.array([PLAN_M[name] for name in NAMES])
    shift = np.nanmean(points - plan, axis=0)
    return np.where(np.isnan(points), plan + shift, points)


def _points(pictures: Sequence[Planes], cameras: Sequence[Camera], mixer: Mixer) -> tuple[Floats, npt.NDArray]:
    """Return the points (n, 3) where discs of one colour meet, most views first, and their numbers of views (n,)."""
    discs, radii = np.full((len(cameras), reacquisition.MOST_BLOBS, 4), np.nan), []
    unknown, none = np.array(disc.UNKNOWN), np.empty((0, 2))
    for number, (planes, camera) in enumerate(zip(pictures, cameras, strict=True)):
        depth = np.linalg.norm(camera.place_m - MIDDLE_M)
        radius = float(np.sqrt(np.prod(camera.focal_px)) * RADIUS_M / depth)
        radii.append(radius)
        middle, reach = project(camera, MIDDLE_M), STAGE_M * radius / RADIUS_M
        found = reacquisition.discs(*planes, camera.size_px[0], *mixer, middle, reach, radius, unknown, none)
        discs[number, : len(found)] = found
    rig, limit_px, chosen = packed(cameras), FOUND_RADII * float(np.mean(radii)), []
    # A disc that a better point took is gone for the rest, which may then meet without it.
    while (best := _best(rig, discs, limit_px)) is not None:
        chosen.append(best)
        for view in np.flatnonzero(best.used):
            discs[view, (discs[view, :, :2] == best.pixels[view]).all(axis=1)] = np.nan
    return (
        np.array([point.point_m for point in chosen]).reshape(-1, 3),
        np.array([point.used.sum() for point in chosen], dtype=int),
    )


def _best(rig: Floats, discs: Floats, limit_px: float) -> reacquisition.Found | None:
    """Return the point where discs (C, n, 4) of most views meet, the closest of equals, or None."""
    met = []
    known = [(int(view), int(number)) for view, number in np.argwhere(np.isfinite(discs[..., 0]))]
    for one, two in combinations(known, 2):
        if one[0] != two[0]:
            point = reacquisition.agree(rig, discs, one, two, limit_px)
            if np.abs(point.point_m - MIDDLE_M).max() < STAGE_M:
                met.append(point)
    return min(met, key=lambda point: (-int(point.used.sum()), point.rms), default=None)
