"""Situations: typical beliefs that the policy plans with."""

import numpy as np

from cospeech.synthesis.controller import situations

RNG = np.random.default_rng(1)


def planted(rng, n_steps=2000):
    """Beliefs near three corners that follow a planted chain, and the chain."""
    chain = np.array([[0.9, 0.1, 0.0], [0.0, 0.8, 0.2], [0.3, 0.0, 0.7]])
    corners = np.array([[0.8, 0.1, 0.1, 0.0], [0.1, 0.8, 0.1, 0.0], [0.1, 0.1, 0.3, 0.5]])
    visited = [0]
    while len(visited) < n_steps:
        visited.append(int(rng.choice(3, p=chain[visited[-1]])))
    noisy = np.abs(corners[visited] + rng.normal(0, 0.01, (n_steps, 4)))
    return noisy / noisy.sum(axis=1, keepdims=True), corners, chain


def test_planted_beliefs_and_their_transitions_are_found():
    beliefs, corners, chain = planted(RNG)
    found = situations.of_beliefs([beliefs[:1000], beliefs[1000:]], 3, RNG)
    order = [int(np.linalg.norm(found.beliefs - corner, axis=1).argmin()) for corner in corners]
    assert sorted(order) == [0, 1, 2]
    np.testing.assert_allclose(found.beliefs[order], corners, atol=0.01)
    np.testing.assert_allclose(found.transitions[np.ix_(order, order)], chain, atol=0.06)
    np.testing.assert_allclose(found.transitions.sum(axis=1), 1.0)


def test_there_are_no_more_situations_than_different_beliefs():
    found = situations.of_beliefs([np.tile(np.eye(3), (5, 1))], 40, RNG)
    assert sorted(found.beliefs.argmax(axis=1)) == [0, 1, 2]


def test_the_weight_is_that_of_the_nearest_belief_and_states_keep_the_belief():
    rng = np.random.default_rng(2)
    for _ in range(20):
        beliefs = rng.dirichlet(np.ones(5), 30)
        found = situations.of_beliefs([beliefs], 6, rng)
        new = rng.dirichlet(np.ones(5), 10)
        apart = np.linalg.norm(new[:, None] - found.beliefs[None], axis=2)
        np.testing.assert_array_equal(
            situations.Weights(found).of_each(new), np.eye(len(found.beliefs))[apart.argmin(axis=1)]
        )
    plain = situations.of_states(np.eye(5))
    np.testing.assert_array_equal(situations.Weights(plain).of_each(new), new)


def test_distances_are_expectations_under_the_belief():
    rng = np.random.default_rng(3)
    known = situations.Situations(rng.dirichlet(np.ones(4), 3), np.eye(3))
    delta = rng.uniform(size=(6, 4))
    for a in range(6):
        for k in range(3):
            assert np.isclose(known.distances(delta)[a, k], sum(known.beliefs[k] * delta[a]))
