"""The delay between voice and lips: planted ones are found, and where there is none this is said."""

import numpy as np
import planted_population as planted
import pytest

from cospeech.identity import delay, features
from cospeech.identity.delay import Settings

QUICK = Settings(longest_s=0.25, samples=30)


def speaking(seed, shift, nuisance=0.4):
    length = (110, 130)
    return planted.population(
        seed, True, speakers=3, repetitions=8, others=1, delay=shift, n_frames=length, nuisance=nuisance
    )


@pytest.mark.parametrize("shift", [-20, -7, 0, 4, 13, 20])
def test_planted_delays_are_found_to_5_ms(shift):
    found = delay.find(speaking(40 + shift, shift), QUICK, seed=1)
    assert found.doubt is None
    assert found.delay_s == pytest.approx(shift / 100, abs=0.005)
    assert found.low_s <= found.delay_s <= found.high_s
    assert found.high_s - found.low_s < 0.03


def test_a_delay_between_two_frames_is_found():
    """Voice sampled between the frames of the lips: half a frame late."""
    given = speaking(3, 5, nuisance=0.2)
    halves = [0.5 * (given.audio[1:] + given.audio[:-1])]
    audio = np.concatenate([given.audio[:1], *halves])
    assert delay.find(given._replace(audio=audio), QUICK, seed=1).delay_s == pytest.approx(0.055, abs=0.003)


def test_unrelated_voice_and_lips_have_no_delay():
    doubts = []
    for seed in range(8):
        given = planted.population(seed, False, speakers=2, repetitions=6, others=0, n_frames=(110, 130), own=0.0)
        doubts.append(delay.find(given, QUICK, seed).doubt)
    assert sum(doubt is None for doubt in doubts) <= 1
    assert any("wrong pairings of voice and lips agree as well" in doubt for doubt in doubts if doubt)


@pytest.mark.parametrize("still", ["audio", "lips"])
def test_silence_and_still_lips_have_no_delay(still):
    given = speaking(5, 0)
    quiet = np.broadcast_to(getattr(given, still)[0], getattr(given, still).shape).copy()
    assert delay.find(given._replace(**{still: quiet}), QUICK, 1).doubt == "voice or lips do not change"


def test_saying_the_same_phrases_again_does_not_narrow_the_interval():
    given = planted.population(4, True, speakers=6, repetitions=2, others=1, n_frames=(110, 130), nuisance=0.4)
    again = given.chosen(np.tile(np.arange(len(given.clips)), 2))
    once, twice = (delay.find(one, QUICK, seed=1) for one in (given, again))
    assert once.high_s - once.low_s > 0.001
    assert twice.high_s - twice.low_s == pytest.approx(once.high_s - once.low_s, rel=1e-6)


def test_a_delay_with_a_wide_interval_is_not_told():
    found = delay.find(speaking(5, 0), QUICK, 1)
    assert found.doubt is None
    assert "too uncertain, -40 to +70 ms" in found._replace(low_s=-0.04, high_s=0.07).doubt


def test_clips_that_are_too_short_have_no_delay():
    given = planted.population(1, True, speakers=2, repetitions=2, others=0)
    assert "there are only 0 pieces" in delay.find(given, QUICK, 1).doubt


def test_a_delay_beyond_the_longest_is_not_reported():
    found = delay.find(speaking(9, 12), QUICK._replace(longest_s=0.1), 1)
    assert "at least 0.10 s" in found.doubt


def test_shifting_pairs_voice_and_lips_as_the_delay_says():
    given = planted.population(2, True, speakers=2, repetitions=2, others=0)
    numbered = given._replace(
        audio=np.arange(len(given.audio))[:, None] * 1.0, lips=np.arange(len(given.lips))[:, None]
    )
    for shift in (-3, 0, 4):
        pairs = features.shifted(numbered, shift)
        np.testing.assert_array_equal(pairs.audio - pairs.lips, np.full(pairs.audio.shape, shift))
        assert (pairs.length == given.length - abs(shift)).all()
