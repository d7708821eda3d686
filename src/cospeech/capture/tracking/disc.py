"""Centre of a marker's disc, fully visible or partly occluded.

The centre of a fully visible disc is the mean of its pixels, weighted by their coverage. A partly occluded disc is
fitted by a circle of known radius: pairs of points on its outline propose centres, the centre with the most outline
points on its circle wins, and Gauss-Newton with Tukey weights refines it. Occlusion only cuts into a disc, so no
outline may lie outside the circle.

The outline is the contour at half the colour level of fully visible discs, and its radius is theirs. Half the level
of the visible part would be wrong: if the centre of the disc, which is brightest, is hidden, the outline would move
outwards by a third of a pixel or more.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.capture.tracking.blobs import Plane, label, shares
from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

FAINTEST = 0.15
"""Minimum fraction of a marker's colour (1 is fully lit) to stand out from noise."""

ON_CIRCLE_PX = 0.5
"""Largest distance from the circle at which an outline point counts as lying on it."""

UNKNOWN = (0.0, 0.12)
"""Reference (see ``measure``) until a whole disc is seen: unknown level, and an outline drawn inwards by blur."""

DIMMEST = 1.5
"""Largest assumed ratio of the level of whole discs to that of an occluded one; beyond it, the disc is in shade."""

WHOLE = (0.97, 1.08)
"""Range of the area of a whole disc, relative to that of the expected outline."""

ROUND = 1.15
"""Largest ratio of the principal second moments of a whole disc."""

LEAST_ARC = 0.27
"""Minimum visible fraction of a circle's outline that determines its centre."""

WELL_SEEN = 0.6
"""Visible fraction of the outline from which a disc is centred nearly as precisely as a whole one."""

FEWEST_PIXELS = 6

PROPOSERS = 12
"""Number of outline points whose pairs propose centres."""


LOWEST, HIGHEST, BINS = -0.5, 1.5, 400
"""Range and number of bins of the histogram of colour fractions."""

STRAY_COST = 1.5
"""Penalty of a proposed centre, in outline points, per pixel of distance from the expected centre."""


@njit
def _levels(amount: Floats, radius: float) -> tuple[float, float]:
    """Return the colour level around and inside the disc: the medians of the dark and of the bright pixels.

    The two are separated by thresholds relative to the level that a fifth of the disc's area exceeds. All levels are
    read from a histogram.
    """
    count = np.zeros(BINS, dtype=np.int64)
    for row in range(amount.shape[0]):
        for column in range(amount.shape[1]):
            place = int((amount[row, column] - LOWEST) * BINS / (HIGHEST - LOWEST))
            count[min(max(place, 0), BINS - 1)] += 1
    bright, above = BINS - 1, count[BINS - 1]
    while above < 0.2 * np.pi * radius * radius and bright > 0:
        bright -= 1
        above += count[bright]
    top = LOWEST + (bright + 0.5) * (HIGHEST - LOWEST) / BINS
    light = int((top / 2.0 - LOWEST) * BINS / (HIGHEST - LOWEST))
    dark = int((top / 4.0 - LOWEST) * BINS / (HIGHEST - LOWEST))
    return _median(count, 0, dark), _median(count, light, BINS)


@njit
def _median(count: npt.NDArray[np.int64], first: int, end: int) -> float:
    """Return the median of a histogram of colour fractions over the bins ``first`` to ``end`` (exclusive)."""
    half, below = np.sum(count[first:end]) / 2.0, 0.0
    for place in range(first, end):
        if count[place] > 0 and below + count[place] >= half:
            return LOWEST + (place + (half - below) / count[place]) * (HIGHEST - LOWEST) / BINS
        below += count[place]
    return LOWEST


@njit
def _choose(blob: npt.NDArray[np.int32], count: int, x: float, y: float, radius: float) -> int:
    """Return the label of the blob that best covers the expected disc (close pixels weigh more), or 0 for none."""
    score = np.zeros(count + 1)
    for row in range(blob.shape[0]):
        for column in range(blob.shape[1]):
            if blob[row, column] > 0:
                square = ((column - x) ** 2 + (row - y) ** 2) / (radius * radius)
                score[blob[row, column]] += 1.0 / (1.0 + square * square)
    return int(np.argmax(score))


@njit
def _outline(amount: Floats, blob: npt.NDArray[np.int32], number: int, half: float) -> Floats:
    """Return the outline (n, 4) of a blob at the level ``half``: x, y, and the direction to the inside."""
    height, width = amount.shape
    points = np.empty((2 * height * width, 4))
    n = 0
    for row in range(height):
        for column in range(width):
            if blob[row, column] != number:
                continue
            for side in range(4):
                down, across = (side == 0) - (side == 1) + 0.0, (side == 2) - (side == 3) + 0.0
                i, j = row + int(down), column + int(across)
                if 0 <= i < height and 0 <= j < width and amount[i, j] < half:
                    inside, outside = amount[row, column], amount[i, j]
                    part = (inside - half) / (inside - outside)
                    points[n, 0], points[n, 1] = column + part * across, row + part * down
                    points[n, 2], points[n, 3] = -across, -down
                    n += 1
    return points[:n]


