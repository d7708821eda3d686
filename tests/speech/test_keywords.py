"""Keyword spotting in planted features, and the segments that models are trained on."""

import numpy as np
import pandas as pd

from cospeech.markov.mixture_hmm import Training
from cospeech.speech import keywords

SETTINGS = keywords.Settings(words=["left", "right"], states=3, other_states=1, gaussians=[1, 2])
SHAPES = {"left": (3.0, -3.0, 0.0), "right": (-3.0, 3.0, 0.0), "bank": (0.0, 0.0, 3.0), None: (0.0, 0.0, -3.0)}
"""What the frames of a word are around; keywords move from the first to the second feature."""


def recording(rng, record, n_words):
    frames, rows, length = [], [], 0
    for _ in range(n_words):
        word = rng.choice(["left", "right", "bank"])
        for label, number in ((None, int(rng.integers(12, 25))), (str(word), int(rng.integers(18, 30)))):
            shape = np.tile(SHAPES[label], (number, 1))
            if label in ("left", "right"):
                shape[:, :2] *= np.linspace(1.0, -1.0, number)[:, None]
            frames.append(shape + rng.normal(size=shape.shape))
            if label:
                rows.append((record, length / 100, (length + number) / 100, label))
            length += number
    return np.concatenate(frames), pd.DataFrame(rows, columns=["record", "start_s", "end_s", "label"])


def corpus(seed, n_records):
    rng = np.random.default_rng(seed)
    made = {f"r{seed}_{n}": recording(rng, f"r{seed}_{n}", 20) for n in range(n_records)}
    return {name: frames for name, (frames, _) in made.items()}, pd.concat([words for _, words in made.values()])


def test_planted_keywords_are_found_with_their_times():
    frames, words = corpus(1, 6)
    network = keywords.spotter(frames, words, SETTINGS, 2, Training(8, 1e-3, 0.01), 1)
    tested, said = corpus(2, 3)
    found = keywords.spots(network, tested)
    asked = said[said["label"] != "bank"].reset_index(drop=True)
    assert found[["record", "label"]].equals(asked[["record", "label"]])
    assert np.abs(found[["start_s", "end_s"]].to_numpy() - asked[["start_s", "end_s"]].to_numpy()).max() <= 0.05


def test_segments_cover_words_and_long_pauses():
    words = pd.DataFrame(
        [("a", 0.2, 0.5, "left"), ("a", 0.55, 0.8, "bank"), ("b", 0.0, 0.3, "right")],
        columns=["record", "start_s", "end_s", "label"],
    )
    found = keywords.segments(words, {"a": np.zeros((100, 1))}, ["left", "right"])
    assert [tuple(segment) for segment in found] == [
        ("a", 20, 50, "left"),
        ("a", 55, 80, "garbage"),
        ("a", 0, 20, "silence"),
        ("a", 80, 100, "silence"),
    ]


def test_a_recording_without_keywords_has_no_spots():
    frames, words = corpus(1, 6)
    network = keywords.spotter(frames, words, SETTINGS, 1, Training(8, 1e-3, 0.01), 1)
    silence = np.tile(SHAPES[None], (200, 1)) + np.random.default_rng(3).normal(size=(200, 3))
    found = keywords.spots(network, {"x": silence})
    assert found.empty
    assert list(found.columns) == ["record", "start_s", "end_s", "label"]
