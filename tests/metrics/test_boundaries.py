"""D and boundary F1, against examples by hand, brute force and a general matching algorithm."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_bipartite_matching

from cospeech.metrics import boundaries

TIMES = st.lists(st.integers(0, 400), max_size=12, unique=True).map(lambda frames: np.sort(frames) * 0.025)


def most_pairs(one, two, tolerance_s):
    """The size of the largest matching, by a general algorithm for bipartite graphs."""
    if len(one) == 0 or len(two) == 0:
        return 0
    near = np.abs(np.subtract.outer(one, two)) <= tolerance_s + 1e-9
    return int((maximum_bipartite_matching(csr_matrix(near), perm_type="column") >= 0).sum())


def test_by_hand():
    actual, synthesised = [0.0, 2.0, 5.0], [0.0, 1.5, 4.0, 9.0]
    assert boundaries.nearest_distances(synthesised, actual).tolist() == [0.0, 0.5, 1.0, 4.0]
    assert boundaries.distance(synthesised, actual) == pytest.approx(5.5 / 4)
    # The other way round, from each of three actual boundaries to the nearest synthesised one.
    assert boundaries.distance(actual, synthesised) == pytest.approx((0 + 0.5 + 1.0) / 3)
    # Within 0.5 s: 0 with 0 and 1.5 with 2, so precision 2/4, recall 2/3, F1 4/7.
    assert boundaries.matches(synthesised, actual, 0.5) == 2
    assert boundaries.boundary_f1(synthesised, actual, 0.5) == pytest.approx(4 / 7)


def test_distances_are_in_the_unit_of_the_boundaries():
    frames = boundaries.distance([0, 60, 160], [0, 80, 200])
    assert frames == pytest.approx(20.0)
    assert boundaries.distance([0.0, 1.5, 4.0], [0.0, 2.0, 5.0]) == pytest.approx(frames * 0.025)


def test_one_boundary_is_paired_once():
    assert boundaries.matches([1.0, 1.1, 1.2], [1.1], 0.5) == 1
    # Pairing the nearest ones first would leave one over: 1.0 with 1.05, then 0.6 with none.
    assert boundaries.matches([0.6, 1.0], [1.05, 1.4], 0.45) == 2


def test_the_tolerance_itself_counts_in_spite_of_rounding():
    assert 1.1 - 0.6 > 0.5
    assert boundaries.matches([0.6], [1.1], 0.5) == 1


def test_nothing_to_compare_is_undefined():
    assert math.isnan(boundaries.distance([], [1.0]))
    assert math.isnan(boundaries.distance([1.0], []))
    assert math.isnan(boundaries.boundary_f1([], [], 0.5))
    assert boundaries.boundary_f1([], [1.0], 0.5) == 0.0


@given(TIMES, TIMES, st.sampled_from([0.1, 0.5, 1.0]))
def test_pairing_is_maximal_and_symmetric(one, two, tolerance_s):
    found = boundaries.matches(one, two, tolerance_s)
    assert found == most_pairs(one, two, tolerance_s)
    assert found == boundaries.matches(two, one, tolerance_s)
    if len(one) or len(two):
        assert 0 <= boundaries.boundary_f1(one, two, tolerance_s) <= 1


@given(TIMES, TIMES)
def test_distance_is_that_of_brute_force(one, two):
    if len(one) and len(two):
        expected = np.abs(np.subtract.outer(one, two)).min(axis=1)
        np.testing.assert_allclose(boundaries.nearest_distances(one, two), expected, atol=1e-12)
        assert boundaries.distance(one, two) == pytest.approx(expected.mean(), abs=1e-12)


@given(TIMES)
def test_equal_sequences(times):
    if len(times):
        assert boundaries.distance(times, times) == 0
        assert boundaries.boundary_f1(times, times, 0.5) == 1


def test_the_tolerance_is_not_wider_than_rounding_needs():
    assert boundaries.matches([0.1 + 0.2], [0.8], 0.5) == 1  # the distance is above 0.5 only by rounding
    assert boundaries.matches([0.3], [0.801], 0.5) == 0
