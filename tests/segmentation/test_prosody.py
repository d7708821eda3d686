"""Planted intonation patterns are recovered; labels are stable, results reproducible, invalid input is rejected."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import adjusted_mutual_info_score

from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.markov import labelled_hmm
from cospeech.segmentation import prosody

SETTINGS = {"restarts": 3, "iterations": 30, "tolerance": 1e-5, "variance_floor": 0.01}
FRAME_S = 0.025

# Breakpoints of intensity and pitch lag (in ms), evenly spaced over a phrase; the first pattern is a pause.
PATTERNS = (
    ((-1.6, -1.6), None),
    ((-0.4, -0.4), (1.0, 1.0)),
    ((0.3, 0.8), (2.0, -2.0)),
    ((0.9, 0.2), (-2.0, 2.0)),
    ((1.3, 1.3), (-2.5, -2.5)),
)


def speak(rng, n_frames):
    """Return a prosody table and the planted pattern of each frame."""
    intensity, lag, gain, labels = [], [], [], []
    while len(labels) < n_frames:
        length, pattern = int(rng.integers(16, 64)), int(rng.integers(len(PATTERNS)))
        u = np.linspace(0, 1, length)
        loud, pitch = PATTERNS[pattern]
        intensity += list(np.interp(u, np.linspace(0, 1, len(loud)), loud))
        lag += list(
            rng.uniform(-4, 6, length) if pitch is None else np.interp(u, np.linspace(0, 1, len(pitch)), pitch)
        )
        gain += list(np.full(length, 0.1 if pitch is None else 0.75))
        labels += [pattern] * length
    values = np.array([intensity, lag, gain])[:, :n_frames] + rng.normal(0, [[0.2], [0.3], [0.06]], (3, n_frames))
    values[1] *= 1e-3
    steps = np.diff(values, axis=1, prepend=values[:, :1])
    table = pd.DataFrame(np.vstack([values, steps]).T, columns=list(prosody.FEATURES))
    return table, np.array(labels[:n_frames])


@pytest.fixture(scope="module")
def spoken():
    rng = np.random.default_rng(6)
    return [speak(rng, 2400) for _ in range(4)]


@pytest.fixture(scope="module")
def clusters(spoken):
    return prosody.train([table for table, _ in spoken[:3]], 5, 3, SETTINGS, 2012)


def test_patterns_are_recovered_in_an_unseen_record(spoken, clusters):
    table, planted = spoken[3]
    phrases = prosody.phrases(clusters.model, {"r3": table}, FRAME_S)
    segments.check(phrases, "r3")
    tables.validate(phrases, "segments", "r3")
    assert adjusted_mutual_info_score(planted, segments.to_labels(phrases)) > 0.5


def test_labels_are_sorted_by_intensity(spoken, clusters):
    assert clusters.model.labels == ("p1", "p2", "p3", "p4", "p5")
    table, _ = spoken[3]
    labels = segments.to_labels(prosody.phrases(clusters.model, {"r3": table}, FRAME_S))
    means = table["intensity"].groupby(labels).mean()
    assert means.sort_index().is_monotonic_increasing
    shuffled = clusters.model.hmm._make(values[[3, 1, 4, 0, 2]] for values in clusters.model.hmm)
    for one, other in zip(prosody.sort_branches(shuffled), clusters.model.hmm, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_training_history_is_complete(clusters):
    tables.validate(clusters.fit, "hmm_fit", "fit")
    last = clusters.fit.groupby("restart").tail(1)
    assert last["alpha"].notna().all()
    assert (last["beta"] > 0).all()
    assert last.loc[last["chosen"], "log_likelihood"].item() == last["log_likelihood"].max()
    assert "alpha" in prosody.summary(clusters.fit)
    for _, rows in clusters.fit.groupby("restart"):
        assert (np.diff(rows["log_likelihood"]) >= -1e-9 * rows["log_likelihood"].abs().max()).all()


def test_training_is_reproducible(spoken, clusters):
    again = prosody.train([table for table, _ in spoken[:3]], 5, 3, SETTINGS, 2012)
    pd.testing.assert_frame_equal(
        labelled_hmm.to_table(again.model), labelled_hmm.to_table(clusters.model), check_exact=True
    )
    other = prosody.train([table for table, _ in spoken[:3]], 5, 3, SETTINGS, 2013)
    assert not labelled_hmm.to_table(other.model).equals(labelled_hmm.to_table(clusters.model))


def test_silence_is_rejected(spoken):
    silent = spoken[0][0].assign(intensity=0.0, d_intensity=0.0)
    with pytest.raises(UserError, match="'intensity' never changes"):
        prosody.train([silent], 5, 3, SETTINGS, 1)
    # A silent record among others with speech is accepted.
    prosody.train([silent, spoken[1][0]], 2, 2, SETTINGS | {"restarts": 1, "iterations": 2}, 1)


def test_too_little_speech_is_rejected(spoken):
    with pytest.raises(UserError, match="too few"):
        prosody.train([spoken[0][0].iloc[:60]], 16, 9, SETTINGS, 1)
