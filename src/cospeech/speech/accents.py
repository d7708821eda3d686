"""Pitch accents from pitch, intensity and formants by HMMs of syllables (Sargin 2006, 3.2.1 and 3.2.3).

Three left-to-right models stand for accented syllables, for syllables without an accent, and for those whose pitch
cannot be extracted. A syllable belongs to the one under which it is most likely.

Readings of the text:

- A syllable has no pitch if fewer than ``LEAST_VOICED`` of its frames are voiced.
- The formants are those of Burg's method, whose roots replace the peaks of the spectrum. They are logarithmic and
  normalised, as pitch and intensity are, and interpolated where one is missing.
- Five partitions of the labelled syllables, in the order of time, are tested in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.markov import spotting
from cospeech.markov.mixture_hmm import Training
from cospeech.markov.spotting import Segment, Size
from cospeech.speech import formants, melody, pitch
from cospeech.speech.melody import STEP_S

FEATURES = {
    "Δf, p, I": ("d_f1", "d_f2", "d_f3", "pitch", "intensity"),
    "f, p, I": ("f1", "f2", "f3", "pitch", "intensity"),
    "p, I": ("pitch", "intensity"),
}
"""The sets of features of table 3.1, as columns of the table ``accent_features``."""

ACCENT, NON_ACCENT, NON_PITCH = "accent", "non_accent", "non_pitch"
LEAST_VOICED = 0.4
PARTITIONS = 5
N_FORMANTS = 3


@dataclass(frozen=True)
class Settings:
    """The section ``directions.accents`` of a configuration.

    Attributes
    ----------
    states, gaussians : size of each model.
    labelled : number of accents in the labelled portion of the document.
    """

    states: int
    gaussians: int
    labelled: int


def table(record: str, samples: Floats, rate_hz: int, seed: int) -> pd.DataFrame:
    """Return the features of a record (schema ``accent_features``).

    Parameters
    ----------
    samples : (n,) sound, full scale 1.

    Raises
    ------
    UserError : if the record has no utterance.
    """
    f0_hz = pitch.track(samples, rate_hz).f0_hz
    heard = melody.table(record, f0_hz, melody.intensity(samples, rate_hz), seed)
    resonances = _normalised(formants.find(samples, rate_hz)[: len(heard), :N_FORMANTS])
    found = heard[["frame", "time_s", "pitch", "intensity"]].assign(record=record, voiced=~np.isnan(f0_hz))
    for number, values in enumerate(resonances.T, start=1):
        found[f"f{number}"] = values
        found[f"d_f{number}"] = melody.slope(values)
    return found


def _normalised(formants_hz: Floats) -> Floats:
    """Return formants (T, N) as logarithms without gaps, of mean 0 and standard deviation 1."""
    frames = np.arange(len(formants_hz))
    whole = np.column_stack(
        [np.interp(frames, frames[~np.isnan(values)], np.log(values[~np.isnan(values)])) for values in formants_hz.T]
    )
    return np.asarray((whole - whole.mean(axis=0)) / whole.std(axis=0))


def syllables(labelled: pd.DataFrame, features: pd.DataFrame, n_accents: int) -> list[Segment]:
    """Return the syllables up to the given number of accents, in order; those without pitch have a label of their
    own.

    Parameters
    ----------
    labelled : record, start_s, end_s and label of each syllable.
    features : the table ``accent_features`` of all records.
    """
    voiced = {record: own["voiced"].to_numpy() for record, own in features.groupby("record", sort=False)}
    portion = labelled[(labelled["label"] == ACCENT).cumsum() <= n_accents]
    found = []
    for record, start_s, end_s, label in portion[["record", "start_s", "end_s", "label"]].itertuples(index=False):
        first, end = round(start_s / STEP_S), min(round(end_s / STEP_S), len(voiced[record]))
        has_pitch = voiced[record][first:end].mean() >= LEAST_VOICED
        found.append(Segment(record, first, end, label if has_pitch else NON_PITCH))
    return found


def recognise(
    given: Sequence[Segment],
    features: pd.DataFrame,
    columns: Sequence[str],
    settings: Settings,
    training: Training,
    seed: int,
) -> list[str]:
    """Return the label that each syllable is given by models of the other four fifths of the syllables.

    Raises
    ------
    UserError : if a label has no syllable that is long enough.
    """
    recordings = {
        str(record): np.ascontiguousarray(own[list(columns)].to_numpy())
        for record, own in features.groupby("record", sort=False)
    }
    partition = np.arange(len(given)) * PARTITIONS // len(given)
    sizes = dict.fromkeys((ACCENT, NON_ACCENT, NON_PITCH), Size(settings.states, settings.gaussians))
    found = []
    for tested in range(PARTITIONS):
        others = [segment for segment, part in zip(given, partition, strict=True) if part != tested]
        rng = random_source(seed, "accents", *columns, str(tested))
        models = spotting.train(recordings, others, sizes, training, rng)
        found += [
            models.classify(recordings[segment.recording][segment.first : segment.end])
            for segment, part in zip(given, partition, strict=True)
            if part == tested
        ]
    return found
