"""The hidden Markov model with Gaussian densities of full covariance (Rabiner 1989).

It models the kinematics of gestures in Levine et al. 2010, 6.2. Two limits keep it usable on little data. Covariances
are at least a given floor, in the sense that Sigma - floor has no negative eigenvalue, and transition probabilities
are at least ``LEAST_TRANSITION``. Both M-steps return the maximum *under* these limits, so that the likelihood cannot
decrease; adding a floor to each estimate instead would break this.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import crf_chain, gaussian_hmm_kernels

LEAST_OCCUPANCY = 1e-3
"""States with fewer expected frames keep their parameters in the M-step."""

LEAST_TRANSITION = 1e-6
"""Minimum of the probabilities of transitions and initial states, so that no belief is excluded for ever."""

SEEDINGS, ROUNDS = 5, 10
"""How often k-means is started to find the first means, and its rounds."""


class GaussianHMM(NamedTuple):
    """A model: ``initial`` (S,), ``transitions`` (S, S), ``mean`` (S, D) and ``covariance`` (S, D, D).

    Transitions are from row to column.
    """

    initial: Floats
    transitions: Floats
    mean: Floats
    covariance: Floats


class Counts(NamedTuple):
    """Expected counts of an E-step.

    Attributes
    ----------
    started : (S,) sequences that start in each state.
    transitions : (S, S) expected transitions.
    occupied : (S,) expected frames in each state.
    first, second : (D, S) and (D, D, S) sums of the features minus ``pivot`` (D,), and of their products (lower
        triangle), over the frames of each state.
    """

    log_likelihood: float
    started: Floats
    transitions: Floats
    occupied: Floats
    first: Floats
    second: Floats
    pivot: Floats


class Posterior(NamedTuple):
    """The distribution over the states of a sequence of T frames, given all of its frames.

    Attributes
    ----------
    beliefs : (T, S) probabilities of the states.
    transitions : (S, S) expected number of transitions, from row to column.
    """

    log_likelihood: float
    beliefs: Floats
    transitions: Floats


class Fit(NamedTuple):
    """A trained model, and the log-likelihoods (iterations + 1,) during training; the last is that of the model."""

    model: GaussianHMM
    log_likelihoods: Floats


class Choice(NamedTuple):
    """The chosen number of states, and the held-out log-likelihood per frame of each number that was tried."""

    n_states: int
    held_out: dict[int, float]


def log_densities(frames: Floats, mean: Floats, covariance: Floats) -> Floats:
    """Return log N(x_t; mean_i, covariance_i), (T, S), of frames (T, D)."""
    factors = np.linalg.cholesky(covariance)
    whitening = np.ascontiguousarray(np.linalg.inv(factors))
    diagonal = np.diagonal(factors, axis1=1, axis2=2)
    constants = -0.5 * mean.shape[1] * np.log(2 * np.pi) - np.log(diagonal).sum(axis=1)
    scores = np.empty((len(frames), len(mean)))
    gaussian_hmm_kernels.log_densities(np.ascontiguousarray(frames), mean, whitening, constants, scores)
    return scores


def filtered(initial: Floats, transitions: Floats, scores: Floats) -> tuple[float, Floats]:
    """Return the log-likelihood and the beliefs P(q_t | x_1 ... x_t), (T, S), given log densities (T, S)."""
    beliefs = np.empty_like(scores)
    total = crf_chain.forward(initial, transitions, scores, beliefs, np.empty_like(scores))
    return total, beliefs


def log_likelihood(model: GaussianHMM, frames: Floats) -> float:
    """Return log P(frames | model) of a sequence (T, D)."""
    scores = log_densities(frames, model.mean, model.covariance)
    return filtered(model.initial, model.transitions, scores)[0]


def posterior(model: GaussianHMM, frames: Floats) -> Posterior:
    """Return the distribution over the states of a sequence (T, D), given the whole sequence."""
    scores = log_densities(frames, model.mean, model.covariance)
    before, ahead, beliefs = np.empty_like(scores), np.empty_like(scores), np.empty_like(scores)
    ratios = np.zeros_like(model.transitions)
    total = crf_chain.forward(model.initial, model.transitions, scores, before, ahead)
    crf_chain.backward(np.ascontiguousarray(model.transitions.T), before, ahead, beliefs, ratios)
    return Posterior(total, beliefs, ratios * model.transitions)


def expect(model: GaussianHMM, sequences: Sequence[Floats]) -> Counts:
    """Return the expected counts of all sequences (the E-step of Baum-Welch)."""
    n_states, n_features = model.mean.shape
    pivot = model.mean.mean(axis=0)
    started, transitions, occupied = np.zeros(n_states), np.zeros((n_states, n_states)), np.zeros(n_states)
    first, second = np.zeros((n_features, n_states)), np.zeros((n_features, n_features, n_states))
    total = 0.0
    for frames in sequences:
        found = posterior(model, frames)
        total += found.log_likelihood
        started += found.beliefs[0]
        transitions += found.transitions
        occupied += found.beliefs.sum(axis=0)
        gaussian_hmm_kernels.add_moments(np.ascontiguousarray(frames), pivot, found.beliefs, first, second)
    return Counts(total, started, transitions, occupied, first, second, pivot)


def floored_covariance(covariance: Floats, floor: Floats) -> Floats:
    """Return the maximum likelihood covariances, (S, D, D), among those of at least ``diag(floor)``.

    In coordinates in which the floor is the identity, the likelihood is a sum over the eigenvalues of the sample
    covariance, and each is raised to at least 1.

    Parameters
    ----------
    covariance : (S, D, D) sample covariances.
    floor : (D,) variances, above 0.
    """
    scale = np.sqrt(floor)
    values, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    raised = (axes * np.maximum(values, 1.0)[:, None, :]) @ axes.swapaxes(1, 2)
    allowed = np.min(values, axis=1, keepdims=True)[:, :, None] >= 1.0
    raised = np.where(allowed, covariance / np.outer(scale, scale), raised)
    return 0.5 * (raised + raised.swapaxes(1, 2)) * np.outer(scale, scale)


def floored_probabilities(counts: Floats, least: float) -> Floats:
    """Return the maximum likelihood probabilities of counts (..., S) among those of at least ``least``.

    Those that would be below are ``least``, and the others share the rest in proportion to their counts.
    """
    low = np.zeros(counts.shape, dtype=bool)
    while True:
        free = np.where(low, 0.0, counts)
        rest = 1.0 - least * low.sum(axis=-1, keepdims=True)
        shares = np.where(low, least, free * rest / free.sum(axis=-1, keepdims=True))
        lower = low | (shares < least)
        if (lower == low).all():
            return shares
        low = lower


def maximise(model: GaussianHMM, counts: Counts, floor: Floats) -> GaussianHMM:
    """Return the maximum likelihood model of the expected counts within the limits (the M-step of Baum-Welch).

    States without frames keep their parameters.
    """
    occupied = counts.occupied > LEAST_OCCUPANCY
    frames = np.where(occupied, counts.occupied, 1.0)
    shift = (counts.first / frames).T
    lower = np.tril(np.moveaxis(counts.second / frames, 2, 0))
    moment = lower + np.tril(lower, -1).swapaxes(1, 2)
    covariance = floored_covariance(moment - shift[:, :, None] * shift[:, None, :], floor)
    left = counts.transitions.sum(axis=1)
    moved = left > LEAST_OCCUPANCY
    transitions = floored_probabilities(np.where(moved[:, None], counts.transitions, 1.0), LEAST_TRANSITION)
    return GaussianHMM(
        floored_probabilities(counts.started, LEAST_TRANSITION),
        np.where(moved[:, None], transitions, model.transitions),
        np.where(occupied[:, None], counts.pivot + shift, model.mean),
        np.where(occupied[:, None, None], covariance, model.covariance),
    )


def start(sequences: Sequence[Floats], n_states: int, floor: Floats, rng: np.random.Generator) -> GaussianHMM:
    """Return a model to start from: k-means, and the transitions between its classes.

    Raises
    ------
    UserError : if there are fewer frames than states.
    """
    pooled = np.ascontiguousarray(np.concatenate([*sequences]))
    if len(pooled) < n_states:
        raise UserError(
            f"{len(pooled)} frames are too few for {n_states} hidden states; give fewer states or more data"
        )
    scale = np.sqrt(np.maximum(pooled.var(axis=0), floor))
    whitened = pooled / scale
    assigned, distances = np.empty(len(pooled), dtype=np.int64), np.empty(len(pooled))
    found = [_k_means(whitened, n_states, rng) for _ in range(SEEDINGS)]
    centres = min(found, key=lambda one: one[0])[1]
    gaussian_hmm_kernels.nearest(whitened, centres, assigned, distances)
    transitions, initial, begin = np.ones((n_states, n_states)), np.ones(n_states), 0
    for frames in sequences:
        labels = assigned[begin : begin + len(frames)]
        np.add.at(transitions, (labels[:-1], labels[1:]), 1.0)
        initial[labels[0]] += 1.0
        begin += len(frames)
    mean = centres * scale
    covariance = np.tile(np.diag(scale**2), (n_states, 1, 1))
    for i in range(n_states):
        offset = pooled[assigned == i] - mean[i]
        if len(offset):
            covariance[i] = offset.T @ offset / len(offset)
    return GaussianHMM(
        initial / initial.sum(),
        transitions / transitions.sum(axis=1, keepdims=True),
        mean,
        floored_covariance(covariance, floor),
    )


def _k_means(points: Floats, n_centres: int, rng: np.random.Generator) -> tuple[float, Floats]:
    """Return the sum of squared distances of points (T, D) from the nearest of the centres (S, D), and these."""
    assigned, distances = np.empty(len(points), dtype=np.int64), np.empty(len(points))
    centres = points[rng.integers(len(points), size=1)]
    while len(centres) < n_centres:  # k-means++
        gaussian_hmm_kernels.nearest(points, centres, assigned, distances)
        total = distances.sum()
        drawn = rng.choice(len(points), p=distances / total) if total > 0.0 else rng.integers(len(points))
        centres = np.concatenate([centres, points[drawn : drawn + 1]])
    for _ in range(ROUNDS):
        gaussian_hmm_kernels.nearest(points, centres, assigned, distances)
        members = np.bincount(assigned, minlength=n_centres)
        sums = np.stack([np.bincount(assigned, column, n_centres) for column in points.T], axis=1)
        centres = np.where(members[:, None] > 0, sums / np.maximum(members, 1)[:, None], centres)
    gaussian_hmm_kernels.nearest(points, centres, assigned, distances)
    return float(distances.sum()), centres


def fit(
    model: GaussianHMM, sequences: Sequence[Floats], floor: Floats, iterations: int, tolerance: float = 0.0
) -> Fit:
    """Train ``model`` by Baum-Welch.

    Parameters
    ----------
    sequences : (T, D) each.
    floor : (D,) minimum variance along any direction, see ``floored_covariance``.
    iterations : maximum number of updates.
    tolerance : stop when the log-likelihood gain per frame falls below this.
    """
    model = model._replace(
        initial=floored_probabilities(model.initial, LEAST_TRANSITION),
        transitions=floored_probabilities(model.transitions, LEAST_TRANSITION),
        covariance=floored_covariance(model.covariance, floor),
    )
    n_frames = sum(len(frames) for frames in sequences)
    history: list[float] = []
    for _ in range(iterations):
        counts = expect(model, sequences)
        history.append(counts.log_likelihood)
        if len(history) > 1 and history[-1] - history[-2] < tolerance * n_frames:
            return Fit(model, np.array(history))
        model = maximise(model, counts, floor)
    history.append(sum(log_likelihood(model, frames) for frames in sequences))
    return Fit(model, np.array(history))


def choose(
    sequences: Sequence[Floats],
    candidates: Sequence[int],
    floor: Floats,
    iterations: int,
    seed: int,
    folds: int = 3,
) -> Choice:
    """Choose the number of states by the log-likelihood of parts of the sequences that were not trained on.

    Each sequence is cut into ``folds`` parts. A number with more states than the parts allow is left out.

    Parameters
    ----------
    candidates : numbers of states to try.

    Raises
    ------
    UserError : if no number can be tried.
    """
    parts = [np.array_split(frames, folds) for frames in sequences]
    held_out: dict[int, float] = {}
    for n_states in candidates:
        total, n_frames = 0.0, 0
        for fold in range(folds):
            training = [part for cut in parts for k, part in enumerate(cut) if k != fold and len(part)]
            if sum(len(part) for part in training) < n_states:
                break
            begun = start(training, n_states, floor, np.random.default_rng([seed, n_states, fold]))
            model = fit(begun, training, floor, iterations).model
            tested = [cut[fold] for cut in parts if len(cut[fold])]
            total += sum(log_likelihood(model, frames) for frames in tested)
            n_frames += sum(len(frames) for frames in tested)
        else:
            held_out[n_states] = total / n_frames
    if not held_out:
        raise UserError(f"too few frames to train any of {list(candidates)} hidden states; give more motion")
    return Choice(max(held_out, key=held_out.__getitem__), held_out)
