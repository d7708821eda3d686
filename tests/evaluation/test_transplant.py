"""What is said about one actor's model under another actor's voice, on phrases that can be counted by hand."""

import pytest

from cospeech.data import segments
from cospeech.evaluation import transplant

FRAME_S = 0.1


def phrases(labels, starts, n_frames):
    return segments.from_starts("a", starts, labels, n_frames, 1 / FRAME_S)


def test_statistics_are_those_of_the_phrases():
    found = transplant.row(phrases(["rest", "left", "rest"], [0, 10, 40], 50), None, FRAME_S)
    assert found["n_phrases"] == 3
    assert found["phrases_per_minute"] == pytest.approx(36)
    assert found["mean_phrase_s"] == pytest.approx(5 / 3)
    assert found["share_rest"] == pytest.approx(0.4)
    assert found["kappa"] is None


def test_agreement_is_that_of_the_frames_both_have():
    # Of the 40 frames that both have, 10 are rest in both, 20 are left in both, and 10 differ.
    one = phrases(["rest", "left"], [0, 10], 60)
    other = phrases(["rest", "left", "left"], [0, 20, 30], 40)
    agreed, by_chance = 30 / 40, (10 * 20 + 30 * 20) / 40**2
    found = transplant.row(one, other, FRAME_S)
    assert found["kappa"] == pytest.approx((agreed - by_chance) / (1 - by_chance))
