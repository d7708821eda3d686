"""Coefficients and word models of read sentences, 25 s of one reader: they run, which is all that so little can show.

Identification needs speakers who say the same phrase several times. Here one reader says some words two or three
times, so that no error rate of speakers can be stated, and the share of words that are recognised has a standard
error of a tenth.
"""

import json
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from cospeech.formats import sound
from cospeech.identity import classifiers
from cospeech.identity.classifiers import Settings
from cospeech.markov import word_hmm
from cospeech.markov.word_hmm import Clips
from cospeech.speech import mfcc

LIBRIVOX = Path(__file__).parents[3] / "shared/data/librivox"
SETTINGS = Settings(states=3, iterations=10, variance_floor=0.3)


@pytest.fixture(scope="module")
def words():
    """The coefficients (T, 39) of each time that a word is said which is said twice or more."""
    found = defaultdict(list)
    for path in sorted(LIBRIVOX.glob("*.wav")):
        frames = mfcc.coefficients(sound.read(path).samples, sound.RATE_HZ)
        for word in json.loads(path.with_suffix(".phone.json").read_text(encoding="utf-8"))["w"]:
            first, last = round(100 * word["b"]), round(100 * (word["b"] + word["d"]))
            name = re.sub(r"\(\d+\)", "", word["t"])
            if name.isalpha() and last - first >= SETTINGS.states:
                found[name].append(frames[first:last])
    return {name: said for name, said in found.items() if len(said) > 1}


def clips(parts):
    length = np.array([len(part) for part in parts])
    return Clips(np.concatenate(parts), np.cumsum(length) - length, length)


pytestmark = [
    pytest.mark.recorded,
    pytest.mark.skipif(not LIBRIVOX.is_dir(), reason="needs the real recordings in ../shared/data/librivox"),
]


def test_words_that_were_left_out_are_recognised_more_often_than_by_chance(words):
    right, n = 0, sum(len(said) for said in words.values())
    for number, (name, said) in enumerate(words.items()):
        for left_out in range(len(said)):
            training = [
                (owner, frames)
                for owner, (other, own) in enumerate(words.items())
                for place, frames in enumerate(own)
                if (other, place) != (name, left_out)
            ]
            owner = np.array([index for index, _ in training])
            models = classifiers.train(clips([frames for _, frames in training]), owner, len(words), SETTINGS)
            right += int(classifiers.log_ratios(models, clips([said[left_out]]))[0].argmax() == number)
    assert len(words) > 10
    assert right / n > 0.3


def test_the_likelihood_of_each_word_rises_with_every_iteration(words):
    own = clips([frames for said in words.values() for frames in said])
    owner = np.repeat(np.arange(len(words)), [len(said) for said in words.values()])
    floor = 0.1 * own.frames.var(axis=0)
    begun = word_hmm.start(own, owner, len(words), SETTINGS.states, floor)
    history = word_hmm.fit(begun, own, owner, floor, 10).log_likelihoods
    assert (np.diff(history, axis=0) > -1e-6 * np.abs(history[1:])).all()
    assert history[-1].sum() > history[0].sum()
