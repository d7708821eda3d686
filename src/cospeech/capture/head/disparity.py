"""Disparity of single points of a rectified pair by the sum of absolute differences, with validation.

Both images are band-passed first (``bandpass``). The best of the integer shifts is refined by Gauss-Newton steps on
the squared differences, which have no preference for whole pixels. A disparity is rejected if the window has no
structure along the row, if another shift fits nearly as well, or if the match of the match lies elsewhere.

References
----------
M. E. Sargin, 2006, section 4.1.1, which follows K. Konolige, Small vision systems, 1997, and A. Fusiello, V. Roberto
and E. Trucco, Symmetric stereo with multiple windowing, 2000.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats, Plane
from cospeech.kernels.jit import njit

UNIQUE = 0.85
"""Cost of the best shift, as a share of that of the best shift elsewhere, above which a point is ambiguous."""

THERE_AND_BACK_PX = 0.7
"""Largest distance between a point and where the match of its match lies."""

LEAST_STRUCTURE = 1.5
"""Smallest root mean square derivative along the row within the window, in grey levels per pixel."""

STEPS = 4
"""Number of Gauss-Newton steps of the refinement."""

BACK_PX = 2
"""How far the way back from the right image to the left one is searched, pixels."""


def find_disparities(left: Plane, right: Plane, pixels: Floats, expected: Floats, reach: int, half: int) -> Floats:
    """Return the disparities (n,) in pixels of points in the left image, NaN where they are not valid.

    Parameters
    ----------
    left, right : (H, W) band-passed images of the pair.
    pixels : (n, 2) the points, x and y in the left image.
    expected : (n,) disparities to search around; NaN points stay NaN.
    reach : how far to search to either side, pixels.
    half : half the width of the window, without its middle, pixels.
    """
    found: Floats = _find(left, right, pixels, expected, (reach, BACK_PX), half)
    return found


@njit
def _find(left: Plane, right: Plane, pixels: Floats, expected: Floats, reaches: tuple[int, int], half: int) -> Floats:
    """Return the disparities (n,) that a search over the two ``reaches``, there and back, agrees on."""
    found = np.full(len(pixels), np.nan)
    for n in range(len(pixels)):
        x, y, shift = pixels[n, 0], pixels[n, 1], expected[n]
        if not np.isfinite(x + y + shift):
            continue
        disparity = _match(left, right, x, y, -shift, reaches[0], half)
        if np.isnan(disparity):
            continue
        back = _match(right, left, x + disparity, y, -disparity, reaches[1], half)
        if abs(disparity + back) <= THERE_AND_BACK_PX:
            found[n] = -disparity
    return found


@njit
def _match(image: Plane, other: Plane, x: float, y: float, expected: float, reach: int, half: int) -> float:
    """Return by how much the window around (x, y) is shifted along the row in ``other``; NaN if that is not valid."""
    side = 2 * half + 1
    height, width = image.shape
    if not (half + 1 <= x < width - half - 2 and half + 1 <= y < height - half - 2):
        return np.nan
    window = np.empty((side, side))
    cut(image, x - half, y - half, window)
    structure = 0.0
    for row in range(side):
        for column in range(1, side):
            structure += (window[row, column] - window[row, column - 1]) ** 2
    if structure < LEAST_STRUCTURE**2 * side * (side - 1):
        return np.nan
    base = round(x + expected)
    # One interpolated strip holds the windows of all whole shifts.
    begin, end = base - reach - half, base + reach + half
    if begin < 1 or end > width - 3:
        return np.nan
    strip = np.empty((side, end - begin + 1))
    cut(other, float(begin), y - half, strip)
    costs = np.empty(2 * reach + 1)
    for shift in range(2 * reach + 1):
        cost = 0.0
        for row in range(side):
            for column in range(side):
                cost += abs(strip[row, shift + column] - window[row, column])
        costs[shift] = cost
    best = int(np.argmin(costs))
    for shift in range(2 * reach + 1):
        if abs(shift - best) > 2 and costs[best] >= UNIQUE * costs[shift]:
            return np.nan
    if (best == 0 or best == 2 * reach) and reach > 2:
        return np.nan
    return _refine(other, window, float(base - reach + best), y, half) - x


@njit
def _refine(other: Plane, window: Floats, x: float, y: float, half: int) -> float:
    """Return x of the window of ``other`` in row y that fits ``window`` best, near ``x``; NaN if it runs away."""
    side = 2 * half + 1
    width = other.shape[1]
    around = np.empty((side, side + 2))
    moved = x
    for _ in range(STEPS):
        if not half + 2 <= moved < width - half - 3:
            return np.nan
        cut(other, moved - half - 1, y - half, around)
        top, bottom = 0.0, 0.0
        for row in range(side):
            for column in range(side):
                slope = 0.5 * (around[row, column + 2] - around[row, column])
                top += slope * (window[row, column] - around[row, column + 1])
                bottom += slope * slope
        if bottom <= 0.0:
            return np.nan
        step = top / bottom
        moved += step
        if abs(moved - x) > 1.5:
            return np.nan
        if abs(step) < 0.003:
            break
    return moved


@njit
def cut(image: Plane, x: float, y: float, out: Floats) -> None:
    """Fill ``out`` with the pixels of ``image`` from (x, y) on, interpolated linearly."""
    column, row = int(np.floor(x)), int(np.floor(y))
    right, down = x - column, y - row
    a, b = (1.0 - right) * (1.0 - down), right * (1.0 - down)
    c, d = (1.0 - right) * down, right * down
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            m, n = row + i, column + j
            out[i, j] = a * image[m, n] + b * image[m, n + 1] + c * image[m + 1, n] + d * image[m + 1, n + 1]
