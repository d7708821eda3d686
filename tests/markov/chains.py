"""Sums over all label sequences of tiny linear chains, and sequences drawn from Gaussian HMMs, for the tests."""

from __future__ import annotations

from itertools import product

import numpy as np

from cospeech.markov.gaussian_hmm import GaussianHMM


def all_paths(n_states, n_frames):
    return np.array(list(product(range(n_states), repeat=n_frames)))


def path_weights(initial, transitions, scores, paths):
    """Logarithms of the weight of each path, from logarithms of all."""
    times = np.arange(len(scores))
    found = initial[paths[:, 0]] + scores[times, paths].sum(axis=1)
    return found + transitions[paths[:, :-1], paths[:, 1:]].sum(axis=1)


def expectations(paths, probabilities, n_states):
    """Beliefs (T, S) and expected transitions (S, S) of weighted paths."""
    labels = np.eye(n_states)[paths]
    beliefs = np.einsum("n,nts->ts", probabilities, labels)
    return beliefs, np.einsum("n,nti,ntj->ij", probabilities, labels[:, :-1], labels[:, 1:])


def random_hmm(rng, states, features, spread=2.0):
    factors = rng.normal(size=(states, features, features)) * 0.5
    return GaussianHMM(
        rng.dirichlet(np.ones(states)),
        0.7 * np.eye(states) + 0.3 * rng.dirichlet(np.ones(states), states),
        rng.normal(0, spread, (states, features)),
        factors @ factors.swapaxes(1, 2) + 0.3 * np.eye(features),
    )


def draw(model, n_frames, rng):
    states = np.empty(n_frames, dtype=int)
    probabilities = model.initial
    for t in range(n_frames):
        states[t] = rng.choice(len(probabilities), p=probabilities)
        probabilities = model.transitions[states[t]]
    noise = rng.normal(size=(n_frames, model.mean.shape[1]))
    return model.mean[states] + np.einsum("tde,te->td", np.linalg.cholesky(model.covariance)[states], noise), states
