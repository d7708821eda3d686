"""Canonical correlation analysis against scikit-learn, planted covariances and its invariances."""

import numpy as np
import pytest
from sklearn.cross_decomposition import CCA

from cospeech.errors import UserError
from cospeech.identity import canonical
from cospeech.identity.canonical import Covariances


def draw(rng, n, n_x, n_y, correlations):
    """Frames with these canonical correlations in the population."""
    k = len(correlations)
    x, y = rng.normal(size=(n, n_x)), rng.normal(size=(n, n_y))
    y[:, :k] = correlations * x[:, :k] + np.sqrt(1 - np.square(correlations)) * y[:, :k]
    return x @ rng.normal(size=(n_x, n_x)) + 5.0, y @ rng.normal(size=(n_y, n_y)) - 3.0


def test_agrees_with_scikit_learn():
    rng = np.random.default_rng(1)
    for n_x, n_y in ((4, 6), (6, 4), (3, 3)):
        x, y = draw(rng, 400, n_x, n_y, np.array([0.9, 0.6, 0.3]))
        found = canonical.fit(x, y)
        peer = CCA(n_components=3, scale=False, max_iter=20_000, tol=1e-14).fit(x, y)
        theirs = [np.corrcoef(*pair)[0, 1] for pair in zip(*(side.T for side in peer.transform(x, y)), strict=True)]
        np.testing.assert_allclose(found.correlations[:3], theirs, atol=1e-6)
        ours = found.project_x(x)[:, :3].T, peer.transform(x, y)[0].T
        for own, other in zip(*ours, strict=True):
            assert abs(np.corrcoef(own, other)[0, 1]) == pytest.approx(1.0, abs=1e-6)


def test_components_are_white_and_correlated_in_pairs_only():
    x, y = draw(np.random.default_rng(2), 300, 5, 7, np.array([0.8, 0.5]))
    found = canonical.fit(x, y)
    first, second = found.project_x(x), found.project_y(y)
    np.testing.assert_allclose(first.T @ first / 300, np.eye(5), atol=1e-9)
    np.testing.assert_allclose(second.T @ second / 300, np.eye(5), atol=1e-9)
    np.testing.assert_allclose(first.T @ second / 300, np.diag(found.correlations), atol=1e-9)
    assert (np.diff(found.correlations) <= 0).all()


def test_solves_the_eigenvalue_problem_of_the_document():
    x, y = draw(np.random.default_rng(3), 200, 4, 5, np.array([0.7]))
    given = canonical.covariances(x, y)
    found = canonical.of_covariances(given)
    matrix = np.linalg.solve(given.xx, given.xy) @ np.linalg.solve(given.yy, given.xy.T)
    for basis, correlation in zip(found.basis_x, found.correlations, strict=True):
        np.testing.assert_allclose(matrix @ basis, correlation**2 * basis, atol=1e-9)


def test_recovers_a_planted_covariance_exactly_and_within_sampling_error():
    planted = np.array([0.9, 0.5, 0.2])
    rng = np.random.default_rng(4)
    a, b = rng.normal(size=(3, 3)), rng.normal(size=(4, 4))
    cross = np.zeros((3, 4))
    cross[:3, :3] = np.diag(planted)
    exact = Covariances(np.zeros(3), np.zeros(4), a @ a.T, a @ cross @ b.T, b @ b.T)
    np.testing.assert_allclose(canonical.of_covariances(exact).correlations, planted, atol=1e-9)
    errors = [canonical.fit(*draw(rng, 2000, 3, 4, planted)).correlations - planted for _ in range(40)]
    expected = (1 - planted**2) / np.sqrt(2000)
    np.testing.assert_allclose(np.std(errors, axis=0), expected, rtol=0.4)
    assert (np.abs(np.mean(errors, axis=0)) < expected).all()


def test_correlations_are_invariant_under_linear_maps():
    rng = np.random.default_rng(5)
    x, y = draw(rng, 300, 4, 6, np.array([0.8, 0.4]))
    once = canonical.fit(x, y)
    again = canonical.fit(x @ rng.normal(size=(4, 4)) + 1.0, y @ rng.normal(size=(6, 6)) - 2.0)
    np.testing.assert_allclose(once.correlations, again.correlations, atol=1e-9)
    np.testing.assert_allclose(canonical.fit(y, x).correlations, once.correlations, atol=1e-9)


def test_regularisation_lowers_correlations_and_helps_where_features_depend_on_one_another():
    rng = np.random.default_rng(6)
    x, y = rng.normal(size=(30, 15)), rng.normal(size=(30, 18))
    with pytest.raises(
        UserError, match=r"covariance of 18 lip features is singular.*identity\.regularisation above 0"
    ):
        canonical.fit(x, np.concatenate([y[:, :17], y[:, :1]], axis=1))
    assert canonical.fit(x, y, 0.5).correlations[0] < canonical.fit(x, y, 0.0).correlations[0]


def test_fewer_frames_than_features_are_refused():
    rng = np.random.default_rng(7)
    with pytest.raises(UserError, match="covariance of 8 audio features is singular"):
        canonical.fit(rng.normal(size=(6, 8)), rng.normal(size=(6, 3)))


def test_principal_components_are_white():
    frames = np.random.default_rng(8).normal(size=(100, 4)) @ np.diag([4.0, 2.0, 1.0, 0.5])
    mean, basis = canonical.principal(frames, 3)
    found = (frames - mean) @ basis.T
    np.testing.assert_allclose(found.T @ found / 100, np.eye(3), atol=1e-9)
    with pytest.raises(UserError, match="fewer than 5 independent"):
        canonical.principal(np.concatenate([frames, frames[:, :1]], axis=1), 5)
