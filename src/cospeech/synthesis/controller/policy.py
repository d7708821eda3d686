"""The online controller: a Markov decision process over the library's pieces (Levine et al. 2010, 7.2, appendix A).

A decision is made at the end of each piece. The value of showing segment a' next, after piece (a, f_k) and in hidden
state i, is V(a', a, f_k, i) in the paper: a table of A * B * I numbers. It factors, because the transition cost is
the only term that depends on where a' was entered from:

    V(a', a, f_k, i) = S(a, f_k, a') + U(a', i),

and U(a', i), the value from the first frame of a' on, is the value of its first piece. With W(b, i) for the value of
piece b from its first frame on, in state i at that frame,

    W(b, i) = c(b, i) + eta^n * min( min over a' of [S(b, a') + sum over j of P_n(j | i) U(a', j)],
                                     sum over j of P_n(j | i) W(b + 1, j) if b is not the last piece of its segment ),
    c(b, i) = sum over g = 0 ... n - 1 of eta^g * sum over j of P_g(j | i) delta_a(j),

where n is the number of frames of the piece. B * I numbers remain. They are found by policy iteration, which reaches
the fixed point of value iteration in fewer steps over all pairs of pieces and segments.

Discounts. Entering a segment shows f_1 + 1 frames, 0 ... f_1. Appendix A prints eta^f_1 and P_f_1 for what follows
(with a sum over g = 1 ... f_1 after the cost C of frame 0), which loses one frame; and when a segment continues, it
prints the sum over g = 1 ... n and C = 0, so that the first frame shown is not paid for, and the one after the piece
is paid for twice. As written above, the recursion equals that of 7.2 over single frames where the state does not
change (P = I), which is tested. ``discounts="printed"`` is off by about one frame per segment, which is 5 to 12 %.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.synthesis.controller import policy_kernels
from cospeech.synthesis.controller.library import Path, Pieces, Rows
from cospeech.synthesis.controller.policy_kernels import CONTINUE, UNKNOWN

Discounts = Literal["corrected", "printed"]

BLOCK_BYTES = 8_000_000
"""Size of a block of successor costs that are not kept."""

ITERATIONS = 200
SWEEPS = 2_000


class Policy(NamedTuple):
    """An optimal policy.

    Attributes
    ----------
    values : (B, I) W, the expected discounted cost from the first frame of each piece on.
    entering : (A, I) U, that from the first frame of each segment on.
    iterations : policy improvements.
    error_bound : no value is further than this from its exact value.
    """

    values: Floats
    entering: Floats
    iterations: int
    error_bound: float


class Decision(NamedTuple):
    """The ``segment`` to show next from its first frame on, or ``CONTINUE``, and the expected discounted ``cost``."""

    segment: int
    cost: float


def solve(
    cut: Pieces,
    rows: Rows,
    distances: Floats,
    transitions: Floats,
    discount: float,
    discounts: Discounts = "corrected",
    tolerance: float = 1e-12,
    offers: Floats | None = None,
    surcharge: Floats | None = None,
) -> Policy:
    """Return the optimal policy.

    Parameters
    ----------
    rows : successor costs, see ``library.cost_rows``.
    distances : (A, I) delta, the cost per frame of each segment in each state.
    transitions : (I, I) probabilities of the next state, from row to column, per frame.
    discount : eta, per frame, below 1.
    discounts : see the module.
    tolerance : largest error of a value, relative to the largest value.
    offers : (B, I) cost of a further continuation after each piece, if there is one (see ``semantics``).
    surcharge : (B,) added to the cost of each piece, if there is one.

    Raises
    ------
    UserError : for printed discounts of a library with a segment whose first piece has one frame, which they neither
        discount nor count as time.
    """
    n_pieces, n_states = len(cut.segment), len(transitions)
    terms, steps = _terms(cut, discounts)
    factors = discount**steps
    lengths, power_of = np.unique(steps, return_inverse=True)
    powers = np.array([np.linalg.matrix_power(transitions, int(n)) for n in lengths])
    turned = np.ascontiguousarray(powers.swapaxes(1, 2))
    costs = np.empty((n_pieces, n_states))
    policy_kernels.piece_costs(cut.segment, terms, distances, transitions, discount, costs)
    if surcharge is not None:
        costs += surcharge[:, None]
    further = np.full((n_pieces, n_states), np.inf) if offers is None else offers
    values, improved = costs / (1.0 - factors[:, None]), np.empty((n_pieces, n_states))
    choices, jumps = np.full((n_pieces, n_states), UNKNOWN), np.zeros((n_pieces, n_states))
    expected = np.empty((len(lengths), len(distances), n_states))
    amplified = factors.max() / (1.0 - factors.max())
    reachable = max(tolerance, 4.0 * np.finfo(float).eps * amplified)  # rounding errors are amplified as well
    block = max(1, min(n_pieces, BLOCK_BYTES // (8 * len(distances))))
    bound, iteration = np.inf, 0
    for iteration in range(1, ITERATIONS + 1):  # noqa: B007  # it is returned
        policy_kernels.entering_values(turned, values[cut.first[:-1]], expected)
        least = expected.min(axis=1)
        excess = (expected - least[:, None]).min(axis=2)
        for start in range(0, n_pieces, block):
            policy_kernels.improve(
                start, rows(slice(start, start + block)), cut.closing, power_of, turned, costs, factors, further,
                expected, least, excess, values, choices, jumps, improved,
            )  # fmt: skip
        bound = float(amplified * np.abs(improved - values).max())
        values, improved = improved, values
        scale = reachable * np.abs(values).max()
        if bound <= scale:
            break
        policy_kernels.evaluate(
            cut.first, power_of, powers, turned, costs, factors, choices, jumps,
            max(0.1 * scale / amplified, 1e-2 * bound / amplified), SWEEPS, values,
        )  # fmt: skip
    return Policy(values, values[cut.first[:-1]], iteration, bound)


def _terms(cut: Pieces, discounts: Discounts) -> tuple[Integers, Integers]:
    """Return the first and last g of the sum over each piece (B, 2), and the frames until the next decision (B,)."""
    steps, entered = cut.length, cut.begin == 0
    zeros = np.zeros(len(steps), dtype=np.int64)
    if discounts == "corrected":
        return np.stack([zeros, steps - 1], axis=1), steps
    printed = np.where(entered, steps - 1, steps)
    if printed.min() < 1:
        raise UserError(
            f"segment {int(cut.segment[np.argmin(printed)])} may be interrupted after its first frame, which the "
            "printed discounts cannot handle; use discounts: corrected, or longer segments"
        )
    return np.stack([np.where(entered, zeros, 1), printed], axis=1), printed


def decide(policy: Policy, cut: Pieces, row: Floats, piece: int, belief: Floats) -> Decision:
    """Return what to show after ``piece``, given the belief (I,) at the next frame.

    This is the argmin over (a', f') of the sum over i of alpha(i) V(a', f', a, f, i) (Levine et al. 2010, 7.2).

    Parameters
    ----------
    row : (A,) successor costs of the piece.
    """
    return Decision(*policy_kernels.decide(policy.values, policy.entering, cut.closing, row, piece, belief))


def begin(policy: Policy, belief: Floats) -> Decision:
    """Return the segment to start with."""
    candidates = policy.entering @ belief
    best = int(np.argmin(candidates))
    return Decision(best, float(candidates[best]))


def play(policy: Policy, cut: Pieces, rows: Rows, beliefs: Floats) -> Path:
    """Return the path that the policy selects step by step, from the beliefs (T, I) of the forward algorithm."""
    segment, frame = np.empty(len(beliefs), dtype=np.int64), np.empty(len(beliefs), dtype=np.int64)
    piece = -1
    for t, belief in enumerate(beliefs):
        if piece < 0 or frame[t - 1] == cut.end[piece]:
            if piece < 0:
                decision = begin(policy, belief)
            else:
                decision = decide(policy, cut, rows(slice(piece, piece + 1))[0], piece, belief)
            piece = piece + 1 if decision.segment == CONTINUE else int(cut.first[decision.segment])
            frame[t] = cut.begin[piece]
        else:
            frame[t] = frame[t - 1] + 1
        segment[t] = cut.segment[piece]
    return Path(segment, frame)


def undominated_share(policy: Policy, cut: Pieces, rows: Rows) -> float:
    """Return the share of entries V(a', a, f_k, .) that no other entry of the same (a, f_k) undercuts in every state.

    The others are never chosen, whatever the belief; the paper prunes them, "usually about 98 %" (7.2). A run-time
    scan of all segments is fast enough without, so the share is only reported.
    """
    n_segments = len(policy.entering)
    n_kept = n_entries = 0
    kept = np.empty(n_segments + 1, dtype=np.int64)
    for piece in range(len(cut.segment)):
        row = rows(slice(piece, piece + 1))[0]
        options = policy.entering + row[:, None]
        if not cut.closing[piece]:
            options[cut.segment[piece]] = policy.values[piece + 1]
        order = np.argsort(options.sum(axis=1), kind="stable")
        n_kept += policy_kernels.undominated(options, order, kept)
        n_entries += len(options)
    return n_kept / n_entries
