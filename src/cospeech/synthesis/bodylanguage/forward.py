"""Compiled forward and direct probabilities of one body section (Levine 2009, 5.2 to 5.4).

The probability of going on with a subunit depends on the share tau of it that has elapsed, and tau on the time at
which it was entered. A belief therefore consists of

- the probabilities of the start states, alpha(s_i), and
- for each continuation state c_i, *entries*: the probability that A_t = c_i was entered at a certain earlier
  observation, and the share that has elapsed since then. Their probabilities add up to alpha(c_i).

``EXACT`` carries all entries on, which gives the exact forward probabilities of the model. The thesis carries one
expected share on, as the other two modes do with a single entry per state. ``EXPECTED`` is what follows from its
equation 5.2: the denominator of 5.3 is the sum of the two weights in the numerator. ``PRINTED`` divides by alpha(c_i)
as 5.3 is printed, although alpha also contains the probability of the observation and is normalised.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit

EXACT, EXPECTED, PRINTED = range(3)
MODES = ("exact", "expected", "printed")
"""The names of the modes, in their order."""

N_ENTRIES = 64
"""Number of entries per state. If there are more, the two oldest are combined."""

NEGLIGIBLE = 1e-12
"""Entries of a smaller probability are dropped."""


class Belief(NamedTuple):
    """The forward probabilities of N clusters.

    Attributes
    ----------
    start : (N,) alpha(s_i).
    entry : (K, N) probabilities of the entries of c_i, the latest first. elapsed : (K, N) their elapsed shares.
    n_entries : (1,) number of rows in use.
    """

    start: Floats
    entry: Floats
    elapsed: Floats
    n_entries: Integers


def empty(n_clusters: int, mode: int) -> Belief:
    """Return a belief of zeros, with as many entries as the mode needs."""
    n_entries = N_ENTRIES if mode == EXACT else 1
    return Belief(
        np.zeros(n_clusters),
        np.zeros((n_entries, n_clusters)),
        np.zeros((n_entries, n_clusters)),
        np.zeros(1, dtype=np.int64),
    )


def first(initial: Floats, mode: int) -> Belief:
    """Return the belief before the first observation: a subunit starts."""
    belief = empty(len(initial), mode)
    belief.start[:] = initial
    return belief


@njit
def continuation(logit: Any, elapsed: float) -> float:
    """Return f(tau) of an intercept and a slope, (2,)."""
    return 1.0 / (1.0 + np.exp(-(logit[0] + logit[1] * elapsed)))


@njit
def update(
    continuing: Any,
    after_start: Any,
    after: Any,
    emission: Any,
    logit: Any,
    length_s: Any,
    passed_s: float,
    ended: Any,
    mode: int,
    before: Any,
    new: Any,
) -> None:
    """Write the belief after an observation: equations 5.1 and 5.3.

    Parameters
    ----------
    continuing, after_start, after, logit, length_s : see ``chain.Chain``.
    emission : (2, N) probabilities of the observation in s_i and c_i.
    passed_s : time since the previous observation.
    ended : (N,) clusters whose subunit has ended since, so that A_t is not c_i (5.4).
    before, new : the beliefs before and after the observation, (start, entry, elapsed, n_entries) each.
    """
    start, entry, elapsed, n_entries = before
    new_start, new_entry, new_elapsed, new_n = new
    n, n_rows = len(start), n_entries[0]
    rows = min(n_rows + 1, len(entry))
    new_start[:] = 0.0
    total = 0.0
    for i in range(n):
        share = passed_s / length_s[i]
        # entries move up by one row; those beyond the last row are combined with it
        for row in range(rows):
            new_entry[row, i] = 0.0
            new_elapsed[row, i] = 0.0
        begun = start[i] * continuing[i]
        new_entry[0, i], new_elapsed[0, i] = begun, share
        leaving = 0.0
        for row in range(n_rows):
            weight = entry[row, i]
            if weight < NEGLIGIBLE:
                continue
            reached = elapsed[row, i] + share
            onward = continuation(logit[i], reached)
            leaving += weight * (1.0 - onward)
            to = min(row + 1, len(entry) - 1)
            stays = weight * onward
            whole = new_entry[to, i] + stays
            if whole > 0.0:
                new_elapsed[to, i] += (reached - new_elapsed[to, i]) * stays / whole
            new_entry[to, i] = whole
        weight = 0.0 if ended[i] else emission[1, i]
        for row in range(rows):
            new_entry[row, i] *= weight
            total += new_entry[row, i]
        for j in range(n):
            new_start[j] += start[i] * after_start[i, j] + leaving * after[i, j]
    for j in range(n):
        new_start[j] *= emission[0, j]
        total += new_start[j]
    for i in range(n):
        new_start[i] /= total
        for row in range(rows):
            new_entry[row, i] /= total
        if mode == PRINTED and new_entry[0, i] > 0.0:
            new_elapsed[0, i] *= total / emission[1, i]
    while rows > 0 and new_entry[rows - 1].max() < NEGLIGIBLE:
        rows -= 1
    new_n[0] = rows


@njit
def probabilities(belief: Any, result: Any) -> None:
    """Write alpha into ``result``, (2, N): of the start states and of the continuation states."""
    start, entry, _, n_entries = belief
    result[0] = start
    result[1] = 0.0
    for row in range(n_entries[0]):
        for i in range(len(start)):
            result[1, i] += entry[row, i]


@njit
def direct(
    continuing: Any,
    after_start: Any,
    after: Any,
    emission: Any,
    logit: Any,
    shown: int,
    shown_started: bool,
    shown_elapsed: float,
    ended: bool,
    result: Any,
) -> None:
    """Write the direct probabilities gamma, (N + 1,), without normalising them: equation 5.4.

    Only the shown subunit can be continued. The last element is the probability of that, and the others are those of
    the start states.

    Parameters
    ----------
    shown : cluster of the subunit that is shown. shown_started : whether it is in its start state.
    shown_elapsed : share of it that has been shown.
    ended : whether it is over, so that it cannot continue.
    """
    n = len(continuing)
    if shown_started and not ended:
        result[n] = continuing[shown] * emission[1, shown]
        for j in range(n):
            result[j] = after_start[shown, j] * emission[0, j]
    else:
        onward = 0.0 if ended else continuation(logit[shown], shown_elapsed)
        result[n] = onward * emission[1, shown]
        for j in range(n):
            result[j] = (1.0 - onward) * after[shown, j] * emission[0, j]


@njit
def combine(belief: Any, shown: int, gamma: Any) -> None:
    """Multiply direct probabilities (N + 1,) by forward probabilities, and normalise the product (5.3).

    If the forward probabilities are zero wherever the direct ones are not, the direct ones are normalised alone.
    """
    start, entry, _, n_entries = belief
    n = len(start)
    carried = 0.0
    for row in range(n_entries[0]):
        carried += entry[row, shown]
    total, alone = gamma[n] * carried, gamma[n]
    for j in range(n):
        total += gamma[j] * start[j]
        alone += gamma[j]
    if total > 0.0:
        for j in range(n):
            gamma[j] *= start[j] / total
        gamma[n] *= carried / total
    else:
        for j in range(n + 1):
            gamma[j] /= alone


@njit
def draw(distribution: Any, uniform: float) -> int:
    """Return an index drawn from a distribution by a number from 0 to 1."""
    total = 0.0
    last = 0
    for k in range(len(distribution)):
        if distribution[k] > 0.0:
            last = k
            total += distribution[k]
            if uniform < total:
                break
    return last
