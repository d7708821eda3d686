"""Clusters with an unknown F0 against numerical integration, and EM against its promise."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import stats
from sklearn.mixture import GaussianMixture

from cospeech.errors import UserError
from cospeech.synthesis.controller import clusters, clusters_kernels
from cospeech.synthesis.controller.clusters import Range

FLOOR = np.full(3, 1e-3)


def random_clusters(rng, n_clusters):
    factors = rng.normal(size=(n_clusters, 3, 3)) * 0.6
    covariance = factors @ factors.swapaxes(1, 2) + 0.2 * np.eye(3)
    return clusters.Clusters(rng.dirichlet(np.full(n_clusters, 3.0)), rng.normal(0, 2, (n_clusters, 3)), covariance)


def draw(planted, n_frames, rng, unvoiced=0.3):
    cluster = rng.choice(len(planted.weight), n_frames, p=planted.weight)
    noise = rng.normal(size=(n_frames, 3))
    frames = planted.mean[cluster] + np.einsum("tde,te->td", np.linalg.cholesky(planted.covariance)[cluster], noise)
    frames[rng.random(n_frames) < unvoiced, -1] = np.nan
    return frames


def test_density_without_f0_is_the_integral_over_the_range():
    rng = np.random.default_rng(1)
    for _ in range(40):
        planted, f0 = random_clusters(rng, 1), Range(*np.sort(rng.normal(0, 4, 2)))
        frame = np.append(rng.normal(0, 2, 2), np.nan)
        f = np.linspace(*f0, 20_001)
        points = np.column_stack([np.tile(frame[:2], (len(f), 1)), f])
        values = stats.multivariate_normal(planted.mean[0], planted.covariance[0]).pdf(points)
        true = np.trapezoid(values, f) / (f0.high - f0.low)
        found = np.exp(clusters.log_densities(frame[None], planted.mean, planted.covariance, f0)[0, 0])
        assert found == pytest.approx(true, rel=1e-6)
        first, second = np.zeros((1, 3)), np.zeros((1, 3, 3))
        factors = np.linalg.cholesky(planted.covariance)
        clusters_kernels.add_moments(
            frame[None], np.ones((1, 1)), np.zeros(3), planted.mean, factors, *f0, first, second
        )
        mean = np.trapezoid(values * f, f) / np.trapezoid(values, f)
        assert first[0, -1] == pytest.approx(mean, rel=1e-5, abs=1e-6)
        assert second[0, -1, -1] == pytest.approx(
            np.trapezoid(values * f**2, f) / np.trapezoid(values, f), rel=1e-5, abs=1e-6
        )
        assert second[0, 0, -1] == pytest.approx(frame[0] * mean, rel=1e-5, abs=1e-6)


def test_over_a_wide_range_it_is_the_density_of_the_other_features():
    rng = np.random.default_rng(2)
    planted = random_clusters(rng, 4)
    frames = np.column_stack([rng.normal(0, 2, (50, 2)), np.full(50, np.nan)])
    found = clusters.log_densities(frames, planted.mean, planted.covariance, Range(-100.0, 100.0))
    for k in range(4):
        marginal = stats.multivariate_normal(planted.mean[k, :2], planted.covariance[k, :2, :2]).logpdf(frames[:, :2])
        np.testing.assert_allclose(found[:, k], marginal - np.log(200.0), rtol=1e-10)


def test_a_range_far_from_the_cluster_does_not_underflow():
    mean, covariance = np.zeros((1, 3)), 1e-2 * np.eye(3)[None]
    frames = np.array([[0.0, 0.0, np.nan]])
    for low, high in ((50.0, 60.0), (-60.0, -50.0)):
        found = clusters.log_densities(frames, mean, covariance, Range(low, high))[0, 0]
        others = stats.multivariate_normal(np.zeros(2), 1e-2 * np.eye(2)).logpdf([0.0, 0.0])
        assert found == pytest.approx(others - np.log(10.0) + stats.norm(0, 0.1).logsf(50.0), rel=1e-6)


def test_likelihood_rises_with_every_update():
    rng = np.random.default_rng(3)
    for _ in range(15):
        frames = np.repeat(draw(random_clusters(rng, 3), 40, rng, 0.5), 4, axis=0)
        fit = clusters.fit(frames, 4, Range(-6.0, 6.0), FLOOR, 30, rng)
        for before, after in pairwise(fit.log_likelihoods):
            assert after >= before - 1e-9 * abs(before)
        shares = clusters.memberships(fit.clusters, frames, Range(-6.0, 6.0))
        np.testing.assert_allclose(shares.sum(axis=1), 1.0)


def test_equals_a_mixture_model_where_all_f0_are_known():
    rng = np.random.default_rng(4)
    planted = random_clusters(rng, 3)
    frames = draw(planted, 500, rng, 0.0)
    peer = GaussianMixture(3, covariance_type="full")
    peer.weights_, peer.means_, peer.covariances_ = planted
    peer.precisions_cholesky_ = np.linalg.cholesky(np.linalg.inv(planted.covariance))
    np.testing.assert_allclose(
        clusters.memberships(planted, frames, Range(-9.0, 9.0)), peer.predict_proba(frames), atol=1e-10
    )


def test_windows_hold_lagged_copies():
    values = np.arange(8.0).reshape(4, 2)
    found = clusters.windows([values], 3)[0]
    np.testing.assert_array_equal(found[3], [6, 7, 4, 5, 2, 3])
    np.testing.assert_array_equal(found[0], [0, 1, 0, 1, 0, 1])
    np.testing.assert_array_equal(clusters.windows([values], 1)[0], values)


def test_bad_speech_is_refused():
    rng = np.random.default_rng(5)
    with pytest.raises(UserError, match="too few for 4 clusters"):
        clusters.fit(np.zeros((3, 3)), 4, Range(0.0, 1.0), FLOOR, 2, rng)
    with pytest.raises(UserError, match=r"no syllable .* voiced"):
        clusters.fit(np.column_stack([np.zeros((9, 2)), np.full(9, np.nan)]), 4, Range(0.0, 1.0), FLOOR, 2, rng)
