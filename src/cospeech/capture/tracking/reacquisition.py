"""Finding lost markers again: blobs of their colour, pairs of cameras, points that agree, lengths of bones.

All lost markers of a colour are sought together: the free discs are combined into points, those of most views first,
each disc in one point, and the points are given to the markers so that the sum of costs is least. Better predicted
than wrong: what only two views show in part may be a chance meeting of rays, and counts near the prediction alone.
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
from cospeech.capture.tracking.colour import Mixer
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
"""Pairs of markers whose distance changes little."""

SLACK, SKULL_SLACK = 0.25, 0.1
"""By how much of itself the distance of a link may change, under skin and clothes, and on the bare skull."""

WIDEST_M = 0.6
GROWTH_M = 0.12
"""A lost marker is sought in a sphere around its prediction that grows by this with each frame, up to the widest."""

SMALLEST_BLOB = 0.25
"""Of the area of a disc."""

MOST_BLOBS = 12

PAIR_PART = 1 / 3
"""Two views that nobody can contradict must meet this much closer than three: share of the pixels that may miss."""

LIKE_SIZE = (0.64, 1.56)
"""A round blob of an area in this range, in areas of the expected disc, is a whole one nearer or farther away."""

NO_COST = 1e3
"""More than any cost of a point that may be a marker's."""

LARGEST_DISC = 1.08
"""A disc with more pixels than this share of what a marker would have at a place is nearer to its camera."""


@dataclass(frozen=True)
class Lengths:
    """The usual distances (M, M) of linked markers, metres, and by what share each may change; NaN if not linked."""

    usual_m: Floats
    slack: Floats

    def misfits(self, points_m: Floats) -> npt.NDArray[np.bool_]:
        """Return which pairs (M, M) of points (M, 3) are farther apart, or nearer, than their links allow."""
        away = np.linalg.norm(points_m[:, None] - points_m[None], axis=2)
        return np.asarray(np.abs(away / self.usual_m - 1.0) > self.slack)

    def held(self, places_m: Floats, points_m: Floats) -> Floats:
        """Return places (M, 3) of hidden markers, moved along a link to a known point (M, 3) where they break it.

        A hand is never lost farther away than its forearm reaches.
        """
        moved = places_m.copy()
        away = places_m[:, None] - points_m[None]
        length = np.linalg.norm(away, axis=2)
        for marker, other in np.argwhere(np.abs(length / self.usual_m - 1.0) > self.slack):
            part = self.usual_m[marker, other] / length[marker, other]
            moved[marker] = points_m[other] + part * away[marker, other]
        return moved


def lengths(points_m: Floats) -> Lengths:
    """Return the lengths of the links in one pose (M, 3)."""
    usual, slack = np.full((2, len(NAMES), len(NAMES)), np.nan)
    for a, b in LINKS:
        i, j = NAMES.index(a), NAMES.index(b)
        usual[i, j] = usual[j, i] = np.linalg.norm(points_m[i] - points_m[j])
        slack[i, j] = slack[j, i] = SKULL_SLACK if MARKERS[i].joint == MARKERS[j].joint == "head" else SLACK
    return Lengths(usual, slack)


class Found(NamedTuple):
    """A point (3,), the views (C,) it rests on if any, pixels (C, 2), counts (C,), shares seen (C,), residual."""

    point_m: Floats
    used: npt.NDArray[np.bool_]
    pixels: Floats
    n_pixels: npt.NDArray[np.int64]
    share_seen: Floats
    rms: float


class Lost(NamedTuple):
    """Lost markers (n,) of one colour.

    Where they are expected (n, 3), metres, and in the views (n, C, 2); how large their discs are (n, C), pixels; how
    far around they are sought (n,), and how far around two views suffice that see them in part (n,), metres; what
    whole discs of the colour show in the views (C, 2), ``usual`` in ``disc.measure``.
    """

    markers: npt.NDArray[np.int64]
    expected_m: Floats
    expected: Floats
    radius: Floats
    search_m: Floats
    near_m: Floats
    usual: Floats


def search_radius_m(hidden_frames: npt.NDArray[np.int64], unsure_m: Floats) -> Floats:
    """Return how far from its prediction a marker is sought after some frames (n,) without a sight.

    ``unsure_m`` (n,) is how far away it may be by what is known of its movement.
    """
    return np.minimum(WIDEST_M, np.maximum(GROWTH_M * (hidden_frames + 1), unsure_m))


def seek(
    cameras: Floats, widths: npt.NDArray[np.int64], pictures: Sequence[Planes], mixer: Mixer, lost: Lost,
    owned: Floats, others_m: Floats, lengths: Lengths, limit_px: float,
) -> dict[int, Found]:  # fmt: skip
    """Return the lost markers that are found.

    Parameters
    ----------
    cameras, widths : (C, 21) of ``triangulate.packed``, and the widths of their pictures.
    owned : (k, C, 2) where other markers of the same colour are seen.
    others_m : (M, 3) the points known so far, NaN for the others.
    """
    usual_m, slack = lengths.usual_m[lost.markers], lengths.slack[lost.markers]
    free = _free(widths, pictures, mixer, lost, owned)
    points: list[Found] = []
    # A disc that one point took is gone for the rest, which may then meet without it.
    while len(points) < len(lost.markers):
        found = _best(cameras, free, lost.expected_m, lost.search_m, lost.near_m, usual_m, slack, others_m, limit_px)
        if not found.used.any():
            break
        points.append(found)
        for view in np.flatnonzero(found.used):
            free[view, (free[view, :, :2] == found.pixels[view]).all(axis=1)] = np.nan
    cost = np.full((len(lost.markers), len(points)), np.inf)
    for row in range(len(cost)):
        for column, point in enumerate(points):
            cost[row, column] = _cost(
                point, lost.expected_m[row], lost.search_m[row], lost.near_m[row], usual_m[row], slack[row], others_m
            )
    pairs = zip(*linear_sum_assignment(np.minimum(cost, NO_COST)), strict=True)
    return {int(lost.markers[row]): points[column] for row, column in pairs if cost[row, column] < np.inf}


