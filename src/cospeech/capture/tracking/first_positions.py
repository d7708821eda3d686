"""Initial marker positions in the first frame, from manual clicks or by colour and nominal pose.

Without clicks, the discs of each colour are detected in the whole images and triangulated over the views. The points
are then assigned to the markers so that the sum of distances to the nominal positions is minimal. The actor must
stand upright in the centre of the stage with arms hanging, facing z (Özkul 2012, 2.4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import linear_sum_assignment

from cospeech.capture.tracking import disc, reacquisition
from cospeech.capture.tracking.colour import Unmixer
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera, project
from cospeech.geometry.triangulate import packed, triangulate
from cospeech.motion.markers import MARKERS, NAMES, RADIUS_M

NOMINAL_M = {
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
"""Nominal marker positions on an adult of 1.75 m who stands at the origin with arms hanging, metres."""

OPTIONAL = ("back",)
"""Markers that need not be visible in two views in the first frame; they are acquired when they appear."""

MIDDLE_M = np.array([0.0, 0.95, 0.0])
STAGE_M = 1.3
"""Half-width of the search volume around ``MIDDLE_M``."""

FARTHEST_M = 0.35
"""Largest distance of a point from the nominal position of its marker."""

CLICKED_PX = 6.0
"""Largest reprojection error at which clicks on one marker are consistent."""

FOUND_RADII = 0.25
"""Largest reprojection error, in radii, at which discs belong to one marker."""

PAIR_COST_M = 0.1
"""Assignment penalty of a point that only two views see, relative to one that three or more see."""


def from_clicks(clicks: pd.DataFrame, cameras: Sequence[Camera], where: str) -> Floats:
    """Return the markers (M, 3) in the first frame, metres, triangulated from the clicks of frame 0.

    An optional marker that was not clicked in two views is placed at its nominal position.

    Raises
    ------
    UserError : if a marker is not clicked in two views, or the clicks on it contradict each other.
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
                f"{where}: marker {name} is clicked in {clicked[marker]} views of frame 0; click it in at least two"
            )
        if clicked[marker] >= 2 and np.isnan(points[marker, 0]):
            raise UserError(
                f"{where}: the clicks on marker {name} in frame 0 do not meet in one point; check them, and that "
                "left and right are not exchanged"
            )
    return _nominal_where_missing(points)


def find(
    pictures: Sequence[Planes], cameras: Sequence[Camera], unmixers: Mapping[str, Unmixer], where: str
) -> Floats:
    """Return the markers (M, 3) in the first frame, metres, detected in one image per camera.

    Raises
    ------
    UserError : if a marker is not found.
    """
    points = np.full((len(NAMES), 3), np.nan)
    for colour, unmixer in unmixers.items():
        members = [index for index, marker in enumerate(MARKERS) if marker.colour == colour]
        found, n_views = _points(pictures, cameras, unmixer)
        if not len(found):
            continue
        nominal = np.array([NOMINAL_M[NAMES[index]] for index in members])
        away = np.linalg.norm(nominal[:, None] - found[None], axis=2)
        cost = np.minimum(away, FARTHEST_M) + np.where(n_views == 2, PAIR_COST_M, 0.0)
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if away[row, column] < FARTHEST_M:
                points[members[row]] = found[column]
    missing = [name for index, name in enumerate(NAMES) if np.isnan(points[index, 0]) and name not in OPTIONAL]
    if len(missing) > len(NAMES) / 2:
        n_found = len(NAMES) - int(np.isnan(points[:, 0]).sum())
        raise UserError(
            f"{where}: {n_found} of {len(NAMES)} markers found in frame 0; the tracker needs an actor who wears "
            "15 coloured discs (docs/capture.md); if yours does, click them in two views of that frame"
        )
    if missing:
        raise UserError(f"{where}: {', '.join(missing)} not found in frame 0; click them in two views of that frame")
    return _nominal_where_missing(points)


def _nominal_where_missing(points: Floats) -> Floats:
    """Return the points with missing ones at their nominal positions, shifted to where the actor stands."""
    nominal = np.array([NOMINAL_M[name] for name in NAMES])
    shift = np.nanmean(points - nominal, axis=0)
    return np.where(np.isnan(points), nominal + shift, points)


def _points(pictures: Sequence[Planes], cameras: Sequence[Camera], unmixer: Unmixer) -> tuple[Floats, npt.NDArray]:
    """Return the points (n, 3) triangulated from discs of one colour, and their numbers of views (n,), descending."""
    discs, radii = np.full((len(cameras), reacquisition.MOST_BLOBS, 4), np.nan), []
    unknown, none = np.array(disc.UNKNOWN), np.empty((0, 2))
    for number, (planes, camera) in enumerate(zip(pictures, cameras, strict=True)):
        depth = np.linalg.norm(camera.place_m - MIDDLE_M)
        radius = float(np.sqrt(np.prod(camera.focal_px)) * RADIUS_M / depth)
        radii.append(radius)
        middle, reach = project(camera, MIDDLE_M), STAGE_M * radius / RADIUS_M
        found = reacquisition.free_discs(*planes, camera.size_px[0], *unmixer, middle, reach, radius, unknown, none)
        discs[number, : len(found)] = found
    rig, limit_px, chosen = packed(cameras), FOUND_RADII * float(np.mean(radii)), []
    # A disc belongs to one point only: remove it, and let the remaining discs form the next point.
    while (best := _best(rig, discs, limit_px)) is not None:
        chosen.append(best)
        for view in np.flatnonzero(best.used):
            discs[view, (discs[view, :, :2] == best.pixels[view]).all(axis=1)] = np.nan
    return (
        np.array([point.point_m for point in chosen]).reshape(-1, 3),
        np.array([point.used.sum() for point in chosen], dtype=int),
    )


def _best(rig: Floats, discs: Floats, limit_px: float) -> reacquisition.Candidate | None:
    """Return the point on which discs (C, n, 4) of the most views agree, with the least residual, or None."""
    met = []
    known = [(int(view), int(number)) for view, number in np.argwhere(np.isfinite(discs[..., 0]))]
    for one, two in combinations(known, 2):
        if one[0] != two[0]:
            point = reacquisition.point_from_pair(rig, discs, one, two, limit_px)
            if np.abs(point.point_m - MIDDLE_M).max() < STAGE_M:
                met.append(point)
    return min(met, key=lambda point: (-int(point.used.sum()), point.rms), default=None)
