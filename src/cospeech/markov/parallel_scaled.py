"""Compiled expectation of the parallel HMM with scaled probabilities: fast, and sure of its result or it says so.

Probabilities relative to a frame's most likely state may become too small for a double. Going forward such a one is
rounded down to nothing, going backward up to ``TINY``: the two passes bound the likelihood from below and from above.
Where both ends meet, nothing was lost; where not, ``UNSURE`` is returned and the logarithms of ``parallel_exact``
have to do it.

States lie flat, place by place: state s = n * M + m is place n of branch m, so that the first M states are where
branches begin, the last M where they end, and a state's predecessor lies M before it. Memory hardly grows with the
length of a sequence: the forward pass keeps one frame in ``BLOCK``, and each block is computed anew when the backward
pass arrives there.
"""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from cospeech.markov.parallel_density import (
    BLOCK,
    PITCH,
    TINY,
    Bool,
    Float,
    copy,
    fill,
)  # fmt: skip

FREE, MUST, NEVER = 0, 1, 2
"""A frame's cut: a segment may begin here, must begin here, or must not."""

UNSURE = math.nan
AGREEMENT = 1e-8
"""Relative difference of the two bounds of a likelihood up to which they are one."""

LEAST_SCALE = 1e-200
"""A frame less likely than this, relative to its best state, is left to logarithms."""

Cuts = npt.NDArray[np.int8]


@numba.njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _forward(
    before: Float, density: Float, cut: int, scale: float, entry: Float, stay: Float, leave: Float, after: Float
) -> tuple[float, float]:
    """Fill ``after`` (S,) from ``before`` (S,) one frame earlier, times ``scale``; return node and sum."""
    n_branches, n_states = len(entry), len(stay)
    last = n_states - n_branches
    node = 0.0
    for m in range(n_branches):
        node += before[last + m] * leave[last + m]
    node *= 0.0 if cut == NEVER else scale
    within = 0.0 if cut == MUST else scale
    total = 0.0
    for s in range(n_branches):
        # A branch that is not allowed has density 0, and less than nothing here: nothing to speak of.
        value = (before[s] * stay[s] * within + entry[s] * node) * (density[s] - TINY)
        after[s] = value
        total += value
    came, left, here, kept, now, to = (
        before[:last], leave[:last], before[n_branches:], stay[n_branches:], density[n_branches:], after[n_branches:],
    )  # fmt: skip
    for s in range(last):
        value = (here[s] * kept[s] + came[s] * left[s]) * (within * (now[s] - TINY))
        to[s] = value
        total += value
    return node, total


@numba.njit(cache=True, fastmath={"contract"})
def _first(density: Float, entry: Float, after: Float) -> float:
    """Fill ``after`` (S,) for the first frame of a sequence and return its sum."""
    after[:] = 0.0
    total = 0.0
    for m in range(len(entry)):
        after[m] = entry[m] * (density[m] - TINY)
        total += after[m]
    return total


@numba.njit(cache=True, fastmath={"contract"})
def _meet(
    alpha: Float, before: Float, density: Float, scale: float, within: float,
    beta: Float, follow: Float, gamma: Float, stayed: Float,
) -> None:  # fmt: skip
    """Where both passes meet in a frame: its posterior ``gamma``, transitions into it, and what it sends backward."""
    for s in range(len(beta)):
        f = density[s] * beta[s] * scale
        gamma[s] = alpha[s] * beta[s]
        stayed[s] += before[s] * f * within
        follow[s] = f


@numba.njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _backward(follow: Float, cut: int, entry: Float, stay: Float, leave: Float, beta: Float) -> float:
    """Fill ``beta`` (S,) of the frame before the one of ``follow`` (S,); return the sum over entries."""
    n_branches, n_states = len(entry), len(stay)
    last = n_states - n_branches
    node = 0.0
    for m in range(n_branches):
        node += entry[m] * follow[m]
    opened = 0.0 if cut == NEVER else node
    within = 0.0 if cut == MUST else 1.0
    then = follow[n_branches:]
    for s in range(last):
        beta[s] = within * (stay[s] * follow[s] + leave[s] * then[s]) + TINY
    for s in range(last, n_states):
        beta[s] = within * stay[s] * follow[s] + leave[s] * opened + TINY
    return node


@numba.njit(cache=True)
def _run(
    start: int, n: int, cuts: Cuts, density: Float, entry: Float, stay: Float, leave: Float,
    alphas: Float, sums: Float, nodes: Float,
) -> bool:  # fmt: skip
    """Go forward through a block of n frames: rows 1 to n of ``alphas`` and ``sums`` follow from row 0.

    Returns
    -------
    Whether every frame kept enough probability to be sure of.
    """
    for k in range(n):
        if start + k == 0:
            nodes[k], sums[k + 1] = 1.0, _first(density[k], entry, alphas[k + 1])
        else:
            cut = cuts[start + k] if len(cuts) > 0 else FREE
            nodes[k], sums[k + 1] = _forward(
                alphas[k], density[k], cut, 1.0 / sums[k], entry, stay, leave, alphas[k + 1]
            )
        if not sums[k + 1] > LEAST_SCALE:
            return False
    return True