def _free(
    widths: npt.NDArray[np.int64], pictures: Sequence[Planes], mixer: Mixer, lost: Lost, owned: Floats
) -> Floats:
    """Return the free discs (C, n, 4) around all lost markers, each once; NaN where a view has fewer."""
    views = []
    for view, planes in enumerate(pictures):
        known = np.empty((0, 4))
        for index in range(len(lost.markers)):
            radius = lost.radius[index, view]
            reach = lost.search_m[index] * radius / RADIUS_M + radius
            taken = np.concatenate([owned[:, view], known[:, :2]])
            found = discs(
                *planes, widths[view], *mixer, lost.expected[index, view], reach, radius, lost.usual[view], taken
            )
            known = np.concatenate([known, found])
        views.append(known)
    free = np.full((len(views), max(len(known) for known in views), 4), np.nan)
    for view, known in enumerate(views):
        free[view, : len(known)] = known
    return free


@njit
def discs(
    y: Plane, cb: Plane, cr: Plane, width: int, across: Floats, share: Floats,
    middle: Floats, reach: float, radius: float, usual: Floats, owned: Floats,
) -> Floats:  # fmt: skip
    """Return the free discs (n, 4) of one colour around a pixel: x, y, pixels, share seen; the largest first.

    A disc is free where no pixel of ``owned`` (., 2) is within its radius.
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
        u, v, pixels, seen, _ = disc.measure(
            y, cb, cr, width, across, share, x_found, y_found, radius, radius, 0.0, (usual[0], usual[1]), LIKE_SIZE
        )
        mine = np.isfinite(u)
        for other in range(len(owned)):
            mine &= not np.hypot(owned[other, 0] - u, owned[other, 1] - v) < radius
        for other in range(count):  # two blobs may be parts of one disc
            mine &= not np.hypot(free[other, 0] - u, free[other, 1] - v) < radius
        if mine:
            free[count] = u, v, float(pixels), seen
            count += 1
    return free[:count]


@njit
def agree(cameras: Floats, discs: Floats, one: tuple[int, int], two: tuple[int, int], limit_px: float) -> Found:
    """Return the point of two discs with what other views add to it; no view is used where the two do not meet.

    Parameters
    ----------
    cameras : (C, 21) of ``triangulate.packed``.
    discs : (C, n, 4) of every view, NaN where there are fewer.
    one, two : view and number of each disc.
    """
    n_views = len(cameras)
    pixels, n_pixels, share_seen = np.full((n_views, 2), np.nan), np.zeros(n_views, np.int64), np.zeros(n_views)
    for view, number in (one, two):
        pixels[view], n_pixels[view] = discs[view, number, :2], int(discs[view, number, 2])
        share_seen[view] = discs[view, number, 3]
    ones, slope = np.ones(n_views), np.empty((2, 3))
    point, used, rms = consistent(cameras, pixels, ones, limit_px)
    if not used.any():
        return Found(point, used, pixels, n_pixels, share_seen, rms)
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
            pixels[view], n_pixels[view], share_seen[view] = np.nan, 0, 0.0
    return Found(point, used, pixels, n_pixels, share_seen, rms)


@njit
def _best(
    cameras: Floats, discs: Floats, expected_m: Floats, search_m: Floats, near_m: Floats,
    usual_m: Floats, slack: Floats, others_m: Floats, limit_px: float,
) -> Found:  # fmt: skip
    """Return the point on which most views agree, of equals the one that costs least as some lost marker (n,)."""
    n_views, n_discs = discs.shape[:2]
    best = Found(
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
                found = agree(cameras, discs, (a, i), (b, j), limit_px)
                more = found.used.sum() - best.used.sum()
                chance = found.used.sum() == 2 and found.rms > PAIR_PART * limit_px
                if more < 0 or not found.used.any() or chance:
                    continue
                cost = np.inf
                for lost in range(len(expected_m)):
                    own = _cost(
                        found, expected_m[lost], search_m[lost], near_m[lost], usual_m[lost], slack[lost], others_m
                    )
                    cost = min(cost, own)
                if cost < np.inf and (more > 0 or cost < least):
                    best, least = found, cost
    return best


@njit
def _cost(
    found: Found, expected_m: Floats, search_m: float, near_m: float, usual_m: Floats, slack: Floats, others_m: Floats
) -> float:
    """Return how ill a point fits a lost marker: its way from where it is expected, and its worst link, as shares.

    Infinite where it is too far away, or not as far from the others (M, 3) as the links (M,) say.
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
        misfit = abs(length / usual_m[other] - 1.0) / slack[other]
        if misfit > worst:  # not where there is no link
            worst = misfit
    return away / search_m + worst if worst <= 1.0 else np.inf
