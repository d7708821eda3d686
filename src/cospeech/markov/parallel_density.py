"""Compiled densities of the parallel HMM, of a block of frames in all states.

States lie in vectors: branches are the lanes, filled up to G whole groups with branches that are never entered, so
that ``[p, g]`` is place p of the branches of group g. Logarithms are to the base 2, which spares the
exponential its reduction by log 2.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.jit import njit
from cospeech.markov.lanes import LANES, each, exp2, greater, greatest, put, take

Float = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]

BLOCK = 128
"""Frames in a block, and between two checkpoints of a forward pass; a multiple of ``ABREAST``."""

ABREAST = 4
"""Frames that share what is read of the parameters."""


@njit
def copy(source: Float, target: Float) -> None:
    """Copy an array (N, G, LANES); an assignment would bring its error messages along, which compile for seconds."""
    for p in range(source.shape[0]):
        for g in range(source.shape[1]):
            put(target, (p, g), take(source, (p, g)))


@njit
def scale(states: Float, factor: float) -> None:
    """Multiply an array (N, G, LANES)."""
    for p in range(states.shape[0]):
        for g in range(states.shape[1]):
            put(states, (p, g), take(states, (p, g)) * factor)


@njit
def load(frames: Float, start: int, pivot: Float, block: Float) -> int:
    """Fill ``block`` (BLOCK, D) with the frames from ``start`` less ``pivot``, 0 after the last; return how many."""
    n = min(BLOCK, len(frames) - start)
    for k in range(n):
        for d in range(len(pivot)):
            block[k, d] = frames[start + k, d] - pivot[d]
    block[n:] = 0.0
    return n


@njit
def bar(start: int, n: int, allowed: Bool, bars: Float) -> None:
    """Fill ``bars`` (BLOCK, G, LANES), zeros so far, with minus infinity where a branch is not allowed."""
    for k in range(n if len(allowed) > 0 else 0):
        for m in range(allowed.shape[1]):
            bars[k, m // LANES, m % LANES] = 0.0 if allowed[start + k, m] else -math.inf


@njit
def log_densities(
    n: int, block: Float, bars: Float, weight: Float, shift: Float, constant: Float, density: Float
) -> None:
    """Fill ``density`` (BLOCK, N, G, LANES) with log2 densities, minus infinity where a branch is not allowed."""
    n_places, n_groups, n_features = weight.shape[:3]
    for k in range(0, n, ABREAST):
        for p in range(n_places):
            for g in range(n_groups):
                base = take(constant, (p, g))
                l0, l1 = base + take(bars, (k, g)), base + take(bars, (k + 1, g))
                l2, l3 = base + take(bars, (k + 2, g)), base + take(bars, (k + 3, g))
                for d in range(n_features):
                    w, s = take(weight, (p, g, d)), take(shift, (p, g, d))
                    y0, y1 = block[k, d] * w - s, block[k + 1, d] * w - s
                    y2, y3 = block[k + 2, d] * w - s, block[k + 3, d] * w - s
                    l0, l1, l2, l3 = l0 - y0 * y0, l1 - y1 * y1, l2 - y2 * y2, l3 - y3 * y3
                put(density, (k, p, g), l0)
                put(density, (k + 1, p, g), l1)
                put(density, (k + 2, p, g), l2)
                put(density, (k + 3, p, g), l3)


@njit
def relative_densities(n: int, density: Float, top: Float) -> None:
    """Turn log2 densities into densities relative to each frame's largest, ``top`` (BLOCK,); at least ``TINY``."""
    n_places, n_groups = density.shape[1:3]
    for k in range(n):
        highest = each(-math.inf)
        for p in range(n_places):
            for g in range(n_groups):
                highest = greater(take(density, (k, p, g)), highest)
        top[k] = greatest(highest)
        for p in range(n_places):
            for g in range(n_groups):
                put(density, (k, p, g), exp2(take(density, (k, p, g)) - top[k]))


@njit
def fill(
    frames: Float, start: int, pivot: Float, allowed: Bool, weight: Float, shift: Float, constant: Float,
    block: Float, bars: Float, density: Float, top: Float,
) -> int:  # fmt: skip
    """Fill ``density`` (BLOCK, N, G, LANES) with the relative densities of the frames from ``start``.

    ``top`` (BLOCK,) becomes the log2 of what they are relative to, ``block`` (BLOCK, D) the frames. Returns how many
    these are.
    """
    n = load(frames, start, pivot, block)
    bar(start, n, allowed, bars)
    log_densities(n, block, bars, weight, shift, constant, density)
    relative_densities(n, density, top)
    return n
