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
    before: Float, density: Float, scale: float, node: float, entry: Float, stay: Float, come: Float, after: Float
) -> float:
    """Fill the states of ``after`` from those of ``before`` one frame earlier; return their sum.

    Rows are (M + S,): the first M places stand before the first states and hold what comes to them from the node.
    """
    n_branches = len(entry)
    for m in range(n_branches):
        before[m] = node * entry[m]
    total = 0.0
    states, to = before[n_branches:], after[n_branches:]
    for s in range(len(stay)):
        # A branch that is not allowed has density 0, and less than nothing here: nothing to speak of.
        value = (states[s] * stay[s] + before[s] * come[s]) * (scale * (density[s] - TINY))
        to[s] = value
        total += value
    return total


@numba.njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _leaving(states: Float, leave: Float) -> float:
    """Return the probability of leaving a branch: the sum over the last states, ``leave`` being theirs."""
    total = 0.0
    first = states[len(states) - len(leave) :]
    for m in range(len(leave)):
        total += first[m] * leave[m]
    return total


@numba.njit(cache=True)
def _run(
    start: int, n: int, cuts: Cuts, density: Float, entry: Float, stay: Float, come: Float, leave: Float,
    alphas: Float, sums: Float,
) -> bool:  # fmt: skip
    """Go forward through a block of n frames: rows 1 to n of ``alphas`` and ``sums`` follow from row 0.

    Returns
    -------
    Whether every frame kept enough probability to be sure of.
    """
    n_branches = len(entry)
    last = leave[len(leave) - n_branches :]
    nothing = np.zeros(alphas.shape[1])
    for k in range(n):
        cut = cuts[start + k] if len(cuts) > 0 and start + k > 0 else FREE
        before, after = alphas[k], alphas[k + 1]
        node = 1.0 if start + k == 0 else 0.0 if cut == NEVER else _leaving(before, last)
        scale = 1.0 / sums[k]
        if cut == MUST:
            sums[k + 1] = _forward(nothing, density[k], scale, node, entry, stay, come, after)
            copy(nothing[:n_branches], before)
        else:
            sums[k + 1] = _forward(before, density[k], scale, node, entry, stay, come, after)
        if not sums[k + 1] > LEAST_SCALE:
            return False
    return True


@numba.njit(cache=True, fastmath={"contract"})
def _follow(density: Float, beta: Float, scale: float, follow: Float) -> None:
    """Fill the states of ``follow`` (S + M,): what a state of this frame is worth to the frame before."""
    for s in range(len(density)):
        follow[s] = density[s] * beta[s] * scale


@numba.njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _enter(follow: Float, came: Float, entry: Float, entered: Float) -> float:
    """Add the segments that begin in a frame to ``entered`` (M,); return what the shared node is worth."""
    node = 0.0
    for m in range(len(entry)):
        node += entry[m] * follow[m]
        entered[m] += came[m] * follow[m]
    return node


@numba.njit(cache=True, fastmath={"contract"})
def _backward(follow: Float, stay: Float, leave: Float, beta: Float) -> None:
    """Fill ``beta`` (S,) of the frame before the one of ``follow`` (S + M,), whose last M places hold the node."""
    then = follow[len(follow) - len(stay) :]
    for s in range(len(stay)):
        beta[s] = (stay[s] * follow[s] + leave[s] * then[s]) + TINY


@numba.njit(cache=True)
def _return(
    start: int, n: int, cuts: Cuts, density: Float, entry: Float, stay: Float, leave: Float,
    alphas: Float, sums: Float, betas: Float, follows: Float, entered: Float,
) -> float:  # fmt: skip
    """Go backward through a block of n frames: rows n - 1 to 0 of ``betas`` follow from row n, and ``follows``.

    Returns
    -------
    What the shared node before the block is worth: at the start of a sequence its likelihood's upper bound, relative
    to the lower one.
    """
    n_states, node = len(stay), 1.0
    for k in range(n - 1, -1, -1):
        cut = cuts[start + k] if len(cuts) > 0 else FREE
        follow = follows[k]
        _follow(density[k], betas[k + 1], 1.0 / sums[k], follow)
        node = _enter(follow, alphas[k], entry, entered)
        if cut == MUST:
            follow[:n_states] = 0.0
        follow[n_states:] = 0.0 if cut == NEVER else node
        _backward(follow, stay, leave, betas[k])
    return node


