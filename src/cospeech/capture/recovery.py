"""Finding a lost marker again: blobs of its colour, pairs of cameras, points that agree, lengths of bones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from cospeech.capture import blobs, disc
from cospeech.capture.camera import Camera, project
from cospeech.capture.colour import Mixer
from cospeech.capture.footage import Planes
from cospeech.capture.triangulate import consistent
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


@dataclass(frozen=True)
class Found:
    """A marker that was found: its point, the views (C,) it rests on, pixels (C, 2), their counts (C,), residual."""

    point_m: Floats
    used: npt.NDArray[np.bool_]
    pixels: Floats
    n_pixels: npt.NDArray[np.int64]
    rms: float


def search_radius_m(hidden_frames: int) -> float:
    """Return how far from its prediction a marker is sought after some frames without a sight."""
    return min(WIDEST_M, GROWTH_M * (hidden_frames + 1))


def seek(
    cameras: Sequence[Camera], packed: Floats, pictures: Sequence[Planes], mixer: Mixer, marker: int,
    expected_m: Floats, search_m: float, radius: Floats, owned: Floats, others_m: Floats, lengths: Lengths,
    limit_px: float,
) -> Found | None:  # fmt: skip
    """Return the marker where most views see a free disc of its colour that fits, or None.

    Parameters
    ----------
    expected_m, search_m : where the marker is sought, and how far around.
    radius : (C,) of its disc in pixels.
    owned : (M, C, 2) discs of the same colour that belong to other markers.
    others_m : (M, 3) the points known so far.
    """
    free = [
        discs(planes, camera, mixer, expected_m, search_m, float(radius[view]), owned[:, view])
        for view, (planes, camera) in enumerate(zip(pictures, cameras, strict=True))
    ]
    best: Found | None = None
    for a, b in combinations(range(len(cameras)), 2):
        for i in range(len(free[a])):
            for j in range(len(free[b])):
                candidate = agree(cameras, packed, free, (a, i), (b, j), limit_px)
                if candidate is None or np.linalg.norm(candidate.point_m - expected_m) > search_m:
                    continue
                placed = np.where(np.arange(len(NAMES))[:, None] == marker, candidate.point_m, np.nan)
                if not lengths.fit(placed, others_m)[marker]:
                    continue
                if best is None or _rank(candidate, expected_m) < _rank(best, expected_m):
                    best = candidate
    return best


def _rank(found: Found, expected_m: Floats) -> tuple[int, float]:
    return -int(found.used.sum()), float(np.linalg.norm(found.point_m - expected_m))


def discs(
    planes: Planes, camera: Camera, mixer: Mixer, expected_m: Floats, search_m: float, radius: float, owned: Floats
) -> Floats:
    """Return the free discs (n, 4) of one colour near a point: x, y, pixels, share seen; the largest first."""
    middle = project(camera, expected_m)
    reach = search_m * radius / RADIUS_M + radius
    width, height = camera.size_px
    if not np.isfinite(middle).all():
        return np.empty((0, 4))
    left, top = (int(max(0.0, value - reach)) for value in middle)
    right, bottom = (int(min(limit, value + reach + 1)) for limit, value in zip((width, height), middle, strict=True))
    if right - left < radius or bottom - top < radius:
        return np.empty((0, 4))
    box = (left, top, right, bottom)
    amount = blobs.shares(*planes, box, mixer.across, mixer.share)
    blob, count = blobs.label(amount, 2.0 * disc.FAINTEST)
    found = blobs.statistics(amount, blob, count, box)
    found = found[found[:, 2] > SMALLEST_BLOB * np.pi * radius**2]
    found = found[np.argsort(-found[:, 2], kind="stable")][:MOST_BLOBS]
    free = []
    for x, y, _ in found:
        u, v, pixels, share = disc.measure(*planes, width, mixer.across, mixer.share, x, y, radius, radius, True)
        if np.isfinite(u) and not (np.hypot(owned[:, 0] - u, owned[:, 1] - v) < radius).any():
            free.append((u, v, pixels, share))
    return np.array(free).reshape(-1, 4)


def agree(
    cameras: Sequence[Camera], packed: Floats, discs: Sequence[Floats],
    one: tuple[int, int], two: tuple[int, int], limit_px: float,
) -> Found | None:  # fmt: skip
    """Return the point of two discs with what other views add to it, or None where the two do not meet."""
    pixels = np.full((len(cameras), 2), np.nan)
    n_pixels = np.zeros(len(cameras), dtype=np.int64)

    def take(view: int, number: int) -> None:
        pixels[view] = discs[view][number, :2]
        n_pixels[view] = int(discs[view][number, 2])

    take(*one)
    take(*two)
    ones = np.ones(len(cameras))
    point, used, _ = consistent(packed, pixels, ones, limit_px)
    if not used.any():
        return None
    for view, camera in enumerate(cameras):
        if view in (one[0], two[0]) or not len(discs[view]):
            continue
        away = np.hypot(*(discs[view][:, :2] - project(camera, point)).T)
        if away.min() < 3.0 * limit_px:
            take(view, int(away.argmin()))
    point, used, rms = consistent(packed, pixels, ones, limit_px)
    return Found(point, used, np.where(used[:, None], pixels, np.nan), np.where(used, n_pixels, 0), rms)
