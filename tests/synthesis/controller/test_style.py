"""Style transforms and mixtures of tones."""

import numpy as np
import pytest
from controller.tiny import random_tiny

from cospeech.errors import UserError
from cospeech.synthesis.controller import distances, policy, style

NOTHING = np.zeros(4)


def test_transform_maps_one_gaussian_to_the_other_and_moves_nothing_needlessly():
    rng = np.random.default_rng(1)
    for _ in range(20):
        neutral = rng.normal(size=(60, 4)) @ rng.normal(size=(4, 4)) + rng.normal(size=4)
        tone = rng.normal(size=(50, 4)) @ rng.normal(size=(4, 4)) + rng.normal(size=4)
        transform = style.fit(neutral, tone, NOTHING)
        mapped = neutral @ transform.matrix.T + transform.offset
        np.testing.assert_allclose(mapped.mean(axis=0), tone.mean(axis=0), atol=1e-9)
        np.testing.assert_allclose(np.cov(mapped.T, bias=True), np.cov(tone.T, bias=True), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(transform.matrix, transform.matrix.T, rtol=1e-6, atol=1e-9)
        assert np.linalg.eigvalsh(transform.matrix).min() > 0.0  # the condition of optimal transport
        same = style.fit(neutral, neutral, NOTHING)
        np.testing.assert_allclose(same.matrix, np.eye(4), atol=1e-6)


def test_distances_of_a_tone_equal_monte_carlo():
    rng = np.random.default_rng(2)
    transform = style.fit(rng.normal(size=(30, 4)), rng.normal(1.0, 2.0, (30, 4)), NOTHING)
    factors = rng.normal(size=(2, 4, 4))
    means, covariances = rng.normal(size=(2, 4)), factors @ factors.swapaxes(1, 2)
    segments = rng.normal(size=(3, 4))
    found = style.tone_distances(segments, means, covariances, transform)
    for i in range(2):
        drawn = rng.multivariate_normal(means[i], covariances[i], 40_000) @ transform.matrix.T + transform.offset
        norms = np.linalg.norm(drawn[None] - segments[:, None], axis=2)
        assert (np.abs(norms.mean(axis=1) - found[:, i]) < 4.5 * norms.std(axis=1) / 200.0).all()
    unchanged = style.tone_distances(segments, means, covariances, style.Transform(np.eye(4), NOTHING))
    np.testing.assert_allclose(unchanged, distances.expected_distances(segments, means, covariances), rtol=1e-12)


def test_combined_values_are_a_lower_bound_of_those_trained_for_the_mixture():
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(30):
        tiny = random_tiny(rng, 8, 3)
        tones = [rng.uniform(0, 4, tiny.distances.shape) for _ in range(3)]
        weights = rng.dirichlet(np.ones(3))
        single = [policy.solve(tiny.cut, tiny.rows, tone, tiny.transitions, 0.9) for tone in tones]
        mixed = style.mixed_distances(tones, weights)
        trained = policy.solve(tiny.cut, tiny.rows, mixed, tiny.transitions, 0.9)
        combination = style.combined(single, weights)
        assert (combination.values <= trained.values * (1 + 1e-9)).all()
        errors.append(style.combination_error(combination, trained))
        alone = style.combined(single, np.array([0.0, 1.0, 0.0]))
        np.testing.assert_array_equal(alone.values, single[1].values)
    assert min(errors) >= 0.0
    assert np.mean(errors) > 0.02


def test_a_tone_with_one_segment_is_refused():
    with pytest.raises(UserError, match="at least two segments"):
        style.fit(np.zeros((5, 4)), np.zeros((1, 4)), NOTHING)
