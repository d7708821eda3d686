"""The compiled part of the alignment of faces: robust Gauss-Newton steps with the gradients of the first frame."""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats, Singles
from cospeech.kernels.jit import njit

TOLERATED = 3.0
"""Difference, in standard deviations, at which the weight of a pixel has fallen to a quarter."""
LEAST_NOISE = 0.5
"""Smallest standard deviation of the differences, of 255, that is believed."""
SAMPLED = 1024
"""Number of pixels from which the standard deviation is estimated."""


@njit
def bilinear(picture: Singles, x: float, y: float) -> float:
    """Return the value of a picture (H, W) between four pixels, NaN outside."""
    left, top = int(np.floor(x)), int(np.floor(y))
    if left < 0 or top < 0 or left >= picture.shape[1] - 1 or top >= picture.shape[0] - 1:
        return np.nan
    right, down = x - left, y - top
    upper = picture[top, left] + right * (picture[top, left + 1] - picture[top, left])
    lower = picture[top + 1, left] + right * (picture[top + 1, left + 1] - picture[top + 1, left])
    return upper + down * (lower - upper)


@njit
def solve(
    picture: Singles, places: Singles, points: Singles, values: Singles, gradients: Singles, inverse: Floats,
    start: Floats, step: float, most_steps: int, small_px: float,
) -> tuple[Floats, float]:  # fmt: skip
    """Return the parameters (14,) at one level of the pyramid, and the correlation with the first frame.

    Parameters
    ----------
    picture : (H, W) the frame at this level.
    places, points, values, gradients, inverse : see ``alignment.Level``.
    start : (14,) parameters of the motion in pixels of the finest level, gain and offset.
    step : pixels of the finest level per pixel.
    most_steps : number of steps at most.
    small_px : the steps end when the parameters change by less.
    """
    parameters = start.copy()
    differences = np.empty(len(values))
    for _ in range(most_steps):
        compare(picture, places, points, values, parameters, step, differences)
        change = inverse @ gradient(points, values, gradients, differences, limit(differences))
        parameters -= change
        if np.abs(change[:12]).sum() < small_px:
            break
    return parameters, correlation(values, differences, parameters)


@njit
def compare(
    picture: Singles, places: Singles, points: Singles, values: Singles, parameters: Floats, step: float,
    differences: Floats,
) -> None:  # fmt: skip
    """Write to ``differences`` (N,) by how much the moved pixels are brighter than those of the first frame."""
    p = parameters
    for k in range(len(values)):
        x, y = float(points[k, 0]), float(points[k, 1])
        xx, xy, yy = x * x, x * y, y * y
        along = p[0] + p[1] * x + p[2] * y + p[3] * xx + p[4] * xy + p[5] * yy
        down = p[6] + p[7] * x + p[8] * y + p[9] * xx + p[10] * xy + p[11] * yy
        seen = bilinear(picture, places[k, 0] + along / step, places[k, 1] + down / step)
        differences[k] = seen - p[12] * values[k] - p[13]


@njit
def limit(differences: Floats) -> float:
    """Return the difference at which a pixel counts as hidden, from the median of their sizes."""
    stride = max(1, len(differences) // SAMPLED)
    chosen = np.abs(differences[::stride])
    chosen = chosen[~np.isnan(chosen)]
    noise = 1.4826 * np.median(chosen) if len(chosen) else LEAST_NOISE
    return TOLERATED * max(noise, LEAST_NOISE)


@njit
def gradient(points: Singles, values: Singles, gradients: Singles, differences: Floats, tolerated: float) -> Floats:
    """Return the gradient (14,) of half the robust squared differences; pixels outside the picture are left out.

    It is scaled to what it would be if all pixels had full weight, as the matrix of the normal equations assumes.
    """
    total, weights = np.zeros(14), 1e-9
    for k in range(len(values)):
        difference = differences[k]
        if np.isnan(difference):
            continue
        relative = difference / tolerated
        weight = 1.0 / (1.0 + relative * relative)
        weight *= weight
        weights += weight
        pull = difference * weight
        x, y = float(points[k, 0]), float(points[k, 1])
        along, down = pull * gradients[k, 0], pull * gradients[k, 1]
        total[0] += along
        total[1] += along * x
        total[2] += along * y
        total[3] += along * x * x
        total[4] += along * x * y
        total[5] += along * y * y
        total[6] += down
        total[7] += down * x
        total[8] += down * y
        total[9] += down * x * x
        total[10] += down * x * y
        total[11] += down * y * y
        total[12] -= pull * values[k]
        total[13] -= pull
    return total * (len(values) / weights)


@njit
def correlation(values: Singles, differences: Floats, parameters: Floats) -> float:
    """Return the correlation of the moved pixels with those of the first frame, 0 if fewer than half are inside."""
    n, a, b, aa, ab, bb = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(values)):
        if not np.isnan(differences[k]):
            one = float(values[k])
            other = differences[k] + parameters[12] * one + parameters[13]
            n += 1
            a, b = a + one, b + other
            aa, ab, bb = aa + one * one, ab + one * other, bb + other * other
    if 2 * n < len(values):
        return 0.0
    variances = (aa - a * a / n) * (bb - b * b / n)
    return (ab - a * b / n) / np.sqrt(variances) if variances > 0.0 else 0.0


@njit
def region(picture: Singles, across: Floats, down: Floats, out: Singles) -> None:
    """Write the values of a picture at places (H, W), in pixels, to ``out``; NaN outside the picture."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            out[row, column] = bilinear(picture, across[row, column], down[row, column])
