"""Share of frames right and Cohen's kappa, against scikit-learn and an example by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.metrics import cohen_kappa_score

from cospeech.metrics import agreement

PAIRS = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=60)


def test_by_hand():
    # Cohen's table: 20 + 15 of 50 agree, chance agreement 0.5: kappa (0.7 - 0.5) / 0.5 = 0.4.
    actual = np.repeat([0, 0, 1, 1], [20, 5, 10, 15])
    synthesised = np.repeat([0, 1, 0, 1], [20, 5, 10, 15])
    assert agreement.share_right(actual, synthesised) == 0.7
    assert agreement.kappa(actual, synthesised) == pytest.approx(0.4)


def test_one_label_throughout():
    same = np.zeros(9, dtype=int)
    assert agreement.kappa(same, same + 1) == 0
    mixed = np.array([0, 0, 0, 1, 1, 2, 2, 2, 2])
    assert agreement.kappa(mixed, same) == 0  # the most frequent label earns nothing


def test_kappa_is_undefined_where_chance_agreement_is_perfect_or_there_is_no_frame():
    same = np.full(9, 3)
    for labels in (same, same[:0]):
        assert math.isnan(agreement.kappa(labels, labels))  # a score, which means leave out
        assert agreement.kappa(labels, labels, undefined=0.0) == 0.0  # a criterion, which is summed over records
    assert math.isnan(agreement.share_right(same[:0], same[:0]))


def test_the_value_for_undefined_does_not_replace_any_other():
    one, two = np.array([0, 0, 1]), np.array([0, 1, 1])
    assert agreement.kappa(one, two, undefined=9.0) == agreement.kappa(one, two)
    assert agreement.kappa(one, 0 * one, undefined=9.0) == 0.0


@given(PAIRS)
def test_as_scikit_learn(pairs):
    one, two = (np.array(side) for side in zip(*pairs, strict=True))
    found = agreement.kappa(one, two)
    if len({*one, *two}) == 1:
        assert math.isnan(found)
    else:
        assert found == pytest.approx(cohen_kappa_score(one, two), abs=1e-12)
        assert found == agreement.kappa(two, one)
        assert -1 <= found <= 1
        assert found <= agreement.share_right(one, two) + 1e-12
        if len(set(one)) > 1:
            assert agreement.kappa(one, one) == 1


def test_kappa_is_defined_where_one_label_is_rare():
    labels = np.repeat([0, 1], [999, 1])
    assert agreement.kappa(labels, labels) == pytest.approx(1)
