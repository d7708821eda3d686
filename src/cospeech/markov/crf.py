"""A linear-chain conditional random field that is trained on distributions over label sequences (soft targets).

For features x_1 ... x_T of a sequence,

    P(q | x) = exp(sum over t > 1 of A[q_(t-1), q_t] + sum over t of x_t . B[:, q_t]) / Z(x)

(Lafferty et al. 2001; Levine et al. 2010, 6.2). The target is a distribution over label sequences, such as the
posterior of an HMM. Its expected log-probability depends on the target through two expectations only, those of the
transitions and of the products of features and labels, so that training costs as much as with known labels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import crf_chain


class CRF(NamedTuple):
    """The weights: ``transitions`` (S, S), from row to column, and ``observations`` (F, S)."""

    transitions: Floats
    observations: Floats


class Targets(NamedTuple):
    """A distribution over the labels of a sequence of T frames.

    Attributes
    ----------
    beliefs : (T, S) probabilities of the labels.
    transitions : (S, S) expected number of transitions, from row to column.
    """

    beliefs: Floats
    transitions: Floats


class Fit(NamedTuple):
    """A trained model, its objective (see ``objective``), and the number of evaluations of the objective."""

    model: CRF
    objective: float
    evaluations: int


class Smoothed(NamedTuple):
    """The distribution over the labels of a sequence of T frames, given all of its features.

    Attributes
    ----------
    log_partition : log Z.
    beliefs : (T, S) probabilities of the labels.
    transitions : (S, S) expected number of transitions, from row to column.
    """

    log_partition: float
    beliefs: Floats
    transitions: Floats


def path_factors(model: CRF) -> tuple[Floats, float]:
    """Return the exponentials of the transition weights, and the largest weight, by which they are divided."""
    top = float(model.transitions.max())
    return np.exp(model.transitions - top), top


def _scores(model: CRF, features: Floats) -> Floats:
    scores = np.empty((len(features), len(model.transitions)))
    crf_chain.products(features, model.observations, scores)
    return scores


def log_partition(model: CRF, features: Floats) -> float:
    """Return log Z(x) of the features (T, F) of a sequence."""
    return _forward(model, features)[0]


def filtered(model: CRF, features: Floats) -> Floats:
    """Return the beliefs P(q_t | x_1 ... x_t), (T, S), of the forward algorithm."""
    return _forward(model, features)[1]


def _forward(model: CRF, features: Floats) -> tuple[float, Floats, Floats]:
    """Return log Z, and the filtered beliefs and the weights that they predict, (T, S) each."""
    pairs, top = path_factors(model)
    scores = _scores(model, features)
    beliefs, ahead = np.empty_like(scores), np.empty_like(scores)
    total = crf_chain.forward(np.ones(len(pairs)), pairs, scores, beliefs, ahead)
    return total + (len(features) - 1) * top, beliefs, ahead


def smoothed(model: CRF, features: Floats) -> Smoothed:
    """Return the beliefs of each frame given the features (T, F) of the whole sequence."""
    total, before, ahead = _forward(model, features)
    pairs, _ = path_factors(model)
    beliefs, ratios = np.empty_like(before), np.zeros_like(pairs)
    crf_chain.backward(np.ascontiguousarray(pairs.T), before, ahead, beliefs, ratios)
    return Smoothed(total, beliefs, ratios * pairs)


def lagged(model: CRF, features: Floats, delay: int) -> Floats:
    """Return the beliefs of each frame and of the next ones, as known ``delay`` frames later, (T, delay + 1, S).

    Entry [t, h] is P(q_(t + h) | x_1 ... x_(t + delay)), or that given the whole sequence where this ends before. It
    is NaN for frames after the end. With ``delay = 0`` these are the filtered beliefs.
    """
    _, before, ahead = _forward(model, features)
    pairs, _ = path_factors(model)
    turned = np.ascontiguousarray(pairs.T)
    n_frames, n_labels = before.shape
    found = np.full((n_frames, delay + 1, n_labels), np.nan)
    newest = np.minimum(np.arange(n_frames) + delay, n_frames - 1)
    frames = np.arange(n_frames)
    for h in range(delay, -1, -1):
        inside = frames + h < n_frames
        place = frames[inside] + h
        # A frame that is the newest one has its filtered belief, and the others follow from the belief of the next.
        following = np.minimum(place + 1, n_frames - 1)
        later = found[inside, h + 1] if h < delay else np.full((len(place), n_labels), np.nan)
        ratios = np.nan_to_num(np.divide(later, ahead[following], where=ahead[following] > 0.0, out=later * 0.0))
        carried = np.empty_like(ratios)
        crf_chain.products(ratios, turned, carried)
        known = (place == newest[inside])[:, None]
        found[inside, h] = np.where(known, before[place], before[place] * carried)
    return found


def expected_log_probability(model: CRF, features: Floats, targets: Targets) -> float:
    """Return the expectation of log P(q | x) for label sequences q from the target."""
    transitions = float((targets.transitions * model.transitions).sum())
    observations = float((targets.beliefs * _scores(model, features)).sum())
    return transitions + observations - log_partition(model, features)


def objective(model: CRF, sequences: list[Floats], targets: list[Targets], penalty: float) -> tuple[float, CRF]:
    """Return what training minimises, and its gradient.

    It is the sum of all expected negative log-probabilities plus ``penalty / 2`` times the sum of squared weights.
    """
    return _objective(model, sequences, _sums(sequences, targets, model.transitions.shape[0]), penalty)


def _sums(sequences: list[Floats], targets: list[Targets], n_labels: int) -> CRF:
    """Return the expectations of all features under the targets."""
    transitions = np.sum([target.transitions for target in targets], axis=0)
    observations = np.zeros((sequences[0].shape[1], n_labels))
    for features, target in zip(sequences, targets, strict=True):
        crf_chain.add_moments(features, target.beliefs, observations)
    return CRF(transitions, observations)


def _objective(model: CRF, sequences: list[Floats], sums: CRF, penalty: float) -> tuple[float, CRF]:
    value = 0.0
    transitions, observations = np.zeros_like(model.transitions), np.zeros_like(model.observations)
    for features in sequences:
        found = smoothed(model, features)
        value += found.log_partition
        transitions += found.transitions
        crf_chain.add_moments(features, found.beliefs, observations)
    for weights, target in zip(model, sums, strict=True):
        value += 0.5 * penalty * float((weights**2).sum()) - float((weights * target).sum())
    gradient = (
        expected - target + penalty * weights
        for expected, target, weights in zip((transitions, observations), sums, model, strict=True)
    )
    return value, CRF(*gradient)


def fit(
    sequences: list[Floats],
    targets: list[Targets],
    penalty: float = 1.0,
    iterations: int = 100,
    tolerance: float = 1e-6,
) -> Fit:
    """Return the model with the smallest ``objective``, found by L-BFGS from weights of zero.

    Parameters
    ----------
    sequences : features (T, F) of each sequence.
    penalty : weight of the squared weights; the objective is convex, and with a penalty it has one minimum.
    iterations : maximum number of iterations.
    tolerance : stop when no component of the gradient, per frame, exceeds this.

    Raises
    ------
    UserError : if there are no frames.
    """
    from scipy.optimize import minimize
    from threadpoolctl import threadpool_limits

    n_frames = sum(len(features) for features in sequences)
    if n_frames == 0:
        raise UserError("no frames to train the conditional random field on; it needs records with speech and motion")
    n_labels, n_features = targets[0].beliefs.shape[1], sequences[0].shape[1]
    sums = _sums(sequences, targets, n_labels)

    def unpacked(vector: Floats) -> CRF:
        transitions, observations = np.split(vector, [n_labels**2])
        return CRF(transitions.reshape(n_labels, n_labels), observations.reshape(n_features, n_labels))

    def per_frame(vector: Floats) -> tuple[float, Floats]:
        value, gradient = _objective(unpacked(vector), sequences, sums, penalty)
        return value / n_frames, np.concatenate([part.ravel() for part in gradient]) / n_frames

    options = {"maxiter": iterations, "gtol": tolerance, "ftol": 0.0}
    begun = np.zeros(n_labels**2 + n_features * n_labels)
    with threadpool_limits(1, "blas"):  # for vectors as short as these, further threads only wait
        found = minimize(per_frame, begun, jac=True, method="L-BFGS-B", options=options)
    return Fit(unpacked(found.x), float(found.fun) * n_frames, int(found.nfev))
