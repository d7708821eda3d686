"""Compiled expectation of the parallel HMM with scaled probabilities: fast, and sure of its result or it says so.

Probabilities relative to a frame's most likely state may become too small for a double. Going forward such a one is
rounded down to nothing, going backward up to ``TINY``: the two passes bound the likelihood from below and from above.
Where both ends meet, nothing was lost; where not, ``UNSURE`` is returned and the logarithms of ``parallel_exact``
have to do it.

States lie in vectors as in ``parallel_density``: branches begin in the first place and end in the last, and
what leaves a place enters the next. Memory hardly grows with the length of a sequence: the forward
pass keeps one frame in ``BLOCK``, and each block is computed anew when the backward pass arrives there, but for the
densities of the last ``KEPT`` blocks.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.jit import njit
from cospeech.markov.lanes import LANES, TINY, each, put, take, total
from cospeech.markov.parallel_density import (
    ABREAST,
    BLOCK,
    Bool,
    Float,
    copy,
    fill,
    load,
    scale,
)

NOTHING = BLOCK + 1
"""The row of a block's forward probabilities that is always 0."""

KEPT = 32
"""Blocks whose densities are kept for the backward pass: all of a record of a minute or two, and still in a cache."""

FREE, MUST, NEVER = 0, 1, 2
"""A frame's cut: a segment may begin here, must begin here, or must not."""

UNSURE = math.nan
AGREEMENT = 1e-8
"""Relative difference of the two bounds of a likelihood up to which they are one."""

FAINT, LOST = 2.0**-200, 2.0**-600
"""Sums of a frame's probabilities: below the first they are scaled up, below the second left to logarithms."""

Cuts = npt.NDArray[np.int8]


@njit
def _forward(
    start: int, n: int, cuts: Cuts, density: Float, entry: Float, stay: Float, leave: Float,
    alphas: Float, scales: Float, nodes: Float,
) -> float:  # fmt: skip
    """Go forward through a block of n frames: rows 1 to n of ``alphas``, ``scales``, ``nodes`` follow from row 0.

    Returns
    -------
    The sum of the last row; 0 where a frame lost too much to be sure of.
    """
    n_places, n_groups = stay.shape[:2]
    node, left = nodes[0], 1.0
    for k in range(n):
        cut = cuts[start + k] if len(cuts) > 0 and start + k > 0 else FREE
        nodes[k] = 0.0 if cut == NEVER else node
        before = NOTHING if cut == MUST else k
        everywhere, leaving = each(0.0), each(0.0)
        for g in range(n_groups):
            # From the last place to the first, which asks for the node: so its sum is ready when it is needed.
            # Less ``TINY``, a branch that is not allowed has no density at all.
            here = take(alphas, (before, n_places - 1, g))
            for p in range(n_places - 1, 0, -1):
                earlier = take(alphas, (before, p - 1, g))
                value = here * take(stay, (p, g)) + earlier * take(leave, (p - 1, g))
                value = value * (take(density, (k, p, g)) - TINY)
                put(alphas, (k + 1, p, g), value)
                everywhere, here = everywhere + value, earlier
            value = here * take(stay, (0, g)) + nodes[k] * take(entry, (g,))
            value = value * (take(density, (k, 0, g)) - TINY)
            put(alphas, (k + 1, 0, g), value)
            everywhere = everywhere + value
            leaving = leaving + take(alphas, (k + 1, n_places - 1, g)) * take(leave, (n_places - 1, g))
        left, node, scales[k + 1] = total(everywhere), total(leaving), 1.0
        if left < FAINT:
            if left < LOST:
                return 0.0
            scales[k + 1] = 1.0 / left
            node *= scales[k + 1]
            scale(alphas[k + 1], scales[k + 1])
            left = 1.0
    nodes[n] = node
    return left


@njit
def _backward(
    start: int, n: int, cuts: Cuts, density: Float, entry: Float, stay: Float, leave: Float,
    alphas: Float, scales: Float, nodes: Float, beta: Float, entered: Float,
) -> float:  # fmt: skip
    """Go backward through a block of n frames: ``beta`` (N, G, LANES) moves from its last frame to the one before it.

    Rows 1 to n of ``alphas`` become posterior probabilities, and the rows of absent frames nothing; the segments that
    begin are added to ``entered`` (G, LANES).

    Returns
    -------
    What the shared node before the block is worth: at the start of a sequence its likelihood's upper bound, relative
    to the lower one.
    """
    n_places, n_groups = stay.shape[:2]
    node = 1.0
    for k in range(n - 1, -1, -1):
        cut = cuts[start + k] if len(cuts) > 0 else FREE
        worth = each(0.0)
        for g in range(n_groups):
            begun = scales[k + 1] * take(entry, (g,)) * take(density, (k, 0, g)) * take(beta, (0, g))
            put(entered, (g,), take(entered, (g,)) + nodes[k] * begun)
            worth = worth + begun
        node = total(worth)
        within = 0.0 if cut == MUST else scales[k + 1]
        for g in range(n_groups):
            # From the first place to the last, which asks for the node.
            later = take(beta, (0, g))
            put(alphas, (k + 1, 0, g), take(alphas, (k + 1, 0, g)) * later)
            follow = within * take(density, (k, 0, g)) * later
            for p in range(n_places - 1):
                later, own = take(beta, (p + 1, g)), follow
                put(alphas, (k + 1, p + 1, g), take(alphas, (k + 1, p + 1, g)) * later)
                follow = within * take(density, (k, p + 1, g)) * later
                put(beta, (p, g), take(stay, (p, g)) * own + (take(leave, (p, g)) * follow + TINY))
            back = take(leave, (n_places - 1, g)) * (0.0 if cut == NEVER else node) + TINY
            put(beta, (n_places - 1, g), take(stay, (n_places - 1, g)) * follow + back)
    alphas[n + 1 : NOTHING] = 0.0
    return node


