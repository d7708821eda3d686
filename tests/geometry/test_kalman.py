"""The smoother against a dense linear-Gaussian estimate of all frames, and its effect on hidden markers."""

import numpy as np
import pytest

from cospeech.geometry import kalman


def dense(points, sd, fps, jerk):
    """Mean and standard deviation of every position given all observations, from the joint covariance."""
    transition, noise = kalman.motion_model(1 / fps, jerk)
    n = len(points)
    covariance = np.zeros((3 * n, 3 * n))
    own = np.diag(np.square(kalman.START_SD))
    for t in range(n):
        if t:
            own = transition @ own @ transition.T + noise
        block = own
        for later in range(t, n):
            covariance[3 * later : 3 * later + 3, 3 * t : 3 * t + 3] = block
            covariance[3 * t : 3 * t + 3, 3 * later : 3 * later + 3] = block.T
            block = transition @ block
    there = np.flatnonzero(np.isfinite(points[:, 0]))
    middle = points[there].mean(axis=0)
    place, sight = 3 * np.arange(n), 3 * there
    seen = covariance[np.ix_(sight, sight)] + np.diag(sd[there] ** 2)
    gain = np.linalg.solve(seen, covariance[np.ix_(sight, place)]).T
    mean = gain @ (points[there] - middle) + middle
    left = covariance[np.ix_(place, place)] - gain @ covariance[np.ix_(sight, place)]
    return mean, np.sqrt(np.diag(left))


def test_smoother_is_the_dense_gaussian_estimate():
    rng = np.random.default_rng(0)
    time = np.arange(30) / 20
    points = np.column_stack([np.sin(3 * time), np.cos(2 * time), time**2]) + rng.normal(0, 0.01, (30, 3))
    points[[0, 7, 8, 9, 10, 29]] = np.nan
    sd = rng.uniform(0.005, 0.02, 30)
    smoothed, spread = kalman.smooth(points, sd, 20, 20.0)
    mean, deviation = dense(points, sd, 20, 20.0)
    np.testing.assert_allclose(smoothed, mean, atol=1e-6)
    np.testing.assert_allclose(spread, deviation, rtol=1e-4, atol=1e-7)


def test_a_step_of_the_filter_is_bayes_rule():
    transition, noise = kalman.motion_model(0.05, 10.0)
    state, covariance = kalman.predict(np.ones((3, 3)), np.eye(3), transition, noise)
    np.testing.assert_allclose(state[0], 1.05125)
    np.testing.assert_allclose(covariance, transition @ transition.T + noise)
    after, left = kalman.update(state, covariance, np.zeros(3), 0.25)
    information = np.linalg.inv(covariance) + np.diag([4.0, 0, 0])
    np.testing.assert_allclose(left, np.linalg.inv(information), rtol=1e-8)
    np.testing.assert_allclose(after, left @ np.linalg.inv(covariance) @ state, rtol=1e-8)


def test_noise_of_the_transition_adds_up_over_steps():
    half, half_noise = kalman.motion_model(0.05, 3.0)
    whole, whole_noise = kalman.motion_model(0.1, 3.0)
    np.testing.assert_allclose(half @ half, whole)
    np.testing.assert_allclose(half @ half_noise @ half.T + half_noise, whole_noise)


def test_hidden_span_is_bridged_and_grows_less_sure():
    time = np.arange(60) / 20
    truth = np.column_stack([0.3 * np.sin(2 * time), 0.2 * np.cos(2 * time), 0.1 * time])
    points = truth.copy()
    points[25:33] = np.nan
    smoothed, sd = kalman.smooth(points, np.full(60, 5e-4), 20, 3.0)
    assert np.abs(smoothed - truth)[25:33].max() < 2e-3
    assert sd[29] > 5 * sd[20]
    assert np.sqrt(np.mean((smoothed - truth)[5:20] ** 2)) < 5e-4


def test_never_seen_stays_missing():
    smoothed, sd = kalman.smooth(np.full((5, 3), np.nan), np.full(5, 1e-3), 20, 1.0)
    assert np.isnan(smoothed).all()
    assert np.isnan(sd).all()


@pytest.mark.parametrize("seed", range(3))
def test_smoothing_brings_noisy_points_nearer_to_the_truth(seed):
    time = np.arange(100) / 20
    truth = np.column_stack([0.3 * np.sin(2 * time), 0.2 * np.cos(3 * time), 0.1 * time])
    points = truth + np.random.default_rng(seed).normal(0, 1e-3, truth.shape)
    smoothed, _ = kalman.smooth(points, np.full(100, 1e-3), 20, 5.0)
    assert np.mean((smoothed - truth) ** 2) < 0.6 * np.mean((points - truth) ** 2)


def test_the_model_of_angles_is_the_dense_gaussian_estimate():
    """The filter uses the frames up to its own, the smoother all of them."""
    draw = np.random.default_rng(1)
    values = np.cumsum(draw.normal(0, 1, (12, 3)), axis=0)
    values[[4, 5]] = np.nan
    transition, noise = kalman.difference_model(0.1, 0.4)
    variances, start = draw.uniform(0.1, 0.5, 12), np.diag([25.0, 4.0])
    filtered, smoothed, sd = kalman.filter_and_smooth(values, variances, transition, noise, start)
    blocks = [np.linalg.matrix_power(transition, t) for t in range(12)]
    whole = np.zeros((24, 24))
    for t in range(12):
        for u in range(12):
            shared = blocks[t] @ start @ blocks[u].T
            for k in range(1, min(t, u) + 1):
                shared = shared + blocks[t - k] @ noise @ blocks[u - k].T
            whole[2 * t : 2 * t + 2, 2 * u : 2 * u + 2] = shared
    whole = whole[::2, ::2]  # of the values: [I 0] observes them
    for t in range(12):
        for result, seen in ((filtered, np.arange(t + 1)), (smoothed, np.arange(12))):
            seen = seen[np.isfinite(values[seen, 0])]
            gain = np.linalg.solve(whole[np.ix_(seen, seen)] + np.diag(variances[seen]), whole[seen, t])
            np.testing.assert_allclose(result[t], gain @ values[seen], atol=1e-8)
            left = whole[t, t] - gain @ whole[seen, t]
        assert sd[t] == pytest.approx(np.sqrt(left), abs=1e-8)
