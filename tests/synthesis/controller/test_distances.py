"""Expected distances against closed forms, fine quadrature, a second method and Monte Carlo."""

import numpy as np
import pytest
from scipy import integrate, special, stats

from cospeech.synthesis.controller.distances import expected_distances


def random_gaussians(rng, states, features, spread):
    axes = np.linalg.qr(rng.normal(size=(states, features, features)))[0]
    variances = np.exp(rng.uniform(-spread, spread, (states, features)))
    return rng.normal(0, 1, (states, features)), np.einsum("sde,se,sfe->sdf", axes, variances, axes)


@pytest.mark.parametrize("features", range(1, 9))
def test_of_a_round_gaussian_at_its_mean_is_that_of_the_chi_distribution(features):
    found = expected_distances(np.zeros((1, features)), np.zeros((1, features)), 4.0 * np.eye(features)[None])
    assert found[0, 0] == pytest.approx(2.0 * stats.chi(features).mean(), rel=5e-7)


def test_in_one_dimension_is_that_of_the_folded_normal():
    rng = np.random.default_rng(1)
    for mean, sd in zip(rng.normal(0, 3, 200), np.exp(rng.uniform(-5, 2, 200)), strict=True):
        true = sd * np.sqrt(2 / np.pi) * np.exp(-0.5 * (mean / sd) ** 2) + mean * special.erf(mean / sd / np.sqrt(2))
        found = expected_distances(np.array([[0.0]]), np.array([[mean]]), np.array([[[sd**2]]]))
        assert found[0, 0] == pytest.approx(true, rel=5e-7)


def test_of_a_round_gaussian_anywhere_equals_rice_like_closed_form():
    rng = np.random.default_rng(2)
    for _ in range(200):
        features, sd = int(rng.integers(2, 8)), np.exp(rng.uniform(-1, 1))
        offset = rng.normal(0, 2, features)
        true = (
            sd * np.sqrt(2) * np.exp(special.gammaln((features + 1) / 2) - special.gammaln(features / 2))
            * special.hyp1f1(-0.5, features / 2, -0.5 * (offset @ offset) / sd**2)
        )  # fmt: skip
        found = expected_distances(offset[None], np.zeros((1, features)), sd**2 * np.eye(features)[None])
        assert found[0, 0] == pytest.approx(true, rel=5e-7)


@pytest.mark.parametrize("spread", [1.0, 3.0, 5.0])
def test_equals_fine_quadrature(spread):
    rng = np.random.default_rng(int(spread))
    means, covariances = random_gaussians(rng, 200, 6, spread)
    points = np.zeros((1, 6))
    coarse = expected_distances(points, means, covariances)[0]
    u = np.linspace(-60, 80, 14_001)
    for i in range(200):
        variances, axes = np.linalg.eigh(covariances[i])
        offset = means[i] @ axes
        total = (variances + offset**2).sum()
        s = np.exp(u)[:, None] / total
        grown = 1 + 2 * s * variances
        exponent = -(s * offset**2 / grown).sum(axis=1) - 0.5 * np.log(grown).sum(axis=1)
        true = integrate.trapezoid(-np.expm1(exponent) * np.exp(-0.5 * u), u)
        assert coarse[i] == pytest.approx(np.sqrt(total) * true / (2 * np.sqrt(np.pi)), rel=5e-7)


def test_equals_monte_carlo():
    rng = np.random.default_rng(4)
    means, covariances = random_gaussians(rng, 3, 6, 1.0)
    segments = rng.normal(0, 2, (4, 6))
    found = expected_distances(segments, means, covariances)
    for i in range(3):
        drawn = rng.multivariate_normal(means[i], covariances[i], 40_000)
        distance = np.linalg.norm(drawn[None] - segments[:, None], axis=2)
        error = distance.std(axis=1) / np.sqrt(40_000)
        assert (np.abs(distance.mean(axis=1) - found[:, i]) < 4.5 * error).all()


def test_of_a_point_is_the_distance():
    rng = np.random.default_rng(5)
    segments, means = rng.normal(size=(5, 6)), rng.normal(size=(4, 6))
    means[0] = segments[0]
    found = expected_distances(segments, means, np.zeros((4, 6, 6)))
    np.testing.assert_allclose(found, np.linalg.norm(segments[:, None] - means, axis=2), rtol=1e-12)
