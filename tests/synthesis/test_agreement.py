"""Cohen's kappa against another program, the boundary distance against its definition."""

import numpy as np
import pytest
from cospeech.synthesis.agreement import agreements, boundary_distance, kappa
from hypothesis import given
from hypothesis import strategies as st
from sklearn.metrics import cohen_kappa_score

from cospeech.data import segments
from cospeech.markov.hsmm import Path

LABELS = st.lists(st.sampled_from(["rest", "left", "open"]), min_size=2, max_size=60)


@given(LABELS, st.randoms(use_true_random=False))
def test_kappa_equals_that_of_scikit_learn(actual, random):
    made = [label if random.random() < 0.6 else random.choice(["rest", "left", "right"]) for label in actual]
    if len(set(actual) | set(made)) > 1:
        assert kappa(actual, made) == pytest.approx(cohen_kappa_score(actual, made), abs=1e-12)


def test_kappa_is_nothing_where_chance_alone_agrees_wholly():
    assert kappa(["rest"] * 4, ["rest"] * 4) == 0.0


@given(st.sets(st.integers(0, 300), min_size=1), st.sets(st.integers(0, 300), min_size=1))
def test_boundary_distance_is_the_mean_distance_to_the_nearest(actual, made):
    nearest = [min(abs(b - a) for a in actual) for b in made]
    assert boundary_distance(sorted(actual), sorted(made)) == pytest.approx(np.mean(nearest))


def test_agreement_counts_boundaries_in_mean_phrases():
    actual = segments.from_starts("r", [0, 10], ["a", "b"], 40, 40)
    same = Path(np.array([0, 10]), np.array(["a", "b"], dtype=object), 0.0)
    late = Path(np.array([0, 14]), np.array(["a", "b"], dtype=object), 0.0)
    frames = segments.to_labels(actual), np.repeat(late.labels, [14, 26])
    well, less = agreements(actual, [same, late])
    assert well == 1.0
    assert less == pytest.approx(kappa(*frames) - 2 / 20)  # 0 and 4 frames of phrases of 20
