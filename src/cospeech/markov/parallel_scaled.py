"""Compiled E-step of the parallel HMM with scaled probabilities: fast, and reliable or reported as unreliable.

Probabilities relative to the greatest density of the model may underflow. The forward pass then rounds them down to
zero and the backward pass up to ``TINY``, so that the two passes give a lower and an upper bound of the likelihood.
If the bounds agree, nothing was lost; otherwise ``UNSURE`` is returned, and ``parallel_exact`` must be used.

States are stored in vectors as in ``parallel_density``. Memory hardly grows with the length of a sequence: the
forward pass keeps one frame in ``BLOCK``, and the backward pass computes each block again, except the last ones (see
``KEPT``).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Flags, Floats
from cospeech.kernels.jit import njit
from cospeech.markov.lanes import LANES, TINY, each, put, take, total
from cospeech.markov.parallel_density import ABREAST, BLOCK, bar, copy, densities, load, scale

NOTHING = BLOCK + 1
"""The row of the forward probabilities of a block that is always 0."""

KEPT = 576
"""Total number of vectors in the blocks whose densities and forward probabilities are kept: 10 MB."""

FREE, MUST, NEVER = 0, 1, 2
"""A segment may begin in a frame, must begin there, or must not."""

UNSURE = math.nan
AGREEMENT = 1e-8
"""Maximum relative difference of the two bounds of a likelihood that agree."""

FAINT, LOST = 2.0**-200, 2.0**-600
"""If the sum of the probabilities of a frame is below the first, they are scaled up; below the second, give up."""

Cuts = npt.NDArray[np.int8]


@njit
def _forward(
    start: int, n: int, cuts: Cuts, density: Floats, entry: Floats, stay: Floats, leave: Floats,
    alphas: Floats, scales: Floats, nodes: Floats,
) -> float:  # fmt: skip
    """Forward pass through a block of n frames: fill rows 1 to n of ``alphas``, ``scales`` and ``nodes`` from row 0.

    Returns
    -------
    Sum of the last row; 0 if too much was lost in a frame.
    """
    n_vectors, n_groups = len(stay), len(entry)
    node, left = nodes[0], 1.0
    for k in range(n):
        cut = cuts[start + k] if len(cuts) > 0 and start + k > 0 else FREE
        nodes[k] = 0.0 if cut == NEVER else node
        before = NOTHING if cut == MUST else k
        everywhere, leaving = each(0.0), each(0.0)
        # First states come last, because they need the node, whose sum is ready by then.
        for v in range(n_groups, n_vectors):
            stayed = take(alphas, (before, v)) * take(stay, (v,))
            value = take(alphas, (before, v - n_groups)) * take(leave, (v - n_groups,)) + stayed
            value = value * take(density, (k, v))
            put(alphas, (k + 1, v), value)
            everywhere = everywhere + value
        for v in range(n_groups):
            value = take(alphas, (before, v)) * take(stay, (v,)) + nodes[k] * take(entry, (v,))
            value = value * take(density, (k, v))
            put(alphas, (k + 1, v), value)
            everywhere = everywhere + value
        for v in range(n_vectors - n_groups, n_vectors):
            leaving = leaving + take(alphas, (k + 1, v)) * take(leave, (v,))
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
    start: int, n: int, cuts: Cuts, density: Floats, entry: Floats, stay: Floats, leave: Floats,
    alphas: Floats, scales: Floats, nodes: Floats, beta: Floats, entered: Floats,
) -> float:  # fmt: skip
    """Backward pass through a block of n frames: take ``beta`` (V, LANES) from its last frame to before its first.

    Rows 1 to n of ``alphas`` become posterior probabilities, and the rows of missing frames 0; the expected number of
    segments that begin is added to ``entered`` (G, LANES).

    Returns
    -------
    Backward probability of the node before the block. At the start of a sequence, this is the upper bound of the
    likelihood relative to the lower one.
    """
    n_vectors, n_groups = len(stay), len(entry)
    node = 1.0
    for k in range(n - 1, -1, -1):
        cut = cuts[start + k] if len(cuts) > 0 else FREE
        rescaled, worth = scales[k + 1], each(0.0)
        # The product of a state stays in its ``beta`` until the next state of the branch is reached.
        for v in range(n_groups):
            later = take(beta, (v,))
            put(alphas, (k + 1, v), take(alphas, (k + 1, v)) * later)
            follow = (take(density, (k, v)) + TINY) * later * rescaled
            put(beta, (v,), follow)
            begun = take(entry, (v,)) * follow
            put(entered, (v,), take(entered, (v,)) + nodes[k] * begun)
            worth = worth + begun
        node = total(worth)
        for v in range(n_groups, n_vectors):
            later, own = take(beta, (v,)), take(beta, (v - n_groups,))
            put(alphas, (k + 1, v), take(alphas, (k + 1, v)) * later)
            follow = (take(density, (k, v)) + TINY) * later * rescaled
            put(beta, (v,), follow)
            moved = take(leave, (v - n_groups,)) * follow + TINY
            put(beta, (v - n_groups,), take(stay, (v - n_groups,)) * own + moved)
        if cut == MUST:
            beta[:] = 0.0
        back = 0.0 if cut == NEVER else node
        for v in range(n_vectors - n_groups, n_vectors):
            put(beta, (v,), take(stay, (v,)) * take(beta, (v,)) + (take(leave, (v,)) * back + TINY))
    alphas[n + 1 : NOTHING] = 0.0
    return node


@njit
def _gather(n: int, block: Floats, gammas: Floats, moments: Floats) -> None:
    """Add the expected frames of a block, and their features and squares, to ``moments`` (V, 1 + 2 D, LANES)."""
    n_features = block.shape[1]
    squares = block * block
    for k in range(0, n, ABREAST):
        for v in range(len(moments)):
            g0, g1 = take(gammas, (k + 1, v)), take(gammas, (k + 2, v))
            g2, g3 = take(gammas, (k + 3, v)), take(gammas, (k + 4, v))
            put(moments, (v, 0), take(moments, (v, 0)) + (g0 + g1 + (g2 + g3)))
            for d in range(n_features):
                first, second = take(moments, (v, 1 + d)), take(moments, (v, 1 + n_features + d))
                first, second = first + g0 * block[k, d], second + g0 * squares[k, d]
                first, second = first + g1 * block[k + 1, d], second + g1 * squares[k + 1, d]
                first, second = first + g2 * block[k + 2, d], second + g2 * squares[k + 2, d]
                first, second = first + g3 * block[k + 3, d], second + g3 * squares[k + 3, d]
                put(moments, (v, 1 + d), first)
                put(moments, (v, 1 + n_features + d), second)


@njit
def expect(
    frames: Floats, allowed: Flags, cuts: Cuts, entry: Floats, stay: Floats, leave: Floats,
    weight: Floats, shift: Floats, constant: Floats, pivot: Floats, entered: Floats, moments: Floats, final: Floats,
) -> float:  # fmt: skip
    """Return the log2-likelihood of a sequence, or ``UNSURE``, and add its expected counts to the arrays.

    Parameters
    ----------
    frames : (T, D).
    allowed : (T, M) the branches that may be active in each frame; (0, M) if all may.
    cuts : (T,) ``FREE``, ``MUST`` or ``NEVER``; (0,) if all are free.
    entry, stay, leave : (G, LANES), (V, LANES), (V, LANES) probabilities.
    weight, shift, constant : (V, D, LANES), (V, D, LANES), (V, LANES). The log2 density is constant - sum over D of
        (x weight - shift)^2, where x is the frame minus ``pivot`` (D,), relative to an upper limit of all densities.
    entered : (G, LANES) expected segments of each branch.
    moments : (V, 1 + 2 D, LANES) expected frames in each state, and the sums of the features minus ``pivot``, and of
        their squares, over these.
    final : (V, LANES) probability of each state in the last frame.
    """
    n_frames, n_features = frames.shape
    n_vectors = len(stay)
    n_blocks = (n_frames + BLOCK - 1) // BLOCK
    block = np.zeros((BLOCK, n_features))
    n_kept = min(n_blocks, max(1, KEPT // n_vectors))
    first_kept = n_blocks - n_kept  # blocks from here on have their own memory; those before share the first
    # One array for all that is large: with several, memory would be returned and allocated again for each sequence.
    room, n_densities = np.empty(n_kept * (BLOCK + NOTHING + 1) * stay.size), n_kept * BLOCK * stay.size
    kept = room[:n_densities].reshape(n_kept, BLOCK, n_vectors, LANES)
    alphas = room[n_densities:].reshape(n_kept, NOTHING + 1, n_vectors, LANES)
    scales, nodes = np.empty((n_kept, BLOCK + 1)), np.empty((n_kept, BLOCK + 1))
    checkpoints, returns = np.empty((n_blocks, n_vectors, LANES)), np.empty(n_blocks)
    alphas[:, NOTHING] = 0.0

    likelihood, left, n = 0.0, 1.0, 0
    checkpoints[0], returns[0] = 0.0, 1.0
    for j in range(n_blocks):
        i = max(0, j - first_kept)
        copy(checkpoints[j], alphas[i, 0])
        nodes[i, 0] = returns[j]
        n = load(frames, j * BLOCK, pivot, block)
        densities(n, block, weight, shift, constant, kept[i])
        bar(j * BLOCK, n, allowed, kept[i], 0.0)
        left = _forward(j * BLOCK, n, cuts, kept[i], entry, stay, leave, alphas[i], scales[i], nodes[i])
        if left == 0.0:
            return UNSURE
        for k in range(n):
            if scales[i, k + 1] != 1.0:
                likelihood -= math.log2(scales[i, k + 1])
        if j + 1 < n_blocks:
            copy(alphas[i, n], checkpoints[j + 1])
            returns[j + 1] = nodes[i, n]
    likelihood += math.log2(left)

    bound, beta = 1.0, np.full(stay.shape, 1.0 / left)
    copy(alphas[n_kept - 1, n], final)
    scale(final, 1.0 / left)
    for j in range(n_blocks - 1, -1, -1):
        i = max(0, j - first_kept)
        n = load(frames, j * BLOCK, pivot, block)
        if j < first_kept:
            copy(checkpoints[j], alphas[i, 0])
            nodes[i, 0] = returns[j]
            densities(n, block, weight, shift, constant, kept[i])
            bar(j * BLOCK, n, allowed, kept[i], 0.0)
            _forward(j * BLOCK, n, cuts, kept[i], entry, stay, leave, alphas[i], scales[i], nodes[i])
        bound = _backward(
            j * BLOCK, n, cuts, kept[i], entry, stay, leave, alphas[i], scales[i], nodes[i], beta, entered
        )
        _gather(n, block, alphas[i], moments)
    return likelihood if abs(bound - 1.0) < AGREEMENT else UNSURE
