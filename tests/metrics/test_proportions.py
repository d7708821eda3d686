"""Intervals of proportions against scipy, and the overlap of intervals of time against sampling."""

import numpy as np
import pytest
from scipy import stats

from cospeech.metrics import proportions


@pytest.mark.parametrize(("found", "number"), [(33, 35), (10, 600), (0, 7), (7, 7), (79, 122)])
def test_intervals_are_those_of_scipy(found, number):
    expected = stats.binomtest(found, number).proportion_ci(0.9, method="wilson")
    assert proportions.wilson(found, number, 0.9) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_a_proportion_of_nothing_has_no_interval():
    assert np.isnan(proportions.wilson(0, 0, 0.95)).all()


def test_the_shared_time_equals_the_count_of_shared_ticks():
    rng = np.random.default_rng(1)
    one, others = (np.sort(rng.integers(0, 50, (8, 2)), axis=1).astype(float) for _ in range(2))
    ticks = np.arange(50) + 0.5
    covered = [[(ticks > start) & (ticks < end) for start, end in rows] for rows in (one, others)]
    expected = np.array([[np.count_nonzero(a & b) for b in covered[1]] for a in covered[0]])
    assert np.array_equal(proportions.overlaps(one, others), expected)
    found, partner = proportions.partners(one, others)
    assert np.array_equal(found, expected.max(axis=1) > 0)
    assert np.array_equal(expected[np.arange(8), partner], expected.max(axis=1))


def test_nothing_overlaps_an_empty_set():
    assert not proportions.partners(np.array([[0.0, 1.0]]), np.zeros((0, 2)))[0].any()
