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
    entry : (N, K) probabilities of the entries of c_i, the latest first. elapsed : (N, K) their elapsed shares.
    odds : (N, K) (1 - f_i) / f_i at the elapsed share, from which f_i follows without an exponential per entry.
    n_entries : (N,) number of entries.
    """

    start: Floats
    entry: Floats
    elapsed: Floats
    odds: Floats
    n_entries: Integers


class Successors(NamedTuple):
    """The probabilities of the next start state, sparse: most pairs of clusters never follow one another.

    Attributes
    ----------
    base : (N, 2) what the transitions from s_i and from c_i to every start state have in common.
    n_more : (N,) number of clusters to which there is more. cluster : (N, L) these clusters.
    more : (N, L, 2) what is added for each of them.
    """

    base: Floats
    n_more: Integers
    cluster: Integers
    more: Floats


def successors(after_start: Floats, after: Floats) -> Successors:
    """Return the sparse form of T_si,sj and T_ci,sj, (N, N) each."""
    whole = np.stack([after_start, after], axis=2)
    base = whole.min(axis=1)
    more = whole - base[:, None]
    linked = (more > 0.0).any(axis=2)
    n_more = linked.sum(axis=1)
    cluster = np.argsort(~linked, axis=1, kind="stable")[:, : max(1, int(n_more.max()))]
    return Successors(base, n_more, cluster, np.take_along_axis(more, cluster[:, :, None], axis=1))


def empty(n_clusters: int, mode: int) -> Belief:
    """Return a belief of zeros, with as much room for entries as the mode needs."""
    entry, elapsed, odds = np.zeros((3, n_clusters, N_ENTRIES if mode == EXACT else 1))
    return Belief(np.zeros(n_clusters), entry, elapsed, odds, np.zeros(n_clusters, dtype=np.int64))


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
    following: Any,
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
    continuing, logit, length_s : see ``chain.Chain``. following : see ``Successors``, as a tuple.
    emission : (2, N) probabilities of the observation in s_i and c_i.
    passed_s : time since the previous observation.
    ended : (N,) clusters whose subunit has ended since, so that A_t is not c_i (5.4).
    before, new : the beliefs before and after the observation, as tuples.
    """
    start, entry, elapsed, odds, n_entries = before
    new_start, new_entry, new_elapsed, new_odds, new_n = new
    base, n_more, cluster, more = following
    n, room = entry.shape
    everywhere, total = 0.0, 0.0
    for j in range(n):
        new_start[j] = 0.0
    for i in range(n):
        share = passed_s / length_s[i]
        growth = np.exp(-logit[i, 1] * share)
        kept = 1
        new_entry[i, 0], new_elapsed[i, 0] = start[i] * continuing[i], share
        new_odds[i, 0] = np.exp(-(logit[i, 0] + logit[i, 1] * share))
        leaving = 0.0
        for k in range(n_entries[i]):
            weight = entry[i, k]
            if weight < NEGLIGIBLE:
                continue
            reached, against = elapsed[i, k] + share, odds[i, k] * growth
            onward = 1.0 / (1.0 + against)
            leaving += weight * (1.0 - onward)
            weight *= onward
            if kept < room:
                new_entry[i, kept], new_elapsed[i, kept], new_odds[i, kept] = weight, reached, against
                kept += 1
            elif new_entry[i, kept - 1] + weight > 0.0:
                last = kept - 1
                new_entry[i, last] += weight
                new_elapsed[i, last] += (reached - new_elapsed[i, last]) * weight / new_entry[i, last]
                new_odds[i, last] = np.exp(-(logit[i, 0] + logit[i, 1] * new_elapsed[i, last]))
        new_n[i] = kept
        weight = 0.0 if ended[i] else emission[1, i]
        for k in range(kept):
            new_entry[i, k] *= weight
            total += new_entry[i, k]
        everywhere += start[i] * base[i, 0] + leaving * base[i, 1]
        for k in range(n_more[i]):
            new_start[cluster[i, k]] += start[i] * more[i, k, 0] + leaving * more[i, k, 1]
    for j in range(n):
        new_start[j] = (new_start[j] + everywhere) * emission[0, j]
        total += new_start[j]
    scale = 1.0 / total
    for i in range(n):
        new_start[i] *= scale
        for k in range(new_n[i]):
            new_entry[i, k] *= scale
        if mode == PRINTED and new_entry[i, 0] > 0.0:
            new_elapsed[i, 0] *= total / emission[1, i]
            new_odds[i, 0] = np.exp(-(logit[i, 0] + logit[i, 1] * new_elapsed[i, 0]))


@njit
def carried(entry: Any, n_entries: Any, i: int) -> float:
    """Return alpha(c_i)."""
    total = 0.0
    for k in range(n_entries[i]):
        total += entry[i, k]
    return total


def probabilities(belief: Belief) -> Floats:
    """Return alpha, (2, N): of the start states and of the continuation states."""
    used = np.arange(belief.entry.shape[1]) < belief.n_entries[:, None]
    return np.stack([belief.start, np.where(used, belief.entry, 0.0).sum(axis=1)])


def expected_share(belief: Belief) -> Floats:
    """Return the expectation of the elapsed share of each continuation state, (N,); 0 where it has no probability."""
    used = np.arange(belief.entry.shape[1]) < belief.n_entries[:, None]
    weight = np.where(used, belief.entry, 0.0)
    total = weight.sum(axis=1)
    return np.asarray((weight * belief.elapsed).sum(axis=1) / np.where(total > 0.0, total, 1.0), dtype=np.float64)


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
    start, entry, _, _, n_entries = belief
    n = len(start)
    going_on = carried(entry, n_entries, shown)
    total, alone = gamma[n] * going_on, gamma[n]
    for j in range(n):
        total += gamma[j] * start[j]
        alone += gamma[j]
    if total > 0.0:
        for j in range(n):
            gamma[j] *= start[j] / total
        gamma[n] *= going_on / total
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
