"""The centre of a marker's disc, whole or partly hidden.

A disc that is wholly seen is centred by its pixels' mean, each weighted with how far it is covered. A disc that
something hides in part is fitted to its known radius: pairs of points on its outline propose centres, the centre with
the most outline on its circle wins, and Gauss-Newton with Tukey's weights settles it. What hides a disc cuts into it,
so no outline lies outside the circle.

The outline is where the colour falls to half of what whole discs show, and as far from the centre as theirs. Half of
what is left of a disc would not do: its middle, which is brightest, may be hidden, and the outline would move
outwards by a third of a pixel and more.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.capture.tracking.blobs import Plane, label, shares
from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

FAINTEST = 0.15
"""Least share of a marker's colour, in full light, that is no noise."""

ON_CIRCLE_PX = 0.5
"""An outline point this near to the circle lies on it."""

UNKNOWN = (0.0, 0.12)
"""What is usual of whole discs before any was seen: no light is known, and blur draws the outline inwards."""

DIMMEST = 1.5
"""Most that whole discs are taken to be brighter than this one; where they are, it lies in the shade."""

WHOLE = (0.97, 1.08)
"""Area of a whole disc, in areas of its outline."""

ROUND = 1.15
"""Most ratio of the two second moments of a whole disc."""

LEAST_ARC = 0.27
"""Least share of a circle's outline that fixes its centre."""

WELL_SEEN = 0.6
"""A disc with this share of its outline in view is centred nearly as well as a whole one."""

FEWEST_PIXELS = 6

PROPOSERS = 12
"""Outline points whose pairs propose centres."""


LOWEST, HIGHEST, BINS = -0.5, 1.5, 400
"""The histogram of shares."""

STRAY_COST = 1.5
"""Outline points that a proposed centre must win for each pixel that it lies off the expected one."""


@njit
def _levels(amount: Floats, radius: float) -> tuple[float, float]:
    """Return the share of the colour beside the disc and inside it: the medians of the dark and the light pixels.

    What a fifth of the disc's area reaches tells the two apart. All are read off a histogram.
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
    """Return the median of what a histogram of shares holds from bin ``first`` to before ``end``."""
    half, below = np.sum(count[first:end]) / 2.0, 0.0
    for place in range(first, end):
        if count[place] > 0 and below + count[place] >= half:
            return LOWEST + (place + (half - below) / count[place]) * (HIGHEST - LOWEST) / BINS
        below += count[place]
    return LOWEST


@njit
def _choose(blob: npt.NDArray[np.int32], count: int, x: float, y: float, radius: float) -> int:
    """Return the number of the blob that covers most of the expected disc, near pixels counting more; 0 for none."""
    score = np.zeros(count + 1)
    for row in range(blob.shape[0]):
        for column in range(blob.shape[1]):
            if blob[row, column] > 0:
                square = ((column - x) ** 2 + (row - y) ** 2) / (radius * radius)
                score[blob[row, column]] += 1.0 / (1.0 + square * square)
    return int(np.argmax(score))


@njit
def _outline(amount: Floats, blob: npt.NDArray[np.int32], number: int, half: float) -> Floats:
    """Return the points (n, 4) where a blob's share falls through ``half``: x, y, and the direction to its inside."""
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
    """Return how many outline points lie on the circle, less those outside; below ``least`` it is not counted out."""
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
    """Return the best centre within ``reach`` of (x, y) that two outline points propose, the nearer of equal ones.

    None counts that is the centre ``rival``, which may be NaN.
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
    """Return the centre of the circle of known radius through the outline, and the share of its outline on it."""
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
            near += weight * (abs(dx * points[k, 2]) + abs(dy * points[k, 3]))  # a crossing's length of outline
        determinant = a * c - b * b
        if determinant < 1e-6 * (a + c) ** 2 or near == 0.0:
            return np.nan, np.nan, 0.0
        x += (c * right_x - b * right_y) / determinant
        y += (a * right_y - b * right_x) / determinant
    return x, y, min(1.0, near / (2.0 * np.pi * radius))


@njit
def _fit(points: Floats, radius: float, x: float, y: float, reach: float) -> tuple[float, float, float]:
    """Return the centre of the circle of known radius expected at (x, y), and the share of its outline in view.

    Where a disc has lost a narrow strip, its outline nearly fits a second circle, which has lost as much on the
    other side. The two are told apart when both are settled.
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
    """Return a blob's pixels, its area, its centroid x and y, and the ratio of its second moments, 1 where round.

    A pixel counts with how far it is covered; the outer half of the blob's edge belongs to it too.
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
    usual: tuple[float, float] = UNKNOWN, whole: tuple[float, float] = WHOLE,
) -> tuple[float, float, int, float, tuple[float, float]]:  # fmt: skip
    """Return the pixel of a disc's centre, its pixels, how well it is seen, 1 whole, 0 not at all, and its ``usual``.

    Parameters
    ----------
    y, cb, cr, width : planes of the picture, and its width (rows of the decoder may be longer).
    across, share : of the marker's ``colour.Mixer``.
    expected_x, expected_y : where the disc is expected.
    radius : of the disc, in pixels.
    reach : how far the centre may be from where it is expected.
    least : area, in areas of its outline, from which on a disc that is not whole is fitted; below, it is not seen.
    usual : of whole discs here, the share of the colour that they show, and how far within its circle their outline
        lies, pixels.
    whole : areas of a whole disc, in areas of its outline; wider than blur alone where its depth is not known.

    The pixel is NaN where too little of the disc is seen.
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
    drawn = radius - usual[1]
    shown = area / (np.pi * drawn * drawn)
    if whole[0] < shown < whole[1] and ratio < ROUND:
        near = np.hypot(left + mean_x - expected_x, top + mean_y - expected_y) <= reach
        usual = level, radius - np.sqrt(area / np.pi)
        return (left + mean_x, top + mean_y, pixels, 1.0, usual) if near else nothing
    if shown < least:
        return nothing
    edge = (ground + min(max(level, usual[0]), DIMMEST * level)) / 2.0
    blob, count = label(amount, edge)
    number = _choose(blob, count, expected_x - left, expected_y - top, radius)
    if number == 0:
        return nothing
    points = _outline(amount, blob, number, edge)
    u, v, arc = _fit(points, drawn, expected_x - left, expected_y - top, reach)
    if arc < LEAST_ARC or not np.hypot(left + u - expected_x, top + v - expected_y) <= reach:
        return nothing
    return left + u, top + v, pixels, min(arc, 0.99), usual
