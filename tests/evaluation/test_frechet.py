"""The Fréchet distance against its definition, against known Gaussians, and its features."""

import math

import numpy as np
import pytest
from scipy import linalg

from cospeech.evaluation import frechet


def by_definition(one, other):
    """|m1 - m2|^2 + tr(S1 + S2 - 2 (S1 S2)^(1/2)) with the matrix square root of scipy."""
    first, second = (np.cov(sample.T) + frechet.FLOOR * np.eye(sample.shape[1]) for sample in (one, other))
    apart = one.mean(axis=0) - other.mean(axis=0)
    return apart @ apart + np.trace(first + second - 2 * linalg.sqrtm(first @ second).real)


@pytest.mark.parametrize("seed", range(30))
def test_the_distance_equals_the_definition(seed):
    rng = np.random.default_rng(seed)
    mixing = rng.normal(size=(2, 4, 4))
    one, other = (rng.normal(size=(rng.integers(25, 60), 4)) @ matrix + rng.normal(size=4) for matrix in mixing)
    assert frechet.distance(one, other) == pytest.approx(by_definition(one, other), rel=1e-6, abs=1e-6)
    assert frechet.distance(one, other) == pytest.approx(frechet.distance(other, one))
    assert frechet.distance(one, one) == pytest.approx(0.0, abs=1e-8)


def test_independent_features_add_the_squared_differences_of_means_and_deviations():
    rng = np.random.default_rng(3)
    sample = rng.normal(size=(400, 3))
    sample = (sample - sample.mean(axis=0)) @ np.linalg.inv(np.linalg.cholesky(np.cov(sample.T)).T)
    other = sample * [2.0, 1.0, 0.5] + [0.0, 3.0, 0.0]
    assert frechet.distance(sample, other) == pytest.approx(1.0 + 9.0 + 0.25, abs=1e-4)


def test_it_is_biased_by_the_number_of_windows_as_stated():
    """Samples of one distribution are the further apart, the smaller they are."""
    rng = np.random.default_rng(1)
    halves = [frechet.between_halves(rng.normal(size=(n, 10))) for n in (60, 240, 4000)]
    assert halves[0] > halves[1] > halves[2] > 0.0


def test_features_are_position_speed_and_spread_of_each_wrist():
    fps = 20.0
    time_s = np.arange(100) / fps
    places = np.zeros((100, 2, 3))
    places[:, 0, 1] = 0.5 * time_s
    places[:, 1, 0] = 0.3
    speed = np.tile([0.5, 0.0], (100, 1))
    found = frechet.features(places, speed, fps)
    assert found.shape == (8, 10)
    np.testing.assert_allclose(found[0, :6], [0.0, 0.25 * 1.45, 0.0, 0.3, 0.0, 0.0])
    np.testing.assert_allclose(found[:, 6:8], [[math.log(0.501), math.log(1e-3)]] * 8)
    np.testing.assert_allclose(found[1, 8:], [math.log(places[10:40, 0, 1].std() + 1e-3), math.log(1e-3)])
    assert frechet.features(places[:29], speed[:29], fps).shape == (0, 10)


def test_too_few_windows_have_no_distance():
    sample = np.random.default_rng(0).normal(size=(frechet.FEWEST, 10))
    assert math.isnan(frechet.distance(sample[1:], sample))
    assert frechet.distance(sample, sample[::-1]) == pytest.approx(0.0, abs=1e-8)
