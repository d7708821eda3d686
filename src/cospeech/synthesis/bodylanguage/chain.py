"""The hidden Markov model of the subunits of one body section (Levine 2009, chapter 4).

A hidden state is a cluster of subunits, m_i, with a start state s_i and a continuation state c_i, and the share tau
of the subunit that has elapsed. Its steps are the observations of syllables. With f_i(tau) for the probability that
another syllable ends within the subunit,

    P(A_t = c_i | A_(t-1) = s_i) = T_si,ci                  P(A_t = s_j | A_(t-1) = s_i) = T_si,sj
    P(A_t = c_i | A_(t-1) = c_i) = f_i(tau'_t)              P(A_t = s_j | A_(t-1) = c_i) = (1 - f_i(tau'_t)) T_ci,sj

where tau'_t is the share that has elapsed at observation t; f_i is a logistic function. In training, observation V_t
goes with the state that is active at the end of the *next* observation (4.4).

f_i is estimated by logistic regression over all observations within subunits of the cluster: whether the next one
ends within the same subunit, given the share that has elapsed. The thesis fits a logistic curve to the shares at the
final syllables, which leaves out how many syllables were not final: where the next syllable ends within the subunit
with probability 0.7, it finds almost 0.8. ``printed_fit`` is that curve, for comparison.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.synthesis.bodylanguage.observations import N_OBSERVATIONS, OCCURRING

LEAST_COUNT = 1e-3
"""Added to all counts of what can occur, so that the product of forward and direct probabilities is never empty."""

PRIOR_DEVIATION = 2.0
"""Standard deviation of the prior of the logit of f_i, whose mean is the fit over all clusters of the section."""

NEWTON_STEPS, TOLERANCE = 50, 1e-10


class Path(NamedTuple):
    """The states of one body section in a record, T steps.

    Attributes
    ----------
    observation : (T,) observation V_t.
    cluster : (T,) cluster that is active at the end of observation V_(t+1).
    start : (T,) whether A_t is a start state: the subunit is another one than that of the step before.
    elapsed : (T,) share of the subunit that has elapsed by the end of observation V_(t+1).
    """

    observation: Integers
    cluster: Integers
    start: Flags
    elapsed: Floats


class Chain(NamedTuple):
    """The parameters of the model of N clusters.

    Attributes
    ----------
    initial : (N,) probability that a record starts with a subunit of each cluster.
    continuing : (N,) T_si,ci.
    after_start : (N, N) T_si,sj; with ``continuing``, each row sums to 1.
    after : (N, N) T_ci,sj; each row sums to 1.
    emissions : (36, 2, N) probability of each observation in s_i and c_i.
    logit : (N, 2) intercept and slope of the logit of f_i.
    length_s : (N,) mean length of the subunits in seconds.
    """

    initial: Floats
    continuing: Floats
    after_start: Floats
    after: Floats
    emissions: Floats
    logit: Floats
    length_s: Floats


def estimate(paths: Sequence[Path], length_s: Floats) -> Chain:
    """Return the model of a section by counting (4.4).

    Parameters
    ----------
    paths : the states of the training records.
    length_s : (N,) mean length of the subunits of each cluster in seconds.
    """
    n = len(length_s)
    initial, continuing = np.full(n, LEAST_COUNT), np.full(n, LEAST_COUNT)
    after_start, after = np.full((n, n), LEAST_COUNT), np.full((n, n), LEAST_COUNT)
    emissions = np.zeros((N_OBSERVATIONS, 2, n))
    emissions[list(OCCURRING)] = LEAST_COUNT
    for path in paths:
        np.add.at(emissions, (path.observation, 1 - path.start.astype(np.int64), path.cluster), 1.0)
        initial[path.cluster[:1]] += 1.0
        before, now, was_start, is_start = path.cluster[:-1], path.cluster[1:], path.start[:-1], path.start[1:]
        np.add.at(continuing, before[was_start & ~is_start], 1.0)
        for table, chosen in ((after_start, was_start & is_start), (after, ~was_start & is_start)):
            np.add.at(table, (before[chosen], now[chosen]), 1.0)
    leaving = continuing + after_start.sum(axis=1)
    return Chain(
        initial / initial.sum(),
        continuing / leaving,
        after_start / leaving[:, None],
        after / after.sum(axis=1, keepdims=True),
        emissions / emissions.sum(axis=0),
        regression(*_continuations(paths), n),
        length_s,
    )


def _continuations(paths: Sequence[Path]) -> tuple[Integers, Floats, Flags]:
    """Return the cluster of each observation within a subunit, the elapsed share, and whether another one follows."""
    return (
        np.concatenate([np.empty(0, dtype=np.int64), *(path.cluster[:-1] for path in paths)]),
        np.concatenate([np.empty(0), *(path.elapsed[:-1] for path in paths)]),
        np.concatenate([np.empty(0, dtype=bool), *(~path.start[1:] for path in paths)]),
    )


def regression(cluster: Integers, elapsed: Floats, continues: Flags, n_clusters: int) -> Floats:
    """Return the intercept and slope of the logit of each f_i, (N, 2), by logistic regression.

    A cluster with little data stays near the fit over all clusters. Slopes are not positive, since a subunit becomes
    no more likely to continue as it elapses.

    Parameters
    ----------
    cluster, elapsed, continues : (M,) of all observations within subunits; see ``Path``.
    """
    pooled = _fit(elapsed, continues, np.zeros(2), 10.0 * PRIOR_DEVIATION)
    return np.array(
        [_fit(elapsed[cluster == i], continues[cluster == i], pooled, PRIOR_DEVIATION) for i in range(n_clusters)]
    )


def _fit(elapsed: Floats, continues: Flags, prior: Floats, deviation: float) -> Floats:
    """Return the most probable intercept and slope, (2,), with a slope of at most 0."""
    features = np.column_stack([np.ones(len(elapsed)), elapsed])
    found = _newton(features, continues, prior, deviation)
    if found[1] > 0.0:
        found = np.append(_newton(features[:, :1], continues, prior[:1], deviation), 0.0)
    return found


def _newton(features: Floats, continues: Flags, prior: Floats, deviation: float) -> Floats:
    """Return the mode of the posterior of the coefficients. Steps that overshoot are halved."""
    precision = 1.0 / deviation**2

    def objective(beta: Floats) -> float:
        logit = features @ beta
        fit = np.where(continues, logit, 0.0).sum() - np.logaddexp(0.0, logit).sum()
        return float(fit - 0.5 * precision * ((beta - prior) ** 2).sum())

    beta = prior.copy()
    value = objective(beta)
    for _ in range(NEWTON_STEPS):
        share = 1.0 / (1.0 + np.exp(-features @ beta))
        gradient = features.T @ (continues - share) - precision * (beta - prior)
        curvature = (features * (share * (1.0 - share))[:, None]).T @ features + precision * np.eye(len(beta))
        step = np.linalg.solve(curvature, gradient)
        while (new := objective(beta + step)) < value and np.abs(step).max() > TOLERANCE:
            step *= 0.5
        beta, value = beta + step, new
        if np.abs(step).max() <= TOLERANCE:
            break
    return beta


def printed_fit(paths: Sequence[Path], n_clusters: int) -> Floats:
    """Return the logistic curves of the thesis as intercepts and slopes, (N, 2).

    The curve of a cluster is the probability that its final syllable is later, under the logistic distribution that
    is most likely for the elapsed shares at final syllables. It is NaN if there are fewer than two different ones.
    """
    cluster, elapsed, continues = _continuations(paths)
    fits = np.full((n_clusters, 2), np.nan)
    for i in range(n_clusters):
        final = elapsed[(cluster == i) & ~continues]
        if len(final) > 1 and final.std() > 0.0:
            fits[i] = _logistic_distribution(final)
    return fits


def _logistic_distribution(values: Floats) -> Floats:
    """Return intercept and slope of the logit of P(X > x) for the logistic distribution most likely for ``values``.

    With x' = (x - mean) / scale, Newton's method solves: sum of tanh(x' / 2) = 0, sum of x' tanh(x' / 2) = n.
    """
    mean, scale = float(values.mean()), float(values.std()) * np.sqrt(3.0) / np.pi
    for _ in range(NEWTON_STEPS):
        scaled = (values - mean) / scale
        tanh = np.tanh(scaled / 2.0)
        bend = (1.0 - tanh**2) / 2.0
        error = np.array([tanh.mean(), (scaled * tanh).mean() - 1.0])
        jacobian = -np.array(
            [
                [bend.mean(), (bend * scaled).mean()],
                [(tanh + scaled * bend).mean(), (scaled * (tanh + scaled * bend)).mean()],
            ]
        )
        step = np.clip(np.linalg.solve(jacobian, -error), -0.5, 0.5)
        mean, scale = mean + scale * step[0], scale * np.exp(step[1])
        if np.abs(step).max() <= TOLERANCE:
            break
    return np.array([mean / scale, -1.0 / scale])
