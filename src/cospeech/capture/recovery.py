"""Finding a lost marker again: blobs of its colour, pairs of cameras, points that agree, lengths of bones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from cospeech.capture import blobs, disc
from cospeech.capture.blobs import Plane
from cospeech.capture.colour import Mixer
from cospeech.capture.footage import Planes
from cospeech.capture.triangulate import consistent, project_point
from cospeech.markers import MARKERS, NAMES, RADIUS_M

Floats = npt.NDArray[np.float64]

LINKS = (
    ("head_left", "head_right"), ("head_left", "head_front"), ("head_right", "head_front"),
    ("chest", "left_shoulder"), ("chest", "right_shoulder"), ("back", "left_shoulder"), ("back", "right_shoulder"),
    ("chest", "back"), ("left_shoulder", "right_shoulder"),
    ("left_shoulder", "left_elbow"), ("right_shoulder", "right_elbow"),
    ("left_elbow", "left_hand"), ("right_elbow", "right_hand"),
    ("left_leg", "right_leg"),
)  # fmt: skip
"""Pairs of markers whose distance changes little."""

SLACK, LIMB_SLACK = 0.25, 0.5
"""By how much of itself the distance of a link may change, within one part of the body and along a limb."""

WIDEST_M = 0.6
GROWTH_M = 0.12
"""A lost marker is sought in a sphere around its prediction that grows by this with each frame, up to the widest."""

SMALLEST_BLOB = 0.25
"""Of the area of a disc."""

MOST_BLOBS = 12

LARGEST_DISC = 1.25
"""A disc with more pixels than this share of what a marker would have at a place is nearer to its camera."""


@dataclass(frozen=True)
class Lengths:
    """The usual distances (M, M) of linked markers, metres, and by what share each may change; NaN if not linked."""

    usual_m: Floats
    slack: Floats

    def fit(self, points_m: Floats, others_m: Floats) -> npt.NDArray[np.bool_]:
        """Return which markers (M,) may be at ``points_m`` (M, 3), given where the others (M, 3) are, NaN unknown."""
        away = np.linalg.norm(points_m[:, None] - others_m[None], axis=2)
        return ~(np.abs(away / self.usual_m - 1.0) > self.slack).any(axis=1)


def lengths(points_m: Floats) -> Lengths:
    """Return the lengths of the links in one pose (M, 3)."""
    usual, slack = np.full((2, len(NAMES), len(NAMES)), np.nan)
    for a, b in LINKS:
        i, j = NAMES.index(a), NAMES.index(b)
        usual[i, j] = usual[j, i] = np.linalg.norm(points_m[i] - points_m[j])
        slack[i, j] = slack[j, i] = SLACK if MARKERS[i].joint == MARKERS[j].joint else LIMB_SLACK
    return Lengths(usual, slack)


class Found(NamedTuple):
    """A point (3,), the views (C,) it rests on, none if there is none, pixels (C, 2), their counts (C,), residual."""

    point_m: Floats
    used: npt.NDArray[np.bool_]
    pixels: Floats
    n_pixels: npt.NDArray[np.int64]
    rms: float


def search_radius_m(hidden_frames: int) -> float:
    """Return how far from its prediction a marker is sought after some frames without a sight."""
    return min(WIDEST_M, GROWTH_M * (hidden_frames + 1))


def seek(
    cameras: Floats, widths: Sequence[int], pictures: Sequence[Planes], mixer: Mixer, marker: int,
    expected_m: Floats, search_m: float, expected: Floats, radius: Floats, owned: Floats, rivals: Floats,
    others_m: Floats, lengths: Lengths, limit_px: float,
) -> Found:  # fmt: skip
    """Return the marker where most views see a free disc of its colour that fits; no view is used if there is none.

    Parameters
    ----------
    cameras, widths : (C, 21) of ``triangulate.packed``, and the widths of their pictures.
    expected_m, search_m : where the marker is sought, and how far around.
    expected, radius : (C, 2) and (C,) where that is seen, and how large its disc is, pixels.
    owned : (M, C, 2) discs of the same colour that belong to other markers.
    rivals : (M, C, 2) where other lost markers of the same colour are expected.
    others_m : (M, 3) the points known so far.
    """
    free = np.full((len(cameras), MOST_BLOBS, 4), np.nan)
    for view, planes in enumerate(pictures):
        reach = search_m * radius[view] / RADIUS_M + radius[view]
        found = discs(
            *planes, widths[view], *mixer, expected[view], reach, radius[view], owned[:, view], rivals[:, view]
        )
        free[view, : len(found)] = found
    return _best(
        cameras, free, expected_m, search_m, lengths.usual_m[marker], lengths.slack[marker], others_m, limit_px
    )


@numba.njit(cache=True)
def discs(
    y: Plane, cb: Plane, cr: Plane, width: int, across: Floats, share: Floats,
    middle: Floats, reach: float, radius: float, owned: Floats, rivals: Floats,
) -> Floats:  # fmt: skip
    """Return the free discs (n, 4) of one colour around a pixel: x, y, pixels, share seen; the largest first.

    A disc is free where no pixel of ``owned`` (., 2) is within its radius, and where none of ``rivals`` (., 2) is
    nearer to it than ``middle``: of the lost markers of a colour, a disc belongs to the one expected nearest.
    """
    nothing = np.empty((0, 4))
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
        u, v, pixels, seen = disc.measure(y, cb, cr, width, across, share, x_found, y_found, radius, radius, True)
        mine = np.isfinite(u)
        for other in range(len(owned)):
            mine &= not np.hypot(owned[other, 0] - u, owned[other, 1] - v) < radius
        for other in range(len(rivals)):
            away = np.hypot(rivals[other, 0] - u, rivals[other, 1] - v)
            mine &= not away < np.hypot(middle[0] - u, middle[1] - v)
        if mine:
            free[count] = u, v, float(pixels), seen
            count += 1
    return free[:count]


@numba.njit(cache=True)
def agree(cameras: Floats, discs: Floats, one: tuple[int, int], two: tuple[int, int], limit_px: float) -> Found:
    """Return the point of two discs with what other views add to it; no view is used where the two do not meet.

    Parameters
    ----------
    cameras : (C, 21) of ``triangulate.packed``.
    discs : (C, n, 4) of every view, NaN where there are fewer.
    one, two : view and number of each disc.
    """
    n_views = len(cameras)
    pixels, n_pixels = np.full((n_views, 2), np.nan), np.zeros(n_views, dtype=np.int64)
    for view, number in (one, two):
        pixels[view], n_pixels[view] = discs[view, number, :2], int(discs[view, number, 2])
    ones, slope = np.ones(n_views), np.empty((2, 3))
    point, used, rms = consistent(cameras, pixels, ones, limit_px)
    if not used.any():
        return Found(point, used, pixels, n_pixels, rms)
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
    point, used, rms = consistent(cameras, pixels, ones, limit_px)
    # The rays of two markers may meet where there is none. Their discs are then too large for the place, or too
    # small, but small they may also be because something hides them.
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
            pixels[view], n_pixels[view] = np.nan, 0
    return Found(point, used, pixels, n_pixels, rms)


@numba.njit(cache=True)
def _best(
    cameras: Floats, discs: Floats, expected_m: Floats, search_m: float,
    usual_m: Floats, slack: Floats, others_m: Floats, limit_px: float,
) -> Found:  # fmt: skip
    """Return the point on which most views agree, of equals the nearest to where it is expected."""
    n_views, n_discs = discs.shape[:2]
    best = Found(
        np.full(3, np.nan), np.zeros(n_views, np.bool_), discs[:, 0, :2].copy(), np.zeros(n_views, np.int64), 0.0
    )
    nearest = np.inf
    for pair in range(n_views * n_views):
        a, b = pair // n_views, pair % n_views
        for i in range(n_discs if a < b else 0):
            for j in range(n_discs):
                if np.isnan(discs[a, i, 0]) or np.isnan(discs[b, j, 0]):
                    continue
                found = agree(cameras, discs, (a, i), (b, j), limit_px)
                away = np.sqrt(np.sum((found.point_m - expected_m) ** 2))
                if not away <= search_m or not _fits(found.point_m, others_m, usual_m, slack):
                    continue
                more = found.used.sum() - best.used.sum()
                if more > 0 or (more == 0 and away < nearest):
                    best, nearest = found, away
    return best


@numba.njit(cache=True)
def _fits(point_m: Floats, others_m: Floats, usual_m: Floats, slack: Floats) -> bool:
    """Return whether a point (3,) is as far from the others (M, 3) as its links (M,) say."""
    for other in range(len(others_m)):
        away = np.sqrt(np.sum((point_m - others_m[other]) ** 2))
        if abs(away / usual_m[other] - 1.0) > slack[other]:
            return False
    return True