@numba.njit(cache=True)
def _return(
    start: int, n: int, cuts: Cuts, density: Float, entry: Float, stay: Float, leave: Float,
    alphas: Float, sums: Float, nodes: Float, beta: Float, follow: Float, gamma: Float, entered: Float, stayed: Float,
) -> float:  # fmt: skip
    """Go backward through a block that ``_run`` left; fill its posterior ``gamma`` (BLOCK, S) and add the counts.

    Returns
    -------
    At the first frame of a sequence: the upper bound of its likelihood over the lower one.
    """
    bound = 1.0
    for k in range(n - 1, -1, -1):
        first = start + k == 0
        cut = MUST if first else cuts[start + k] if len(cuts) > 0 else FREE
        within = 0.0 if cut == MUST else 1.0
        _meet(alphas[k + 1], alphas[k], density[k], 1.0 / sums[k], within, beta, follow, gamma[k], stayed)
        for m in range(len(entry)):
            # The node already holds the scale that follow holds too.
            entered[m] += nodes[k] * sums[k] * entry[m] * follow[m]
        bound = _backward(follow, cut, entry, stay, leave, beta)
    for k in range(n, BLOCK):
        gamma[k] = 0.0
    return bound


@numba.njit(cache=True, fastmath={"contract"})
def _gather(gamma: Float, n: int, block: Float, occupied: Float, first: Float, second: Float) -> None:
    """Add a block's posterior (BLOCK, S), and its products with features and squares, four frames at a time."""
    for k in range(0, n, 4):
        g0, g1, g2, g3 = gamma[k], gamma[k + 1], gamma[k + 2], gamma[k + 3]
        for s in range(len(occupied)):
            occupied[s] += g0[s] + g1[s] + g2[s] + g3[s]
        for d in range(len(first)):
            x0, x1, x2, x3 = block[d, k], block[d, k + 1], block[d, k + 2], block[d, k + 3]
            q0, q1, q2, q3 = x0 * x0, x1 * x1, x2 * x2, x3 * x3
            one, two = first[d], second[d]
            for s in range(len(occupied)):
                one[s] += g0[s] * x0 + g1[s] * x1 + g2[s] * x2 + g3[s] * x3
                two[s] += g0[s] * q0 + g1[s] * q1 + g2[s] * q2 + g3[s] * q3


@numba.njit(cache=True)
def expect(
    frames: Float, allowed: Bool, cuts: Cuts, entry: Float, stay: Float, leave: Float,
    weight: Float, shift: Float, constant: Float, pivot: Float,
    entered: Float, occupied: Float, stayed: Float, left: Float, first: Float, second: Float,
) -> float:  # fmt: skip
    """Return the log2-likelihood of one sequence, or ``UNSURE``, and fill its expected counts, all zero so far.

    Parameters
    ----------
    frames : (T, D) one sequence.
    allowed : (T, M) the branches that may be active in each frame; (0, M) where all are, always.
    cuts : (T,) ``FREE``, ``MUST`` or ``NEVER``: whether a segment begins in a frame; (0,) where all are free.
    entry, stay, leave : (M,), (S,), (S,) probabilities.
    weight, shift, constant : (S, D), (S, D), (S,) with D padded to a multiple of ``CHUNK``; log2 density is
        constant - sum over D of (x weight - shift)^2, with x less ``pivot`` (D,).
    entered : (M,) expected segments of each branch.
    occupied, stayed, left : (S,) expected frames in each state, transitions to itself and away from it.
    first, second : (D, S) sums of the features less ``pivot``, and of their squares, over the state's frames.
    """
    n_frames, n_states = len(frames), len(stay)
    n_blocks = (n_frames + BLOCK - 1) // BLOCK
    block, rows, top = np.zeros((weight.shape[1], BLOCK)), np.empty((n_states, PITCH)), np.empty(BLOCK)
    density, alphas = np.empty((BLOCK, n_states)), np.zeros((BLOCK + 1, n_states))
    nodes, sums = np.empty(BLOCK), np.ones(BLOCK + 1)
    checkpoints, scales = np.zeros((n_blocks, n_states)), np.ones(n_blocks)

    likelihood, product, n = 0.0, 1.0, 0
    for j in range(n_blocks):
        copy(alphas[n], checkpoints[j])
        copy(alphas[n], alphas[0])
        scales[j] = sums[0] = sums[n]
        n = fill(frames, j * BLOCK, pivot, allowed, weight, shift, constant, block, rows, top, density)
        if not _run(j * BLOCK, n, cuts, density, entry, stay, leave, alphas, sums, nodes):
            return UNSURE
        for k in range(n):
            likelihood += top[k]
            product *= sums[k + 1]
            if product < 1e-100:
                likelihood += math.log2(product)
                product = 1.0
    likelihood += math.log2(product)

    beta, follow, gamma = np.full(n_states, 1.0 / sums[n]), np.empty(n_states), np.empty((BLOCK, n_states))
    for s in range(n_states):
        left[s] = -alphas[n, s] / sums[n]
    bound = 1.0
    for j in range(n_blocks - 1, -1, -1):
        copy(checkpoints[j], alphas[0])
        sums[0] = scales[j]
        n = fill(frames, j * BLOCK, pivot, allowed, weight, shift, constant, block, rows, top, density)
        _run(j * BLOCK, n, cuts, density, entry, stay, leave, alphas, sums, nodes)
        bound = _return(
            j * BLOCK, n, cuts, density, entry, stay, leave, alphas, sums, nodes, beta, follow, gamma, entered, stayed
        )
        _gather(gamma, n, block, occupied, first, second)
    for s in range(n_states):
        stayed[s] *= stay[s]
        left[s] = max(left[s] + occupied[s] - stayed[s], 0.0)
    return likelihood if abs(bound - 1.0) < AGREEMENT else UNSURE
