"""Compiled densities of the parallel HMM, for a block of frames in all states.

States are stored in vectors whose lanes are branches. The branches are padded to G full groups with branches that are
never entered. Vector v = p * G + g holds the p-th states of the branches in group g, and there are V = N * G vectors.
Logarithms have the base 2, which makes the exponential cheaper.
"""

from __future__ import annotations

from typing import Any

from cospeech.data.arrays import Flags, Floats
from cospeech.kernels.jit import njit
from cospeech.markov.lanes import LANES, TINY, exp2, put, take

BLOCK = 128
"""Frames in a block, and between two checkpoints of a forward pass; a multiple of ``ABREAST``."""

ABREAST = 4
"""Number of frames that are computed with one read of the parameters."""


@njit
def copy(source: Floats, target: Floats) -> None:
    """Copy an array (V, LANES); an assignment would take seconds to compile because of its error messages."""
    for v in range(len(source)):
        put(target, (v,), take(source, (v,)))


@njit
def scale(states: Floats, factor: float) -> None:
    """Multiply an array (V, LANES)."""
    for v in range(len(states)):
        put(states, (v,), take(states, (v,)) * factor)


@njit
def load(frames: Floats, start: int, pivot: Floats, block: Floats) -> int:
    """Fill ``block`` (BLOCK, D) with the frames from ``start`` on minus ``pivot``, then 0; return their number."""
    n = min(BLOCK, len(frames) - start)
    loaded = frames[start : start + n]  # rows from 0 on, so that no index can be negative
    for k in range(n):
        for d in range(len(pivot)):
            block[k, d] = loaded[k, d] - pivot[d]
    block[n:] = 0.0
    return n


@njit
def bar(start: int, n: int, allowed: Flags, density: Floats, nothing: float) -> None:
    """Set ``density`` (BLOCK, V, LANES) to ``nothing`` where a branch is not allowed."""
    n_lanes = (allowed.shape[1] + LANES - 1) // LANES * LANES
    for k in range(n if len(allowed) > 0 else 0):
        states = density[k].reshape(-1, n_lanes)
        for m in range(allowed.shape[1]):
            if not allowed[start + k, m]:
                states[:, m] = nothing


@njit(inline="always")
def _abreast(k: int, v: int, block: Floats, weight: Floats, shift: Floats, constant: Floats) -> Any:
    """Return the log2 densities of the states of vector v in the ABREAST frames from k on."""
    l0 = l1 = l2 = l3 = take(constant, (v,))
    for d in range(weight.shape[1]):
        w, s = take(weight, (v, d)), take(shift, (v, d))
        y0, y1 = block[k, d] * w - s, block[k + 1, d] * w - s
        y2, y3 = block[k + 2, d] * w - s, block[k + 3, d] * w - s
        l0, l1, l2, l3 = l0 - y0 * y0, l1 - y1 * y1, l2 - y2 * y2, l3 - y3 * y3
    return l0, l1, l2, l3


@njit
def log_densities(n: int, block: Floats, weight: Floats, shift: Floats, constant: Floats, density: Floats) -> None:
    """Fill ``density`` (BLOCK, V, LANES) with log2 densities."""
    for k in range(0, n, ABREAST):
        for v in range(len(constant)):
            l0, l1, l2, l3 = _abreast(k, v, block, weight, shift, constant)
            put(density, (k, v), l0)
            put(density, (k + 1, v), l1)
            put(density, (k + 2, v), l2)
            put(density, (k + 3, v), l3)


@njit
def densities(n: int, block: Floats, weight: Floats, shift: Floats, constant: Floats, density: Floats) -> None:
    """Fill ``density`` (BLOCK, V, LANES) with densities minus ``TINY``, which is 0 if they are not greater."""
    for k in range(0, n, ABREAST):
        for v in range(len(constant)):
            l0, l1, l2, l3 = _abreast(k, v, block, weight, shift, constant)
            put(density, (k, v), exp2(l0) - TINY)
            put(density, (k + 1, v), exp2(l1) - TINY)
            put(density, (k + 2, v), exp2(l2) - TINY)
            put(density, (k + 3, v), exp2(l3) - TINY)