@njit
def _gather(n: int, block: Float, gammas: Float, moments: Float) -> None:
    """Add a block's frames in each state, and their features and squares, to ``moments`` (N, G, 1 + 2 D, LANES)."""
    n_places, n_groups = moments.shape[:2]
    n_features = block.shape[1]
    squares = block * block
    for k in range(0, n, ABREAST):
        for p in range(n_places):
            for g in range(n_groups):
                g0, g1 = take(gammas, (k + 1, p, g)), take(gammas, (k + 2, p, g))
                g2, g3 = take(gammas, (k + 3, p, g)), take(gammas, (k + 4, p, g))
                put(moments, (p, g, 0), take(moments, (p, g, 0)) + (g0 + g1 + (g2 + g3)))
                for d in range(n_features):
                    first, second = take(moments, (p, g, 1 + d)), take(moments, (p, g, 1 + n_features + d))
                    first, second = first + g0 * block[k, d], second + g0 * squares[k, d]
                    first, second = first + g1 * block[k + 1, d], second + g1 * squares[k + 1, d]
                    first, second = first + g2 * block[k + 2, d], second + g2 * squares[k + 2, d]
                    first, second = first + g3 * block[k + 3, d], second + g3 * squares[k + 3, d]
                    put(moments, (p, g, 1 + d), first)
                    put(moments, (p, g, 1 + n_features + d), second)


@njit
def expect(
    frames: Float, allowed: Bool, cuts: Cuts, entry: Float, stay: Float, leave: Float,
    weight: Float, shift: Float, constant: Float, pivot: Float, entered: Float, moments: Float, final: Float,
) -> float:  # fmt: skip
    """Return the log2-likelihood of one sequence, or ``UNSURE``, and fill its expected counts, all zero so far.

    Parameters
    ----------
    frames : (T, D) one sequence.
    allowed : (T, M) the branches that may be active in each frame; (0, M) where all are, always.
    cuts : (T,) ``FREE``, ``MUST`` or ``NEVER``: whether a segment begins in a frame; (0,) where all are free.
    entry, stay, leave : (G, LANES), (N, G, LANES), (N, G, LANES) probabilities.
    weight, shift, constant : (N, G, D, LANES), (N, G, D, LANES), (N, G, LANES); log2 density is
        constant - sum over D of (x weight - shift)^2, with x less ``pivot`` (D,).
    entered : (G, LANES) expected segments of each branch.
    moments : (N, G, 1 + 2 D, LANES) expected frames in each state, and over these the sums of the features less
        ``pivot``, and of their squares.
    final : (N, G, LANES) probability of each state in the last frame.
    """
    n_frames, n_features = frames.shape
    n_places, n_groups = stay.shape[:2]
    n_blocks = (n_frames + BLOCK - 1) // BLOCK
    block, bars = np.zeros((BLOCK, n_features)), np.zeros((BLOCK, n_groups, LANES))
    kept, top = np.empty((min(n_blocks, KEPT), BLOCK, n_places, n_groups, LANES)), np.empty(BLOCK)
    alphas = np.zeros((NOTHING + 1, n_places, n_groups, LANES))
    scales, nodes = np.ones(BLOCK + 1), np.ones(BLOCK + 1)
    checkpoints, returns = np.empty((n_blocks, n_places, n_groups, LANES)), np.empty(n_blocks)

    likelihood, left, n = 0.0, 1.0, 0
    for j in range(n_blocks):
        copy(alphas[n], checkpoints[j])
        copy(alphas[n], alphas[0])
        returns[j] = nodes[0] = nodes[n]
        density = kept[j % KEPT]
        n = fill(frames, j * BLOCK, pivot, allowed, weight, shift, constant, block, bars, density, top)
        left = _forward(j * BLOCK, n, cuts, density, entry, stay, leave, alphas, scales, nodes)
        if left == 0.0:
            return UNSURE
        for k in range(n):
            likelihood += top[k]
            if scales[k + 1] != 1.0:
                likelihood -= math.log2(scales[k + 1])
    likelihood += math.log2(left)

    bound, beta = 1.0, np.full(stay.shape, 1.0 / left)
    copy(alphas[n], final)
    scale(final, 1.0 / left)
    for j in range(n_blocks - 1, -1, -1):
        copy(checkpoints[j], alphas[0])
        nodes[0] = returns[j]
        density = kept[j % KEPT]
        if j >= n_blocks - KEPT:
            n = load(frames, j * BLOCK, pivot, block)
        else:
            n = fill(frames, j * BLOCK, pivot, allowed, weight, shift, constant, block, bars, density, top)
        _forward(j * BLOCK, n, cuts, density, entry, stay, leave, alphas, scales, nodes)
        bound = _backward(j * BLOCK, n, cuts, density, entry, stay, leave, alphas, scales, nodes, beta, entered)
        _gather(n, block, alphas, moments)
    return likelihood if abs(bound - 1.0) < AGREEMENT else UNSURE
