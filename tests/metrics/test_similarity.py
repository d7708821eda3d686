"""S, the cosine of duration histograms, against examples by hand and another way to count."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.metrics import similarity

FRAME_S = 0.025
DURATIONS = st.lists(st.integers(1, 500), max_size=40)


def histogram(durations_s, bin_s, max_duration_s=10.0):
    labels = np.zeros(len(durations_s), dtype=int)
    return similarity.duration_histograms(durations_s, labels, 1, bin_s, max_duration_s)[0]


def test_by_hand():
    # Bins of 1 s up to 3 s: (0, 1] holds 0.5 and 1.0, (1, 2] holds 1.5, the last one 2.5 and what is longer.
    assert histogram([0.5, 1.0, 1.5, 2.5, 7.0], 1.0, 3.0).tolist() == [2, 1, 2]
    # cos((2, 1, 2), (1, 0, 1)) = 4 / (3 * sqrt(2))
    assert similarity.similarities([2, 1, 2], [1, 0, 1]) == pytest.approx(4 / (3 * math.sqrt(2)))


def test_one_bin_a_frame_holds_exactly_that_duration():
    durations_s = np.arange(1, 401) * FRAME_S
    assert (histogram(durations_s, FRAME_S) == 1).all()


@pytest.mark.parametrize("bin_s", [0.025, 0.05, 0.25, 0.5])
def test_counts_agree_with_whole_numbers(bin_s):
    frames = np.random.default_rng(3).integers(1, 600, 2000)
    per_bin = round(bin_s / FRAME_S)
    expected = np.bincount(np.minimum((frames - 1) // per_bin, round(10 / bin_s) - 1), minlength=round(10 / bin_s))
    assert (histogram(frames * FRAME_S, bin_s) == expected).all()


def test_each_label_has_its_own_histogram():
    counts = similarity.duration_histograms([1.0, 1.0, 2.0], [0, 2, 2], 3, 1.0, 2.0)
    assert counts.tolist() == [[1, 0], [0, 0], [1, 1]]


def test_both_empty_is_undefined_and_one_empty_is_zero():
    empty, full = np.zeros(4), np.array([0, 1, 0, 2])
    values = similarity.similarities([empty, empty, full, full], [empty, full, empty, full])
    assert math.isnan(values[0])
    assert values[1:].tolist() == [0.0, 0.0, 1.0]


@given(DURATIONS, DURATIONS, st.sampled_from([0.025, 0.25, 0.5]))
def test_bounds_symmetry_and_identity(one, two, bin_s):
    p, q = histogram(np.array(one) * FRAME_S, bin_s), histogram(np.array(two) * FRAME_S, bin_s)
    assert p.sum() == len(one)
    value, mirrored = similarity.similarities(p, q), similarity.similarities(q, p)
    if not one and not two:
        assert math.isnan(value)
    else:
        assert 0 <= value <= 1
        assert value == mirrored
        # As probabilities (eq. 7.1) or as counts: the cosine is the same.
        if one and two:
            assert similarity.similarities(p / p.sum(), q / q.sum()) == pytest.approx(value, abs=1e-12)
    if one:
        assert similarity.similarities(p, p) == pytest.approx(1.0, abs=1e-12)
