"""Planted models are recovered within sampling error; logistic regressions against scikit-learn and scipy."""

import numpy as np
import pytest
from scipy import special, stats
from sklearn.linear_model import LogisticRegression
from small_chain import continuation, drawn_path, random_chain

from cospeech.synthesis.bodylanguage import chain, observations


@pytest.fixture(scope="module")
def planted():
    """Three planted models and what is learnt from their paths."""
    cases = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        model = random_chain(rng, 3)
        paths = [drawn_path(model, rng, 1500) for _ in range(4)]
        cases.append((model, paths, chain.estimate(paths, model.length_s)))
    return cases


def within_sampling_error(found, planted, counts):
    """Whether estimated shares are within four standard errors (plus the counts that are added to all)."""
    error = 4.0 * np.sqrt(planted * (1.0 - planted) / counts) + 0.05 / counts
    return (np.abs(found - planted) <= error).all()


def test_planted_transitions_and_observations_are_recovered(planted):
    for model, paths, found in planted:
        starts, continuations, leaving = np.zeros((3, 3))
        for path in paths:
            np.add.at(starts, path.cluster[path.start], 1)
            np.add.at(continuations, path.cluster[~path.start], 1)
            ends = ~path.start[:-1] & path.start[1:]
            np.add.at(leaving, path.cluster[:-1][ends], 1)
        assert within_sampling_error(found.continuing, model.continuing, starts)
        assert within_sampling_error(found.after_start, model.after_start, starts[:, None])
        assert within_sampling_error(found.after, model.after, leaving[:, None])
        assert within_sampling_error(found.emissions[:, 0], model.emissions[:, 0], starts)
        assert within_sampling_error(found.emissions[:, 1], model.emissions[:, 1], continuations)


def test_planted_continuations_are_recovered_and_the_printed_fit_is_not():
    printed_off = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        model = random_chain(rng, 3)
        paths = [drawn_path(model, rng, 1500, alike=True) for _ in range(4)]
        fits = chain.estimate(paths, model.length_s).logit, chain.printed_fit(paths, 3)
        for i in range(3):
            elapsed = np.concatenate([path.elapsed[:-1][path.cluster[:-1] == i] for path in paths])
            shares = np.quantile(elapsed, [0.25, 0.5, 0.75])
            true = continuation(model, i, shares)
            own, printed = (special.expit(fit[i, 0] + fit[i, 1] * shares) for fit in fits)
            information = true_information(np.column_stack([np.ones(len(elapsed)), elapsed]), model.logit[i])
            at = np.column_stack([np.ones(3), shares])
            error = np.sqrt(np.einsum("ij,jk,ik->i", at, np.linalg.inv(information), at)) * true * (1.0 - true)
            assert (np.abs(own - true) <= 4.0 * error).all()
            printed_off.append(np.abs(printed - true).mean())
    assert np.mean(printed_off) > 0.05


def true_information(features, logit):
    share = special.expit(features @ logit)
    return (features * (share * (1.0 - share))[:, None]).T @ features


def test_regression_equals_that_of_scikit_learn():
    """With one cluster, the prior is the pooled fit, which is almost without one."""
    rng = np.random.default_rng(1)
    for _ in range(6):
        elapsed = rng.uniform(0.0, 1.2, 400)
        continues = rng.random(400) < special.expit(2.0 - 4.0 * elapsed)
        found = chain.regression(np.zeros(400, dtype=np.int64), elapsed, continues, 1)[0]
        peer = LogisticRegression(C=1e8, tol=1e-10, max_iter=1000).fit(elapsed[:, None], continues)
        np.testing.assert_allclose(found, [peer.intercept_[0], peer.coef_[0, 0]], rtol=0.01)


def test_a_cluster_with_little_data_stays_near_the_others_and_no_slope_is_positive():
    rng = np.random.default_rng(2)
    elapsed = rng.uniform(0.0, 1.0, 600)
    cluster = np.where(np.arange(600) < 598, 0, 1)
    continues = rng.random(600) < special.expit(1.0 - 3.0 * elapsed)
    found = chain.regression(cluster, elapsed, continues, 3)
    assert np.abs(found[1:] - found[0]).max() < 1.5
    rising = chain.regression(np.zeros(600, dtype=np.int64), elapsed, elapsed > 0.5, 1)
    assert rising[0, 1] == 0.0
    assert special.expit(rising[0, 0]) == pytest.approx((elapsed > 0.5).mean(), abs=1e-3)
    nothing = chain.regression(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0, dtype=bool), 2)
    np.testing.assert_array_equal(nothing, np.zeros((2, 2)))


def test_printed_fit_equals_the_logistic_distribution_of_scipy():
    rng = np.random.default_rng(3)
    for _ in range(10):
        final = rng.beta(5.0, 2.0, 50)
        path = chain.Path(
            np.zeros(51, dtype=np.int64), np.zeros(51, dtype=np.int64), np.ones(51, dtype=bool), np.append(final, 0.0)
        )
        intercept, slope = chain.printed_fit([path], 1)[0]
        location, scale = stats.logistic.fit(final)
        np.testing.assert_allclose([-intercept / slope, -1.0 / slope], [location, scale], rtol=2e-3)
    assert np.isnan(chain.printed_fit([path], 2)[1]).all()


def test_every_distribution_is_normalised_even_without_data():
    empty = chain.Path(*(np.empty(0, dtype=kind) for kind in (np.int64, np.int64, bool, float)))
    found = chain.estimate([empty], np.ones(3))
    np.testing.assert_allclose(found.continuing + found.after_start.sum(axis=1), 1.0)
    for shares in (found.initial, found.after.T, found.emissions.reshape(observations.N_OBSERVATIONS, -1)):
        np.testing.assert_allclose(shares.sum(axis=0), 1.0)
