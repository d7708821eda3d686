"""False accepts and false rejects of open-set identification, and the rate at which both are equal.

A trial is a clip, the score of the best model, and what is true of it: a client, whose best model is right or wrong,
or an impostor. It is accepted if its score is at least the threshold.

Rates ``as printed`` are those of Sargin 2006, equation 2.4: FAR = F_a / (N_a + N_r) and FRR = F_r / N_a. Clients who
are accepted as somebody else count as false accepts, which makes the denominator coherent. In the ``usual`` rates FAR
is the share of impostors that are accepted, and FRR that of clients that are not accepted as themselves, whether they
are rejected or taken for somebody else.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.kernels.jit import njit

RATES = ("as printed", "usual")


class Trials(NamedTuple):
    """Trials of an identification.

    Attributes
    ----------
    score : (n,) score of the best model.
    client : (n,) whether the speaker is known and claims to be no other; otherwise, an impostor.
    right : (n,) whether the best model is that of the speaker; False for impostors.
    """

    score: Floats
    client: Flags
    right: Flags


class Curve(NamedTuple):
    """Operating points from the strictest threshold to the most lenient one, (K + 1,) each.

    Thresholds are the distinct scores, preceded by infinity, at which nobody is accepted. Rates are shares, 0 to 1.
    """

    threshold: Floats
    false_accept: Floats
    false_reject: Floats


class EqualError(NamedTuple):
    """The equal error rate, 0 to 1, and the threshold where it is reached; NaN where a rate is undefined."""

    rate: float
    threshold: float


class _Errors(NamedTuple):
    """How many errors a trial makes if it is accepted, if it is rejected, and in any case; and who is counted."""

    accepted: Floats
    rejected: Floats
    always: Floats
    accept_counts: Floats
    reject_counts: Floats


def _errors(trials: Trials, rates: str) -> _Errors:
    client, right = trials.client.astype(float), (trials.client & trials.right).astype(float)
    if rates == "as printed":
        return _Errors(1.0 - right, client, np.zeros(len(client)), np.ones(len(client)), client)
    return _Errors(1.0 - client, right, client - right, 1.0 - client, client)


def curve(trials: Trials, rates: str) -> Curve:
    """Return the rates at every threshold, from which DET curves are drawn.

    Parameters
    ----------
    trials : the trials.
    rates : one of ``RATES``.
    """
    errors = _errors(trials, rates)
    order = np.argsort(-trials.score, kind="stable")
    ordered = trials.score[order]
    last = np.append(np.flatnonzero(np.diff(ordered)), len(ordered) - 1)
    with np.errstate(invalid="ignore"):
        accept = np.append(0.0, np.cumsum(errors.accepted[order])[last]) / errors.accept_counts.sum()
        spared = np.append(0.0, np.cumsum(errors.rejected[order])[last])
        reject = (errors.always.sum() + errors.rejected.sum() - spared) / errors.reject_counts.sum()
    return Curve(np.append(math.inf, ordered[last]), accept, reject)


def equal_error(trials: Trials, rates: str) -> EqualError:
    """Return the equal error rate by linear interpolation between the operating points on both sides of it."""
    points = curve(trials, rates)
    crossed = np.flatnonzero(points.false_accept >= points.false_reject)
    if not len(crossed):
        return EqualError(math.nan, math.nan)
    after = int(crossed[0])
    before = max(after - 1, 0)
    below = points.false_reject[before] - points.false_accept[before]
    above = points.false_accept[after] - points.false_reject[after]
    share = below / (below + above) if below + above > 0.0 else 0.0
    rate = points.false_accept[before] + share * (points.false_accept[after] - points.false_accept[before])
    near = points.threshold[after] if math.isinf(points.threshold[before]) else points.threshold[before]
    return EqualError(float(rate), float(near + share * (points.threshold[after] - near)))


def threshold_at(trials: Trials, rates: str, false_accept: float) -> float:
    """Return the most lenient threshold whose false-accept rate is at most ``false_accept``.

    It is halfway between the scores on both sides, and infinite if even the highest score is a false accept too many.
    """
    points = curve(trials, rates)
    allowed = int(np.flatnonzero(points.false_accept <= false_accept)[-1])
    if allowed + 1 == len(points.threshold) or math.isinf(points.threshold[allowed]):
        return float(points.threshold[allowed])
    return float(0.5 * (points.threshold[allowed] + points.threshold[allowed + 1]))


@njit
def _weighted(
    ordered: Floats, weights: Floats, group: Integers,
    accepted: Floats, rejected: Floats, always: Floats, accept_counts: Floats, reject_counts: Floats, found: Floats,
) -> None:  # fmt: skip
    """Write the equal error rate of each bootstrap sample to ``found``; trials are in descending order of scores."""
    for sample in range(len(weights)):
        accepts, rejects, fixed, spare = 0.0, 0.0, 0.0, 0.0
        for k in range(len(ordered)):
            weight = weights[sample, group[k]]
            accepts += weight * accept_counts[k]
            rejects += weight * reject_counts[k]
            fixed += weight * always[k]
            spare += weight * rejected[k]
        found[sample] = math.nan
        if accepts == 0.0 or rejects == 0.0:
            continue
        accept, reject = 0.0, (fixed + spare) / rejects
        wrong, k = 0.0, 0
        while accept < reject and k < len(ordered):
            accept_before, reject_before = accept, reject
            value = ordered[k]
            while k < len(ordered) and ordered[k] == value:
                weight = weights[sample, group[k]]
                wrong += weight * accepted[k]
                spare -= weight * rejected[k]
                k += 1
            accept, reject = wrong / accepts, (fixed + spare) / rejects
            if accept >= reject:
                below, above = reject_before - accept_before, accept - reject
                found[sample] = accept_before + below / (below + above) * (accept - accept_before)
        if k == 0:
            found[sample] = accept


def bootstrapped(trials: Trials, rates: str, group: Integers, weights: Floats) -> Floats:
    """Return the equal error rate in each bootstrap sample, (samples,); NaN where a rate is undefined.

    Parameters
    ----------
    group : (n,) index of the speaker of each trial: the trials of a speaker depend on one another and are drawn
        together.
    weights : (samples, R) how often each speaker is drawn.
    """
    order = np.argsort(-trials.score, kind="stable")
    found = np.empty(len(weights))
    parts = [values[order] for values in _errors(trials, rates)]
    _weighted(trials.score[order], np.ascontiguousarray(weights), group[order], *parts, found)
    return found
