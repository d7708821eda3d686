"""Reacquisition of lost markers from blobs of their colour, triangulation and bone lengths.

All lost markers of a colour are reacquired together. Discs that no other marker claims are combined into candidate
points, those seen by the most views first, with each disc in one point only. The candidates are then assigned to the
markers so that the total cost is minimal. A predicted position is better than a wrong one: a point from two partly
occluded discs may be a chance intersection of rays, and is accepted only close to the prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from cospeech.capture.tracking import blobs, disc
from cospeech.capture.tracking.blobs import Plane
from cospeech.capture.tracking.colour import Unmixer
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.geometry.triangulate import consistent, project_point
from cospeech.kernels.jit import njit
from cospeech.motion.markers import MARKERS, NAMES, RADIUS_M

LINKS = (
    ("head_left", "head_right"), ("head_left", "head_front"), ("head_right", "head_front"),
    ("chest", "left_shoulder"), ("chest", "right_shoulder"), ("back", "left_shoulder"), ("back", "right_shoulder"),
    ("chest", "back"), ("left_shoulder", "right_shoulder"),
    ("left_shoulder", "left_elbow"), ("right_shoulder", "right_elbow"),
    ("left_elbow", "left_hand"), ("right_elbow", "right_hand"),
    ("left_leg", "right_leg"),
)  # fmt: skip
"""Pairs of markers whose distance is nearly constant."""

SLACK, SKULL_SLACK = 0.25, 0.1
"""Relative tolerance of the length of a link: with soft tissue and clothing, and on the skull."""

WIDEST_M = 0.6
GROWTH_M = 0.12
"""Radius of the search sphere around the prediction of a lost marker: its maximum, and its growth per frame."""

SMALLEST_BLOB = 0.25
"""Minimum area of a blob, relative to the expected disc."""

MOST_BLOBS = 12

PAIR_PART = 1 / 3
"""Reprojection limit of a point from two views, which no third one can contradict, relative to the usual limit."""

LIKE_SIZE = (0.64, 1.56)
"""Area range, relative to the expected disc, in which a round blob is a whole disc at another depth."""

NO_COST = 1e3
"""Larger than any cost of an admissible assignment."""

LARGEST_DISC = 1.08
"""Largest area of a disc relative to a marker at the point; a larger disc must be closer to the camera."""


@dataclass(frozen=True)
class LinkLengths:
    """The nominal distances (M, M) of linked markers in metres and their relative tolerances; NaN if not linked."""

    nominal_m: Floats
    slack: Floats

    def violations(self, points_m: Floats) -> npt.NDArray[np.bool_]:
        """Return which pairs (M, M) of points (M, 3) are farther apart or closer than their links allow."""
        away = np.linalg.norm(points_m[:, None] - points_m[None], axis=2)
        return np.asarray(np.abs(away / self.nominal_m - 1.0) > self.slack)

    def clamp(self, places_m: Floats, points_m: Floats) -> Floats:
        """Return positions (M, 3) of hidden markers, moved along links to known points (M, 3) that they violate.

        This keeps a lost hand within reach of its forearm.
        """
        moved = places_m.copy()
        away = places_m[:, None] - points_m[None]
        length = np.linalg.norm(away, axis=2)
        for marker, other in np.argwhere(np.abs(length / self.nominal_m - 1.0) > self.slack):
            part = self.nominal_m[marker, other] / length[marker, other]
            moved[marker] = points_m[other] + part * away[marker, other]
        return moved


def link_lengths(points_m: Floats) -> LinkLengths:
    """Return the lengths of the links in one pose (M, 3)."""
    nominal_m, slack = np.full((2, len(NAMES), len(NAMES)), np.nan)
    for a, b in LINKS:
        i, j = NAMES.index(a), NAMES.index(b)
        nominal_m[i, j] = nominal_m[j, i] = np.linalg.norm(points_m[i] - points_m[j])
        slack[i, j] = slack[j, i] = SKULL_SLACK if MARKERS[i].joint == MARKERS[j].joint == "head" else SLACK
    return LinkLengths(nominal_m, slack)


class Candidate(NamedTuple):
    """A candidate point for a lost marker.

    The point (3,), the views (C,) that it is triangulated from (none if they do not agree), the discs there: pixels
    (C, 2), numbers of pixels (C,) and visible fractions (C,); and the RMS residual in pixels.
    """

    point_m: Floats
    used: npt.NDArray[np.bool_]
    pixels: Floats
    n_pixels: npt.NDArray[np.int64]
    share_seen: Floats
    rms: float


class Lost(NamedTuple):
    """Lost markers (n,) of one colour.

    Attributes
    ----------
    markers : (n,) indices of the markers.
    expected_m, expected : expected positions in the world (n, 3), metres, and in the views (n, C, 2), pixels.
    radius : (n, C) radii of their discs, pixels.
    search_m : (n,) search radius, metres.
    near_m : (n,) radius within which two views with partly occluded discs are enough, metres.
    reference : (C, 2) reference of whole discs of the colour in each view, see ``disc.measure``.
    """

    markers: npt.NDArray[np.int64]
    expected_m: Floats
    expected: Floats
    radius: Floats
    search_m: Floats
    near_m: Floats
    reference: Floats


def search_radius_m(hidden_frames: npt.NDArray[np.int64], unsure_m: Floats) -> Floats:
    """Return the search radius (n,) around the predictions of markers hidden for a number of frames (n,), metres.

    ``unsure_m`` (n,) is the uncertainty of the predictions.
    """
    return np.minimum(WIDEST_M, np.maximum(GROWTH_M * (hidden_frames + 1), unsure_m))


def reacquire(
    cameras: Floats, widths: npt.NDArray[np.int64], pictures: Sequence[Planes], unmixer: Unmixer, lost: Lost,
    claimed: Floats, others_m: Floats, lengths: LinkLengths, limit_px: float,
) -> dict[int, Candidate]:  # fmt: skip
    """Return the lost markers that were reacquired, by their index.

    Parameters
    ----------
    cameras, widths : cameras (C, 21) as from ``triangulate.packed``, and the widths of their images.
    claimed : (k, C, 2) pixels of other markers of the same colour.
    others_m : (M, 3) the points known so far, NaN for the rest.
    limit_px : largest reprojection error.
    """
    nominal_m, slack = lengths.nominal_m[lost.markers], lengths.slack[lost.markers]
    free = _free(widths, pictures, unmixer, lost, claimed)
    points: list[Candidate] = []
    # A disc belongs to one point only: remove it, and let the remaining discs form the next point.
    while len(points) < len(lost.markers):
        found = _best(
            cameras, free, lost.expected_m, lost.search_m, lost.near_m, nominal_m, slack, others_m, limit_px
        )
        if not found.used.any():
            break
        points.append(found)
        for view in np.flatnonzero(found.used):
            free[view, (free[view, :, :2] == found.pixels[view]).all(axis=1)] = np.nan
    cost = np.full((len(lost.markers), len(points)), np.inf)
    for row in range(len(cost)):
        for column, point in enumerate(points):
            cost[row, column] = _cost(
                point,
                lost.expected_m[row],
                lost.search_m[row],
                lost.near_m[row],
                nominal_m[row],
                slack[row],
                others_m,
            )
    pairs = zip(*linear_sum_assignment(np.minimum(cost, NO_COST)), strict=True)
    return {int(lost.markers[row]): points[column] for row, column in pairs if cost[row, column] < np.inf}


def _free(
    widths: npt.NDArray[np.int64], pictures: Sequence[Planes], unmixer: Unmixer, lost: Lost, claimed: Floats
) -> Floats:
    """Return the free discs (C, n, 4) around all lost markers without duplicates, padded with NaN."""
    views = []
    for view, planes in enumerate(pictures):
        known = np.empty((0, 4))
        for index in range(len(lost.markers)):
            radius = lost.radius[index, view]
            reach = lost.search_m[index] * radius / RADIUS_M + radius
            taken = np.concatenate([claimed[:, view], known[:, :2]])
            middle, reference = lost.expected[index, view], lost.reference[view]
            found = free_discs(*planes, widths[view], *unmixer, middle, reach, radius, reference, taken)
            known = np.concatenate([known, found])
        views.append(known)
    free = np.full((len(views), max(len(known) for known in views), 4), np.nan)
    for view, known in enumerate(views):
        free[view, : len(known)] = known
    return free


@njit
def free_discs(
    y: Plane, cb: Plane, cr: Plane, width: int, across: Floats, share: Floats,
    middle: Floats, reach: float, radius: float, reference: Floats, claimed: Floats,
) -> Floats:  # fmt: skip
    """Return the free discs (n, 4) of one colour around a pixel, largest first: x, y, pixels, visible fraction.

    A disc is free if no pixel of ``claimed`` (., 2) lies within its radius.
    """
    nothing = np.empty((0, 4))
    level, inset = reference
    if not np.isfinite(middle).all():
        return nothing
    left, top = int(max(0.0, middle[0] - reach)), int(max(0.0, middle[1] - reach))
    right, bottom = int(min(width, middle[0] + reach + 1)), int(min(y.shape[0], middle[1] + reach + 1))
    if right - left < radius or bottom - top < radius:
        return nothing
    step = max(1, int(radius / 2.0))
    found = blobs.find(y, cb, cr, (left, top, right, bottom), across, share, 2.0 * disc.FAINTEST, step)
    found = found[found[:, 2] > SMALLEST_BLOB * np.pi * radius**2]
    found = found[np.argsort(-found[:, 2], kind="mergesort")][:MOST_BLOBS]
    free, count = np.empty((len(found), 4)), 0
    for x_found, y_found, _ in found:
        u, v, pixels, seen, _ = disc.measure(
            y, cb, cr, width, across, share, x_found, y_found, radius, radius, 0.0, (level, inset), LIKE_SIZE
        )
        mine = np.isfinite(u)
        for other in range(len(claimed)):
            mine &= not np.hypot(claimed[other, 0] - u, claimed[other, 1] - v) < radius
        for other in range(count):  # two blobs may be parts of one disc
            mine &= not np.hypot(free[other, 0] - u, free[other, 1] - v) < radius
        if mine:
            free[count] = u, v, float(pixels), seen
            count += 1
    return free[:count]


@njit
def point_from_pair(
    cameras: Floats, discs: Floats, one: tuple[int, int], two: tuple[int, int], limit_px: float
) -> Candidate:
    """Return the point triangulated from two discs and from discs of other views that agree with them.

    If the two discs do not agree, no view is used.

    Parameters
    ----------
    cameras : (C, 21) as from ``triangulate.packed``.
    discs : (C, n, 4) discs in each view, padded with NaN.
    one, two : view and index of each disc.
    """
    n_views = len(cameras)
    pixels, n_pixels, share_seen = np.full((n_views, 2), np.nan), np.zeros(n_views, np.int64), np.zeros(n_views)
    for view, number in (one, two):
        pixels[view], n_pixels[view] = discs[view, number, :2], int(discs[view, number, 2])
        share_seen[view] = discs[view, number, 3]
    ones, slope = np.ones(n_views), np.empty((2, 3))
    point, used, rms = consistent(cameras, pixels, ones, limit_px)
    if not used.any():
        return Candidate(point, used, pixels, n_pixels, share_seen, rms)
    for view in range(n_views):
        if view in (one[0], two[0]):
            continue
        x, y, _ = project_point(cameras[view], point, slope)
        nearest = 3.0 * limit_px
        for number in range(discs.shape[1]):
            away = np.hypot(discs[view, number, 0] - x, discs[view, number, 1] - y)
            if away < nearest:
                nearest = away
                pixels[view], n_pixels[view] = discs[view, number, :2], int(discs[view, number, 2])
                share_seen[view] = discs[view, number, 3]
    point, used, rms = consistent(cameras, pixels, ones, limit_px)
    # Rays to two different markers may intersect where there is no marker. Their discs are then too large or too
    # small for a marker at that point; but a disc may also be small because it is partly occluded.
    fits = True
    for view in range(n_views):
        if used[view] and used.sum() == 2:
            _, _, depth = project_point(cameras[view], point, slope)
            area = np.pi * cameras[view, 12] * cameras[view, 13] * (RADIUS_M / depth) ** 2
            fits &= n_pixels[view] <= LARGEST_DISC * area
    if not fits:
        point[:], used[:], rms = np.nan, False, np.nan
    for view in range(n_views):
        if not used[view]:
            pixels[view], n_pixels[view], share_seen[view] = np.nan, 0, 0.0
    return Candidate(point, used, pixels, n_pixels, share_seen, rms)


@njit
def _best(
    cameras: Floats, discs: Floats, expected_m: Floats, search_m: Floats, near_m: Floats,
    nominal_m: Floats, slack: Floats, others_m: Floats, limit_px: float,
) -> Candidate:  # fmt: skip
    """Return the point on which the most views agree; among equals, that with the least cost for a lost marker."""
    n_views, n_discs = discs.shape[:2]
    best = Candidate(
        np.full(3, np.nan), np.zeros(n_views, np.bool_), np.full((n_views, 2), np.nan),
        np.zeros(n_views, np.int64), np.zeros(n_views), np.nan,
    )  # fmt: skip
    least = np.inf
    for pair in range(n_views * n_views):
        a, b = pair // n_views, pair % n_views
        for i in range(n_discs if a < b else 0):
            for j in range(n_discs):
                if np.isnan(discs[a, i, 0]) or np.isnan(discs[b, j, 0]):
                    continue
                found = point_from_pair(cameras, discs, (a, i), (b, j), limit_px)
                more = found.used.sum() - best.used.sum()
                chance = found.used.sum() == 2 and found.rms > PAIR_PART * limit_px
                if more < 0 or not found.used.any() or chance:
                    continue
                cost = np.inf
                for lost in range(len(expected_m)):
                    own = _cost(
                        found, expected_m[lost], search_m[lost], near_m[lost], nominal_m[lost], slack[lost], others_m
                    )
                    cost = min(cost, own)
                if cost < np.inf and (more > 0 or cost < least):
                    best, least = found, cost
    return best


@njit
def _cost(
    found: Candidate,
    expected_m: Floats,
    search_m: float,
    near_m: float,
    nominal_m: Floats,
    slack: Floats,
    others_m: Floats,
) -> float:
    """Return the cost of a point for a lost marker: relative distance from the prediction plus worst link deviation.

    The cost is infinite if the point is too far away, or violates a link (M,) to one of the others (M, 3).
    """
    in_part = False
    for view in range(len(found.used)):
        in_part |= found.used[view] and found.share_seen[view] < disc.WELL_SEEN
    away = np.sqrt(np.sum((found.point_m - expected_m) ** 2))
    if not away <= (near_m if in_part and found.used.sum() == 2 else search_m):
        return np.inf
    worst = 0.0
    for other in range(len(others_m)):
        length = np.sqrt(np.sum((found.point_m - others_m[other]) ** 2))
        misfit = abs(length / nominal_m[other] - 1.0) / slack[other]
        if misfit > worst:  # False where there is no link, as the misfit is NaN
            worst = misfit
    return away / search_m + worst if worst <= 1.0 else np.inf
