"""Accents of planted features, and the partition of syllables."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.markov.mixture_hmm import Training
from cospeech.speech import accents

TRAINING = Training(5, 1e-3, 0.01)
SETTINGS = accents.Settings(states=3, gaussians=1, labelled=60)


def corpus(rng, height, n_records=6, per_record=40):
    """Features in which the pitch of accents is higher, and the labels of the syllables."""
    features, rows = [], []
    for number in range(n_records):
        label = rng.choice(["accent", "non_accent"], per_record)
        voiced = np.repeat(rng.random(per_record) > 0.15, 10)
        course = np.tile(np.hanning(12)[1:-1], per_record) * np.repeat(label == "accent", 10)
        record = f"r{number}"
        features.append(
            pd.DataFrame(
                {
                    "record": record,
                    "voiced": voiced,
                    "pitch": np.where(voiced, height * course, 3.0) + rng.normal(size=10 * per_record),
                    "intensity": np.where(voiced, 0.0, -5.0) + rng.normal(size=10 * per_record),
                }
            )
        )
        rows += [(record, n / 10, (n + 1) / 10, one) for n, one in enumerate(label)]
    return pd.concat(features), pd.DataFrame(rows, columns=["record", "start_s", "end_s", "label"])


def rates(height, seed=1):
    features, labelled = corpus(np.random.default_rng(seed), height)
    given = accents.syllables(labelled, features, n_accents=1000)
    found = np.array(accents.recognise(given, features, ("pitch", "intensity"), SETTINGS, TRAINING, 1))
    actual = np.array([segment.label for segment in given])
    return {label: np.mean(found[actual == label] == label) for label in set(actual)}


def test_clear_accents_are_recognised_and_absent_ones_are_at_chance():
    clear = rates(6.0)
    assert min(clear.values()) > 0.9
    none = rates(0.0)
    assert none["non_pitch"] > 0.9
    assert none["accent"] == pytest.approx(0.5, abs=0.15)
    assert none["accent"] + none["non_accent"] == pytest.approx(1.0, abs=0.2)


def test_the_labelled_portion_ends_with_the_last_accent_before_the_next():
    features, labelled = corpus(np.random.default_rng(2), 6.0)
    given = accents.syllables(labelled, features, n_accents=20)
    in_portion = labelled.iloc[: len(given)]["label"]
    assert (in_portion == "accent").sum() == 20
    assert labelled.iloc[len(given)]["label"] == "accent"


def test_a_portion_without_syllables_of_a_kind_is_refused():
    features, labelled = corpus(np.random.default_rng(3), 6.0)
    given = [one for one in accents.syllables(labelled, features, 1000) if one.label != "non_pitch"]
    with pytest.raises(UserError, match="no training segment of 'non_pitch' has 3 frames"):
        accents.recognise(given, features, ("pitch", "intensity"), SETTINGS, TRAINING, 1)


def test_features_of_a_sound_have_their_schema_and_find_its_pitch():
    rate_hz = 16000
    rng = np.random.default_rng(4)
    glide = 150.0 + 50.0 * np.linspace(0.0, 1.0, rate_hz)
    pulses = np.sign(np.diff(np.floor(np.cumsum(glide) / rate_hz), prepend=0.0))
    sound = np.concatenate([np.zeros(rate_hz // 2), 0.5 * pulses, np.zeros(rate_hz // 2)])
    table = accents.table("a", sound + 1e-4 * rng.standard_normal(len(sound)), rate_hz, 1)
    tables.validate(table, "accent_features", "x")
    voiced = table["voiced"].to_numpy()
    assert voiced[60:140].all()
    assert not voiced[:40].any()
    assert np.corrcoef(table["pitch"][60:140], np.arange(80))[0, 1] > 0.99
