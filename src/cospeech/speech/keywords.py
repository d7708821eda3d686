"""Keywords in speech: a network of word HMMs with models of silence and of other words (Sargin 2006, 3.2.2).

Five models of mel-frequency cepstral coefficients stand for three keywords, silence, and *garbage*, which is any
other word. The most likely path through their network says where keywords are.

The document does not state the numbers of states. The number of Gaussians is chosen here on a part of the training
records, and not on those that are tested.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.markov import spotting
from cospeech.markov.mixture_hmm import Training
from cospeech.markov.spotting import Segment, Size, Spotter
from cospeech.speech.mfcc import RATE_HZ

SILENCE, GARBAGE = "silence", "garbage"
SHORTEST_SILENCE_S = 0.1
"""Shortest pause between words on which the model of silence is trained."""


@dataclass(frozen=True)
class Settings:
    """The section ``directions.keywords`` of a configuration.

    Attributes
    ----------
    words : the keywords.
    states, other_states : number of states of a keyword's model, and of those of silence and garbage.
    gaussians : numbers of Gaussians per state that are tried.
    """

    words: list[str]
    states: int
    other_states: int
    gaussians: list[int]

    def sizes(self, gaussians: int) -> dict[str, Size]:
        """Return the size of each model."""
        own = dict.fromkeys(self.words, Size(self.states, gaussians))
        return own | dict.fromkeys((SILENCE, GARBAGE), Size(self.other_states, gaussians))


def normalised(coefficients: Floats) -> Floats:
    """Return the coefficients (T, D) of a record with mean 0 and standard deviation 1."""
    return np.asarray((coefficients - coefficients.mean(axis=0)) / coefficients.std(axis=0))


def segments(words: pd.DataFrame, recordings: Mapping[str, Floats], keywords: Sequence[str]) -> list[Segment]:
    """Return the words of recordings as keywords and garbage, and the pauses between them.

    Parameters
    ----------
    words : record, start_s, end_s and label of each word, in order.
    recordings : (T, D) frames of the recordings that are wanted.
    """
    found = []
    for record, own in words[words["record"].isin(recordings.keys())].groupby("record", sort=False):
        bounds = np.round(own[["start_s", "end_s"]].to_numpy() * RATE_HZ).astype(int)
        spoken = [
            Segment(str(record), int(first), int(end), label if label in keywords else GARBAGE)
            for (first, end), label in zip(bounds, own["label"], strict=True)
        ]
        shortest = round(SHORTEST_SILENCE_S * RATE_HZ)
        found += spoken
        found += spotting.between(str(record), spoken, len(recordings[str(record)]), shortest, SILENCE)
    return found


def spotter(
    recordings: Mapping[str, Floats],
    words: pd.DataFrame,
    settings: Settings,
    gaussians: int,
    training: Training,
    seed: int,
) -> Spotter:
    """Return the network of models that is trained on recordings and their words.

    Raises
    ------
    UserError : if a keyword does not occur in the recordings.
    """
    given = segments(words, recordings, settings.words)
    rng = random_source(seed, "keywords", str(gaussians))
    return spotting.train(recordings, given, settings.sizes(gaussians), training, rng)


def spots(network: Spotter, recordings: Mapping[str, Floats]) -> pd.DataFrame:
    """Return the keywords that a network finds: record, start_s, end_s, label."""
    found = [segment for record, frames in recordings.items() for segment in network.spot(record, frames)]
    return pd.DataFrame(
        [
            (one.recording, one.first / RATE_HZ, one.end / RATE_HZ, one.label)
            for one in found
            if one.label not in (SILENCE, GARBAGE)
        ],
        columns=["record", "start_s", "end_s", "label"],
    )
