"""The gesture class that most often goes with a prosody label, as soon as the label changes."""

from collections import Counter

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.synthesis.interface import Synthesis, decoding, phrases_of


def train(training, settings):
    """Return the most frequent gesture class of each prosody label, and the shortest phrase in seconds."""
    counts = {symbol: Counter() for symbol in training.symbols}
    for record, phrases in training.gestures.items():
        for symbol, gesture in zip(training.speech[record], segments.to_labels(phrases), strict=True):
            counts[symbol][gesture] += 1
    overall = sum(counts.values(), Counter())
    habits = {symbol: (own or overall).most_common(1)[0][0] for symbol, own in counts.items()}
    return habits, settings["shortest_s"]


def synthesise(model, speech, seed):
    """Return a phrase for every change of the habitual gesture; a phrase shorter than allowed is prolonged."""
    habits, shortest_s = model
    gestures = np.array([habits[symbol] for symbol in speech.labels], dtype=object)
    starts = [0]
    for frame in np.flatnonzero(gestures[1:] != gestures[:-1]) + 1:
        if (frame - starts[-1]) * speech.frame_s >= shortest_s:
            starts.append(int(frame))
    row = decoding(speech, driving_record=speech.driving_record, shift_s=speech.shift_s)
    return Synthesis(row, phrases=phrases_of(speech, starts, gestures[starts]))


def to_tables(model):
    """Return the habits, and the shortest phrase."""
    habits, shortest_s = model
    return {
        "habits": pd.DataFrame({"prosody": list(habits), "gesture": list(habits.values())}),
        "timing": pd.DataFrame({"shortest_s": [shortest_s]}),
    }


def from_tables(tables):
    """Return the model of ``to_tables``."""
    habits = dict(zip(tables["habits"]["prosody"], tables["habits"]["gesture"], strict=True))
    return habits, float(tables["timing"]["shortest_s"].iloc[0])
