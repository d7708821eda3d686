"""Coloured blobs in a region of an image: fractions of a colour, connected components and their centroids."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats, Plane
from cospeech.kernels.jit import njit

Box = tuple[int, int, int, int]


@njit
def shares(y: Plane, cb: Plane, cr: Plane, box: Box, across: Floats, share: Floats) -> Floats:
    """Return the fraction of one colour in each pixel of ``box`` (left, top, right, bottom); 1 is pure and fully lit.

    ``across`` and ``share`` are those of a ``colour.Unmixer``. The box must lie inside the image.
    """
    left, top, right, bottom = box
    amount = np.empty((bottom - top, right - left))
    for row in range(bottom - top):
        for column in range(right - left):
            amount[row, column] = _share(y, cb, cr, top + row, left + column, across, share)
    return amount


@njit
def _share(y: Plane, cb: Plane, cr: Plane, row: int, column: int, across: Floats, share: Floats) -> float:
    light, blue, red = float(y[row, column]), float(cb[row, column]) - 128.0, float(cr[row, column]) - 128.0
    side = 1 if across[0] * blue + across[1] * red > 0.0 else 0
    return share[side, 0] * light + share[side, 1] * blue + share[side, 2] * red


@njit
def label(amount: Floats, least: float) -> tuple[npt.NDArray[np.int32], int]:
    """Label the 4-connected components of pixels of at least ``least``; return the labels and the number of blobs.

    Labels count from 1, in reading order of the first pixel of each blob; pixels below ``least`` are 0.
    """
    height, width = amount.shape
    blob = np.zeros((height, width), dtype=np.int32)
    stack = np.empty((height * width, 2), dtype=np.int32)
    count = 0
    for row in range(height):
        for column in range(width):
            if blob[row, column] != 0 or amount[row, column] < least:
                continue
            count += 1
            blob[row, column] = count
            stack[0, 0], stack[0, 1], depth = row, column, 1
            while depth > 0:
                depth -= 1
                i, j = stack[depth, 0], stack[depth, 1]
                for side in range(4):
                    m = i + (side == 0) - (side == 1)
                    n = j + (side == 2) - (side == 3)
                    inside = 0 <= m < height and 0 <= n < width
                    if inside and blob[m, n] == 0 and amount[m, n] >= least:
                        blob[m, n] = count
                        stack[depth, 0], stack[depth, 1] = m, n
                        depth += 1
    return blob, count


@njit
def find(y: Plane, cb: Plane, cr: Plane, box: Box, across: Floats, share: Floats, least: float, step: int) -> Floats:
    """Return the blobs (n, 3) of one colour in ``box``: x and y of the centroid, and the number of pixels.

    A blob is a 4-connected component within ``box`` of pixels whose colour fraction is at least ``least``; its
    centroid is weighted by these fractions. Only every ``step``-th pixel of every ``step``-th row is tested as a
    seed, so narrower blobs may be missed.
    """
    left, top, right, bottom = box
    width, height = right - left, bottom - top
    known = np.zeros((height, width), dtype=np.bool_)
    stack = np.empty((height * width, 2), dtype=np.int32)
    found = np.empty((((height + step - 1) // step) * ((width + step - 1) // step), 3))
    count = 0
    for row in range(0, height, step):
        for column in range(0, width, step):
            if known[row, column] or _share(y, cb, cr, top + row, left + column, across, share) < least:
                continue
            sum_x, sum_y, weight, pixels = 0.0, 0.0, 0.0, 0
            known[row, column] = True
            stack[0, 0], stack[0, 1], depth = row, column, 1
            while depth > 0:
                depth -= 1
                i, j = stack[depth, 0], stack[depth, 1]
                amount = _share(y, cb, cr, top + i, left + j, across, share)
                if amount < least:
                    continue
                sum_x, sum_y = sum_x + amount * (left + j), sum_y + amount * (top + i)
                weight, pixels = weight + amount, pixels + 1
                for side in range(4):
                    m = i + (side == 0) - (side == 1)
                    n = j + (side == 2) - (side == 3)
                    if 0 <= m < height and 0 <= n < width and not known[m, n]:
                        known[m, n] = True
                        stack[depth, 0], stack[depth, 1] = m, n
                        depth += 1
            found[count] = sum_x / weight, sum_y / weight, float(pixels)
            count += 1
    return found[:count]
