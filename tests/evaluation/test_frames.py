"""Frames right and Cohen's kappa, against scikit-learn and an example by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.metrics import cohen_kappa_score

from cospeech.evaluation import frames

PAIRS = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=60)


def test_by_hand():
    # Cohen's table: 20 + 15 of 50 agree, chance agreement 0.5: kappa (0.7 - 0.5) / 0.5 = 0.4.
    actual = np.repeat([0, 0, 1, 1], [20, 5, 10, 15])
    synthesised = np.repeat([0, 1, 0, 1], [20, 5, 10, 15])
    assert frames.share_right(actual, synthesised) == 0.7
    assert frames.kappa(actual, synthesised) == pytest.approx(0.4)


def test_one_label_throughout():
    same = np.zeros(9, dtype=int)
    assert math.isnan(frames.kappa(same, same))
    assert frames.kappa(same, same + 1) == 0
    mixed = np.array([0, 0, 0, 1, 1, 2, 2, 2, 2])
    assert frames.kappa(mixed, same) == 0  # the most frequent label earns nothing
    assert math.isnan(frames.kappa(same[:0], same[:0]))
    assert math.isnan(frames.share_right(same[:0], same[:0]))


@given(PAIRS)
def test_as_scikit_learn(pairs):
    one, two = (np.array(side) for side in zip(*pairs, strict=True))
    found = frames.kappa(one, two)
    if len({*one, *two}) == 1:
        assert math.isnan(found)
    else:
        assert found == pytest.approx(cohen_kappa_score(one, two), abs=1e-12)
        assert found == frames.kappa(two, one)
        assert -1 <= found <= 1
        assert found <= frames.share_right(one, two) + 1e-12
        if len(set(one)) > 1:
            assert frames.kappa(one, one) == 1