@numba.njit(cache=True, fastmath={"contract"})
def _posterior(n: int, alphas: Float, betas: Float, follows: Float) -> None:
    """Turn rows 1 to n of ``betas`` into posterior probabilities, and make the rows of absent frames nothing."""
    n_branches = alphas.shape[1] - betas.shape[1]
    for k in range(n):
        alpha, beta = alphas[k + 1, n_branches:], betas[k + 1]
        for s in range(len(beta)):
            beta[s] *= alpha[s]
    betas[n + 1 :] = 0.0
    follows[n:] = 0.0


@numba.njit(cache=True, fastmath={"contract"})
def _gather(
    n: int, block: Float, alphas: Float, gammas: Float, follows: Float,
    occupied: Float, stayed: Float, first: Float, second: Float,
) -> None:  # fmt: skip
    """Add a block's frames in each state, its stays, and the sums of features and squares, four frames at a time."""
    n_branches = alphas.shape[1] - len(occupied)
    for k in range(0, n, 4):
        g0, g1, g2, g3 = gammas[k + 1], gammas[k + 2], gammas[k + 3], gammas[k + 4]
        f0, f1, f2, f3 = follows[k], follows[k + 1], follows[k + 2], follows[k + 3]
        a0, a1 = alphas[k, n_branches:], alphas[k + 1, n_branches:]
        a2, a3 = alphas[k + 2, n_branches:], alphas[k + 3, n_branches:]
        for s in range(len(occupied)):
            occupied[s] += g0[s] + g1[s] + g2[s] + g3[s]
        for s in range(len(occupied)):
            stayed[s] += a0[s] * f0[s] + a1[s] * f1[s] + a2[s] * f2[s] + a3[s] * f3[s]
        for d in range(len(first)):
            x0, x1, x2, x3 = block[d, k], block[d, k + 1], block[d, k + 2], block[d, k + 3]
            q0, q1, q2, q3 = x0 * x0, x1 * x1, x2 * x2, x3 * x3
            one, two = first[d], second[d]
            for s in range(len(occupied)):
                one[s] += g0[s] * x0 + g1[s] * x1 + g2[s] * x2 + g3[s] * x3
            for s in range(len(occupied)):
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
    n_frames, n_states, n_branches = len(frames), len(stay), len(entry)
    n_blocks = (n_frames + BLOCK - 1) // BLOCK
    block, rows, top = np.zeros((weight.shape[1], BLOCK)), np.empty((n_states, PITCH)), np.empty(BLOCK)
    density, sums = np.empty((BLOCK, n_states)), np.ones(BLOCK + 1)
    alphas, betas = np.zeros((BLOCK + 1, n_branches + n_states)), np.zeros((BLOCK + 1, n_states))
    follows, come = np.zeros((BLOCK, n_states + n_branches)), np.ones(n_states)
    copy(leave[: n_states - n_branches], come[n_branches:])
    checkpoints, scales = np.zeros((n_blocks, n_branches + n_states)), np.ones(n_blocks)

    likelihood, product, n = 0.0, 1.0, 0
    for j in range(n_blocks):
        copy(alphas[n], checkpoints[j])
        copy(alphas[n], alphas[0])
        scales[j] = sums[0] = sums[n]
        n = fill(frames, j * BLOCK, pivot, allowed, weight, shift, constant, block, rows, top, density)
        if not _run(j * BLOCK, n, cuts, density, entry, stay, come, leave, alphas, sums):
            return UNSURE
        for k in range(n):
            likelihood += top[k]
            product *= sums[k + 1]
            if product < 1e-100:
                likelihood += math.log2(product)
                product = 1.0
    likelihood += math.log2(product)

    bound, beta = 1.0, np.full(n_states, 1.0 / sums[n])
    for s in range(n_states):
        left[s] = -alphas[n, n_branches + s] / sums[n]
    for j in range(n_blocks - 1, -1, -1):
        copy(checkpoints[j], alphas[0])
        sums[0] = scales[j]
        n = fill(frames, j * BLOCK, pivot, allowed, weight, shift, constant, block, rows, top, density)
        _run(j * BLOCK, n, cuts, density, entry, stay, come, leave, alphas, sums)
        copy(beta, betas[n])
        bound = _return(j * BLOCK, n, cuts, density, entry, stay, leave, alphas, sums, betas, follows, entered)
        copy(betas[0], beta)
        _posterior(n, alphas, betas, follows)
        _gather(n, block, alphas, betas, follows, occupied, stayed, first, second)
    for s in range(n_states):
        stayed[s] *= stay[s]
        left[s] = max(left[s] + occupied[s] - stayed[s], 0.0)
    return likelihood if abs(bound - 1.0) < AGREEMENT else UNSURE
