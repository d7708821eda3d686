"""The vectors of the kernels against numpy."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from cospeech.markov.lanes import (
    LANES,
    LEAST,
    TINY,
    each,
    exp2,
    first_lane,
    greater,
    greatest,
    put,
    take,
    total,
    where_greater,
)


@numba.njit
def calculate(a, b, results):
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            x, y = take(a, (i, j)), take(b, (i, j))
            put(results, (0, i, j), x * y - 2.0 + (3.0 - x) * y)
            put(results, (1, i, j), greater(x, y))
            put(results, (2, i, j), where_greater(x, y, each(1.0), y))


@numba.njit
def reduce(a):
    x = take(a, (0,))
    return total(x), greatest(x), first_lane(x, greatest(x)), first_lane(x, -np.inf)


@numba.njit
def powers(x, results):
    for i in range(len(x)):
        put(results, (i,), exp2(take(x, (i,))))


def test_arithmetic_is_numpy_s():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 3, 5, LANES))
    a[1, 2, 3] = b[1, 2, 3]
    results = np.zeros((3, 3, 5, LANES))
    calculate(a, b, results)
    np.testing.assert_allclose(results[0], a * b - 2.0 + (3.0 - a) * b, rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(results[1], np.maximum(a, b))
    np.testing.assert_array_equal(results[2], np.where(a > b, 1.0, b))


def test_reductions_are_numpy_s():
    rng = np.random.default_rng(1)
    for _ in range(100):
        a = rng.integers(-3, 3, size=(1, LANES)).astype(float)
        in_all, highest, first, nowhere = reduce(a)
        assert (in_all, highest, first) == (a.sum(), a.max(), a.argmax())
        assert nowhere >= LANES


@pytest.mark.parametrize("span", [1.0, 980.0])
def test_exponential_is_that_of_libm(span):
    x = np.concatenate([np.linspace(-span, 0, 100_000), -np.geomspace(1e-300, 1, 1000)]).reshape(-1, LANES)
    results = np.empty_like(x)
    powers(x, results)
    np.testing.assert_allclose(results, np.exp2(x), rtol=5e-16)


def test_exponential_ends_at_the_least():
    x = np.full((1, LANES), LEAST)
    x[0, :4] = -5000.0, -np.inf, np.nan, 0.0
    results = np.empty_like(x)
    powers(x, results)
    assert results[0].tolist() == [TINY, TINY, TINY, 1.0] + [TINY] * (LANES - 4)
