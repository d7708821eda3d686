"""Many arrays in two: compiled code takes microseconds to receive dozens of arrays, and a hop has few of them.

Arrays are stored one after another in a buffer of their kind. Compiled code finds each by its number, with the number
of dimensions as a part of the name of the function, since types are known when it is compiled.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit

MOST_DIMENSIONS = 4


class Packed(NamedTuple):
    """Arrays in two buffers.

    Attributes
    ----------
    floats, integers : the elements of all arrays of either kind; flags are integers.
    layout : (n, 5) where the elements of each array begin in its buffer, and its shape, filled up with ones.
    """

    floats: Floats
    integers: Integers
    layout: Integers


def pack(arrays: Sequence[np.ndarray]) -> tuple[Packed, list[np.ndarray]]:
    """Return arrays of at most four dimensions in two buffers, and the same arrays as views of these."""
    kinds = [0 if array.dtype.kind == "f" else 1 for array in arrays]
    sizes = [0, 0]
    layout = np.ones((len(arrays), 1 + MOST_DIMENSIONS), dtype=np.int64)
    for row, array, kind in zip(layout, arrays, kinds, strict=True):
        row[0], row[1 : 1 + array.ndim] = sizes[kind], array.shape
        sizes[kind] += array.size
    buffers = np.zeros(sizes[0]), np.zeros(sizes[1], dtype=np.int64)
    views = []
    for row, array, kind in zip(layout, arrays, kinds, strict=True):
        views.append(buffers[kind][row[0] : row[0] + array.size].reshape(array.shape))
        views[-1][...] = array
    return Packed(*buffers, layout), views


@njit
def one(buffer: Any, layout: Any, number: int) -> Any:
    """Return an array with one dimension."""
    at = layout[number]
    return buffer[at[0] : at[0] + at[1]]


@njit
def two(buffer: Any, layout: Any, number: int) -> Any:
    """Return an array with two dimensions."""
    at = layout[number]
    return buffer[at[0] : at[0] + at[1] * at[2]].reshape((at[1], at[2]))


@njit
def three(buffer: Any, layout: Any, number: int) -> Any:
    """Return an array with three dimensions."""
    at = layout[number]
    return buffer[at[0] : at[0] + at[1] * at[2] * at[3]].reshape((at[1], at[2], at[3]))


@njit
def four(buffer: Any, layout: Any, number: int) -> Any:
    """Return an array with four dimensions."""
    at = layout[number]
    return buffer[at[0] : at[0] + at[1] * at[2] * at[3] * at[4]].reshape((at[1], at[2], at[3], at[4]))
