"""Coloured blobs in a part of a picture: shares of one colour, connected components, their pixels' statistics."""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Plane = npt.NDArray[np.uint8]
Box = tuple[int, int, int, int]


@numba.njit(cache=True)
def shares(y: Plane, cb: Plane, cr: Plane, box: Box, across: Floats, share: Floats) -> Floats:
    """Return how much of one colour each pixel of ``box`` (left, top, right, bottom) shows; 1 is full, in full light.

    ``across`` and ``share`` are those of a ``colour.Mixer``. The box lies inside the picture.
    """
    left, top, right, bottom = box
    amount = np.empty((bottom - top, right - left))
    for row in range(bottom - top):
        for column in range(right - left):
            light = float(y[top + row, left + column])
            blue = float(cb[top + row, left + column]) - 128.0
            red = float(cr[top + row, left + column]) - 128.0
            side = 1 if across[0] * blue + across[1] * red > 0.0 else 0
            amount[row, column] = share[side, 0] * light + share[side, 1] * blue + share[side, 2] * red
    return amount


@numba.njit(cache=True)
def label(amount: Floats, least: float) -> tuple[npt.NDArray[np.int32], int]:
    """Return the number of each pixel's blob, from 1, and how many there are: 4-neighbours of ``least`` or more.

    Pixels below are 0. Blobs are numbered in reading order of their first pixel.
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


@numba.njit(cache=True)
def statistics(amount: Floats, blob: npt.NDArray[np.int32], count: int, box: Box) -> Floats:
    """Return for each blob (count, 3) the pixel x, y of its centroid, weighted with ``amount``, and its pixels."""
    found, weight = np.zeros((count, 3)), np.zeros(count)
    for row in range(blob.shape[0]):
        for column in range(blob.shape[1]):
            number = blob[row, column] - 1
            if number >= 0:
                found[number, 0] += amount[row, column] * (box[0] + column)
                found[number, 1] += amount[row, column] * (box[1] + row)
                found[number, 2] += 1.0
                weight[number] += amount[row, column]
    for number in range(count):
        found[number, :2] /= weight[number]
    return found
