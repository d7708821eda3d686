"""The criterion by which an emission weight is chosen, by hand. Kappa and distance themselves: tests/metrics."""

import math

import numpy as np
import pytest

from cospeech.data import segments
from cospeech.markov.hsmm import Path
from cospeech.metrics import agreement
from cospeech.synthesis.hsmm.agreement import agreements


def path(starts, labels):
    return Path(np.array(starts), np.array(labels, dtype=object), 0.0)


def test_agreement_counts_boundaries_in_mean_phrases():
    actual = segments.from_starts("r", [0, 10], ["a", "b"], 40, 40)
    late = path([0, 14], ["a", "b"])
    frames = segments.to_labels(actual), np.repeat(late.labels, [14, 26])
    exact, worse = agreements(actual, [path([0, 10], ["a", "b"]), late])
    assert exact == 1.0
    kappa = agreement.kappa(*(np.unique(side, return_inverse=True)[1] for side in frames))
    assert worse == pytest.approx(kappa - 2 / 20)  # 0 and 4 frames of phrases of 20


def test_a_label_that_the_actual_phrases_lack_is_wrong_everywhere():
    actual = segments.from_starts("r", [0, 10], ["a", "b"], 20, 40)
    assert agreements(actual, [path([0, 10], ["c", "d"])]) == [0.0]


def test_one_label_throughout_agrees_by_chance_alone():
    actual = segments.from_starts("r", [0], ["rest"], 40, 40)
    assert agreements(actual, [path([0], ["rest"])]) == [0.0]
    assert not math.isnan(agreements(actual, [path([0, 7], ["rest", "rest"])])[0])