@njit
def _support(points: Floats, x: float, y: float, radius: float, least: float) -> float:
    """Return the number of outline points on the circle, with a penalty for those outside it.

    Counting stops early when the result can no longer reach ``least``.
    """
    total, inner, outer = 0.0, max(0.0, radius - ON_CIRCLE_PX) ** 2, (radius + ON_CIRCLE_PX) ** 2
    for k in range(len(points)):
        if total + len(points) - k < least:
            break
        dx, dy = x - points[k, 0], y - points[k, 1]
        square = dx * dx + dy * dy
        if square >= outer:
            total -= 0.25
        elif square > inner and dx * points[k, 2] + dy * points[k, 3] > 0.0:
            total += 1.0 - ((np.sqrt(square) - radius) / ON_CIRCLE_PX) ** 2
    return total


@njit
def _propose(
    points: Floats, radius: float, x: float, y: float, reach: float, rival: tuple[float, float]
) -> tuple[float, float]:
    """Return the best centre within ``reach`` of (x, y) among those that pairs of outline points propose.

    Centres close to ``rival``, which may be NaN, are skipped.
    """
    best, best_x, best_y = -np.inf, np.nan, np.nan
    step = max(1, len(points) // PROPOSERS)
    for a in range(0, len(points), step):
        for b in range(a + step, len(points), step):
            dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
            square = dx * dx + dy * dy
            if square < 0.5 * radius * radius or square > 4.0 * radius * radius:
                continue
            height = np.sqrt((radius * radius - square / 4.0) / square)
            for side in (-1.0, 1.0):
                u = (points[a, 0] + points[b, 0]) / 2.0 - side * height * dy
                v = (points[a, 1] + points[b, 1]) / 2.0 + side * height * dx
                stray = np.hypot(u - x, v - y)
                if stray > reach or np.hypot(u - rival[0], v - rival[1]) < ON_CIRCLE_PX:
                    continue
                cost = STRAY_COST * stray
                score = _support(points, u, v, radius, best + cost) - cost
                if score > best:
                    best, best_x, best_y = score, u, v
    return best_x, best_y


@njit
def _settle(points: Floats, radius: float, x: float, y: float) -> tuple[float, float, float]:
    """Refine the centre of a circle of known radius; return it, and the fraction of the circle covered by outline."""
    near = 0.0
    for _ in range(6):
        a, b, c, right_x, right_y, near = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(len(points)):
            dx, dy = points[k, 0] - x, points[k, 1] - y
            distance = np.sqrt(dx * dx + dy * dy)
            away = distance - radius
            if abs(away) >= ON_CIRCLE_PX or distance == 0.0 or dx * points[k, 2] + dy * points[k, 3] > 0.0:
                continue
            weight = (1.0 - (away / (ON_CIRCLE_PX)) ** 2) ** 2
            dx, dy = dx / distance, dy / distance
            a, b, c = a + weight * dx * dx, b + weight * dx * dy, c + weight * dy * dy
            right_x, right_y = right_x + weight * away * dx, right_y + weight * away * dy
            near += weight * (abs(dx * points[k, 2]) + abs(dy * points[k, 3]))  # length of outline per crossing
        determinant = a * c - b * b
        if determinant < 1e-6 * (a + c) ** 2 or near == 0.0:
            return np.nan, np.nan, 0.0
        x += (c * right_x - b * right_y) / determinant
        y += (a * right_y - b * right_x) / determinant
    return x, y, min(1.0, near / (2.0 * np.pi * radius))


@njit
def _fit(points: Floats, radius: float, x: float, y: float, reach: float) -> tuple[float, float, float]:
    """Return the centre of the circle of known radius expected at (x, y), and the visible fraction of its outline.

    If a narrow strip of a disc is occluded, its outline nearly fits a second circle that lacks a strip on the
    opposite side. Both circles are refined before the better one is chosen.
    """
    best, best_x, best_y, best_arc = -np.inf, np.nan, np.nan, 0.0
    for _ in range(2):
        u, v = _propose(points, radius, x, y, reach, (best_x, best_y))
        if np.isnan(u):
            break
        u, v, arc = _settle(points, radius, u, v)
        if np.isnan(u):
            break
        score = _support(points, u, v, radius, -np.inf) - STRAY_COST * np.hypot(u - x, v - y)
        if score > best:
            best, best_x, best_y, best_arc = score, u, v, arc
    return best_x, best_y, best_arc


@njit
def _moments(
    amount: Floats, blob: npt.NDArray[np.int32], number: int, edge: float, contrast: float
) -> tuple[int, float, float, float, float]:
    """Return number of pixels, area, centroid x and y, and ratio of principal second moments (1 if round) of a blob.

    Pixels are weighted by their coverage, including the adjacent pixels just outside the blob.
    """
    area, mean_x, mean_y, xx, xy, yy, pixels = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    height, width = blob.shape
    for row in range(height):
        for column in range(width):
            weight = min(1.0, 0.5 + 2.0 * (amount[row, column] - edge) / contrast)
            if weight <= 0.0:
                continue
            mine = blob[row, column] == number
            pixels += mine
            for side in range(4):
                i, j = row + (side == 0) - (side == 1), column + (side == 2) - (side == 3)
                mine = mine or (0 <= i < height and 0 <= j < width and blob[i, j] == number)
            if mine:
                area += weight
                mean_x, mean_y = mean_x + weight * column, mean_y + weight * row
                xx, xy, yy = xx + weight * column**2, xy + weight * column * row, yy + weight * row**2
    if pixels == 0:
        return 0, 0.0, np.nan, np.nan, np.inf
    mean_x, mean_y = mean_x / area, mean_y / area
    xx, xy, yy = xx / area - mean_x**2, xy / area - mean_x * mean_y, yy / area - mean_y**2
    apart = np.sqrt((xx - yy) ** 2 + 4.0 * xy * xy)
    return pixels, area, mean_x, mean_y, (xx + yy + apart) / max(xx + yy - apart, 1e-9)


@njit
def measure(
    y: Plane, cb: Plane, cr: Plane, width: int, across: Floats, share: Floats,
    expected_x: float, expected_y: float, radius: float, reach: float, least: float,
    reference: tuple[float, float] = UNKNOWN, whole: tuple[float, float] = WHOLE,
) -> tuple[float, float, int, float, tuple[float, float]]:  # fmt: skip
    """Return x and y of a disc's centre, its number of pixels, its visible fraction and its reference.

    The visible fraction is 1 for a whole disc and 0 for none. The centre is NaN if too little of the disc is visible.

    Parameters
    ----------
    y, cb, cr, width : planes of the image, and its width (the rows of the decoder may be padded).
    across, share : those of the marker's ``colour.Unmixer``.
    expected_x, expected_y : expected centre.
    radius : radius of the disc, pixels.
    reach : largest distance of the centre from the expected one, pixels.
    least : minimum visible area fraction at which an occluded disc is measured.
    reference : colour level of whole discs in this view, and the distance in pixels by which their outline lies
        inside their circle.
    whole : range of the area of a whole disc, relative to the expected outline; wider if the depth is uncertain.
    """
    half_window = int(np.ceil(reach + radius + 2.0))
    left, top = max(0, int(expected_x) - half_window), max(0, int(expected_y) - half_window)
    right, bottom = min(width, int(expected_x) + half_window + 1), min(y.shape[0], int(expected_y) + half_window + 1)
    nothing = (np.nan, np.nan, 0, 0.0, UNKNOWN)
    if right - left < radius or bottom - top < radius:
        return nothing
    amount = shares(y, cb, cr, (left, top, right, bottom), across, share)
    ground, level = _levels(amount, radius)
    if level < FAINTEST:
        return nothing
    edge = (ground + level) / 2.0
    blob, count = label(amount, edge)
    number = _choose(blob, count, expected_x - left, expected_y - top, radius)
    if number == 0:
        return nothing
    pixels, area, mean_x, mean_y, ratio = _moments(amount, blob, number, edge, level - ground)
    if pixels < FEWEST_PIXELS:
        return nothing
    drawn = radius - reference[1]
    shown = area / (np.pi * drawn * drawn)
    if whole[0] < shown < whole[1] and ratio < ROUND:
        near = np.hypot(left + mean_x - expected_x, top + mean_y - expected_y) <= reach
        reference = level, radius - np.sqrt(area / np.pi)
        return (left + mean_x, top + mean_y, pixels, 1.0, reference) if near else nothing
    if shown < least:
        return nothing
    edge = (ground + min(max(level, reference[0]), DIMMEST * level)) / 2.0
    blob, count = label(amount, edge)
    number = _choose(blob, count, expected_x - left, expected_y - top, radius)
    if number == 0:
        return nothing
    points = _outline(amount, blob, number, edge)
    u, v, arc = _fit(points, drawn, expected_x - left, expected_y - top, reach)
    if arc < LEAST_ARC or not np.hypot(left + u - expected_x, top + v - expected_y) <= reach:
        return nothing
    return left + u, top + v, pixels, min(arc, 0.99), reference
