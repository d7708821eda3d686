"""Compiled densities of the parallel HMM: log-densities of a block of frames in all states, and exponentials.

Frames are the lanes: a block is turned so that its frames lie side by side for each feature and each state, and every
inner loop runs over them. Logarithms are to the base 2, which spares the exponential its reduction by log 2.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
from numba import types
from numba.extending import intrinsic

Float = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]

BLOCK = 64
"""Frames in a block, and between two checkpoints of a forward pass."""

PITCH = BLOCK + 8
"""Distance of two states in a block's rows: no power of 2, so that reading across rows does not thrash the cache."""

CHUNK = 6
"""Features taken together; models are padded to a multiple of it with features that weigh nothing."""

LEAST = -990.0
TINY = 2.0**LEAST
"""The least value of ``exp2``: what is smaller counts as this much."""

ROUND = 1.5 * 2.0**52
"""Added to a number, leaves its nearest integer in the last bits of the sum."""


@intrinsic
def _bits(_context: Any, _value: Any) -> Any:
    """Return the bits of a float64 as int64."""
    return types.int64(types.float64), _bitcast


@intrinsic
def _float(_context: Any, _value: Any) -> Any:
    """Return the float64 of the bits of an int64."""
    return types.float64(types.int64), _bitcast


def _bitcast(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))


@numba.njit(cache=True, fastmath={"contract"}, inline="always")
def exp2(x: float) -> float:
    """Return 2^x for x <= 1000, at least ``TINY``, to a relative error of 5e-16, in code that vectorises.

    A polynomial of degree 10 (interpolation at Chebyshev nodes) on [-1/2, 1/2], and the rest into the exponent bits.
    """
    x = x if x > LEAST else LEAST
    shifted = x + ROUND
    r = x - (shifted - ROUND)
    p = 7.072585949269223e-09
    p = p * r + 1.0208690299958306e-07
    p = p * r + 1.321544258792169e-06
    p = p * r + 1.5252657260200837e-05
    p = p * r + 0.0001540353044173605
    p = p * r + 0.0013333558230164974
    p = p * r + 0.009618129107606888
    p = p * r + 0.05550410866444772
    p = p * r + 0.24022650695910097
    p = p * r + 0.69314718055995
    p = p * r + 1.0
    return _float(_bits(p) + (_bits(shifted) << 52))  # type: ignore[call-arg]


@numba.njit(cache=True)
def copy(source: Float, target: Float) -> None:
    """Copy a vector; an assignment of arrays would bring its error messages along, which compile for seconds."""
    for i in range(len(source)):
        target[i] = source[i]


@numba.njit(cache=True)
def load(frames: Float, start: int, pivot: Float, block: Float) -> int:
    """Fill ``block`` (D, BLOCK) with frames from ``start`` less ``pivot``, 0 after the last; return how many."""
    part = frames[start : start + BLOCK]
    n, n_features = part.shape
    for k in range(n):
        for d in range(n_features):
            block[d, k] = part[k, d] - pivot[d]
    block[:n_features, n:] = 0.0
    return n


@numba.njit(cache=True, fastmath={"contract"})
def log_densities(
    block: Float,
    n: int,
    start: int,
    allowed: Bool,
    weight: Float,
    shift: Float,
    constant: Float,
    rows: Float,
    top: Float,
) -> None:
    """Fill ``rows`` (S, BLOCK) with log2 densities, and ``top`` (BLOCK,) with the largest of each frame.

    Minus infinity where the state's branch is not allowed.
    """
    n_states = len(constant)
    top[:] = -math.inf
    for s in range(n_states):
        row = rows[s]
        for d in range(0, weight.shape[1], CHUNK):
            w, v = weight[s, d : d + CHUNK], shift[s, d : d + CHUNK]
            w0, w1, w2, w3, w4, w5 = w[0], w[1], w[2], w[3], w[4], w[5]
            v0, v1, v2, v3, v4, v5 = v[0], v[1], v[2], v[3], v[4], v[5]
            x0, x1, x2, x3, x4, x5 = block[d], block[d + 1], block[d + 2], block[d + 3], block[d + 4], block[d + 5]
            base = constant[s] if d == 0 else 0.0
            for k in range(BLOCK):
                y0, y1, y2 = x0[k] * w0 - v0, x1[k] * w1 - v1, x2[k] * w2 - v2
                y3, y4, y5 = x3[k] * w3 - v3, x4[k] * w4 - v4, x5[k] * w5 - v5
                before = 0.0 if d == 0 else row[k]
                row[k] = (base + before) - y0 * y0 - y1 * y1 - y2 * y2 - y3 * y3 - y4 * y4 - y5 * y5
        if len(allowed) > 0:
            forbid(row, s, n, start, allowed, -math.inf)
        for k in range(BLOCK):
            # The sum keeps the compiler from a masked store, which costs more than all the rest.
            top[k] = (row[k] if row[k] > top[k] else top[k]) + 0.0


@numba.njit(cache=True)
def forbid(row: Float, s: int, n: int, start: int, allowed: Bool, value: float) -> None:
    """Put ``value`` where the branch of state s is not allowed."""
    m = s % allowed.shape[1]
    for k in range(n):
        if not allowed[start + k, m]:
            row[k] = value


@numba.njit(cache=True, fastmath={"contract"})
def relative_densities(n: int, start: int, allowed: Bool, rows: Float, top: Float) -> None:
    """Turn ``rows`` into densities relative to each frame's largest: 0 where not allowed, else at least ``TINY``."""
    for s in range(len(rows)):
        row = rows[s]
        for k in range(BLOCK):
            row[k] = exp2(row[k] - top[k])
        if len(allowed) > 0:
            forbid(row, s, n, start, allowed, 0.0)


@numba.njit(cache=True)
def turn(rows: Float, turned: Float) -> None:
    """Fill ``turned`` (BLOCK, S) from ``rows`` (S, PITCH), eight frames at a time: one line of the cache."""
    for k in range(0, BLOCK, 8):
        t0, t1, t2, t3 = turned[k], turned[k + 1], turned[k + 2], turned[k + 3]
        t4, t5, t6, t7 = turned[k + 4], turned[k + 5], turned[k + 6], turned[k + 7]
        for s in range(len(rows)):
            row = rows[s]
            t0[s], t1[s], t2[s], t3[s] = row[k], row[k + 1], row[k + 2], row[k + 3]
            t4[s], t5[s], t6[s], t7[s] = row[k + 4], row[k + 5], row[k + 6], row[k + 7]


@numba.njit(cache=True)
def fill(
    frames: Float, start: int, pivot: Float, allowed: Bool, weight: Float, shift: Float, constant: Float,
    block: Float, rows: Float, top: Float, density: Float,
) -> int:  # fmt: skip
    """Fill ``density`` (BLOCK, S) with the relative densities of the frames from ``start``, and return their number.

    ``top`` (BLOCK,) holds the log2 of what they are relative to, ``block`` (D, BLOCK) the frames; ``rows`` (S, PITCH)
    is scratch.
    """
    n = load(frames, start, pivot, block)
    log_densities(block, n, start, allowed, weight, shift, constant, rows, top)
    relative_densities(n, start, allowed, rows, top)
    turn(rows, density)
    return n
