"""The model that the HSMM systems share: counted probabilities, and a weight of the emissions.

The printed decoder counts a prosody label once per frame although the label holds for a whole intonation phrase, and
therefore cuts gestures into pieces. An exponent of the emissions (Sargin 2006, eq. 4.18) corrects this.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Labels
from cospeech.markov import hsmm
from cospeech.markov.hsmm import HSMM, Censoring, Counts, Smoothing
from cospeech.synthesis.hsmm import tables as hsmm_tables
from cospeech.synthesis.hsmm.agreement import agreements
from cospeech.synthesis.interface import Speech, Synthesis, Training, decoding, phrases_of

INNER_FOLDS = 4
"""Maximum number of models that are trained to choose an emission weight."""


class Estimate(NamedTuple):
    """How probabilities are counted.

    Attributes
    ----------
    max_duration_s : longest phrase, D_max of eq. 5.3.
    floor, smoothing, amount : see ``markov.hsmm.estimate``.
    """

    max_duration_s: float
    floor: float
    smoothing: Smoothing
    amount: float


class Model(NamedTuple):
    """A trained model.

    Attributes
    ----------
    hsmm : the semi-Markov model. frame_s : length of its frames in seconds. floor : the floor of its probabilities.
    weight : the emission weight chosen inside the training records.
    censoring : whether the end of a record may cut the last phrase.
    """

    hsmm: HSMM
    frame_s: float
    floor: float
    weight: float
    censoring: Censoring


def estimate_of(settings: Mapping[str, Any]) -> Estimate:
    """Return how probabilities are counted under the section ``synthesis`` of the configuration."""
    durations = settings["durations"]
    return Estimate(settings["max_duration_s"], settings["floor"], durations["smoothing"], durations["amount"])


def train(training: Training, settings: Mapping[str, Any]) -> Model:
    """Return the model of the training records (Özkul 2012, eq. 5.5-5.8), with its emission weight.

    Parameters
    ----------
    settings : the section ``synthesis`` of the configuration.
    """
    how = estimate_of(settings)
    counted = counts(training, how)
    learnt = estimate(counted.values(), how)
    censoring: Censoring = settings["censoring"]
    weight = choose_weight(training, counted, how, settings["emission_weights"], censoring)
    return Model(learnt, training.frame_s, how.floor, weight, censoring)


def counts(training: Training, how: Estimate) -> dict[str, Counts]:
    """Return the counts of each training record."""
    n_bins = max(1, round(how.max_duration_s / training.frame_s))
    return {
        record: hsmm.count(phrases, training.speech[record], training.labels, training.symbols, n_bins)
        for record, phrases in training.gestures.items()
    }


def estimate(counted: Iterable[Counts], how: Estimate) -> HSMM:
    """Return the probabilities of the records that were counted."""
    first, *others = counted
    return hsmm.estimate(sum(others, start=first), how.floor, how.smoothing, how.amount)


def choose_weight(
    training: Training,
    counted: Mapping[str, Counts],
    how: Estimate,
    weights: Sequence[float],
    censoring: Censoring,
) -> float:
    """Return the emission weight that works best on the training records if each is held out in turn.

    The criterion is the mean of ``agreements`` over the training records: kappa of the frames minus the boundary
    distance in mean phrases. Among equals, the largest weight is chosen, which is nearest to the printed model. A
    single training record cannot be held out; the largest weight is returned then.
    """
    names = list(training.gestures)
    if len(names) < 2:
        return max(weights)
    groups = [names[first::INNER_FOLDS] for first in range(min(INNER_FOLDS, len(names)))]
    model_of = {}
    for held_out in groups:
        model = estimate([own for name, own in counted.items() if name not in held_out], how)
        model_of.update(dict.fromkeys(held_out, model))
    return best_weight(training.gestures, training.speech, model_of, weights, censoring)


def best_weight(
    gestures: Mapping[str, pd.DataFrame],
    speech: Mapping[str, Labels],
    model_of: Mapping[str, HSMM],
    weights: Sequence[float],
    censoring: Censoring,
) -> float:
    """Return the weight with the best mean agreement over the records of ``gestures``, each under its own model."""
    choices = sorted(weights, reverse=True)
    found = [
        agreements(actual, hsmm.decode_each(model_of[name], speech[name], choices, censoring))
        for name, actual in gestures.items()
    ]
    means = [float(np.mean(of_weight)) for of_weight in zip(*found, strict=True)]
    return choices[int(np.argmax(means))]


def synthesis(path: hsmm.Path, speech: Speech, weight: float, censoring: Censoring) -> Synthesis:
    """Return the phrases of a path through a model that was driven by ``speech``."""
    row = decoding(
        speech,
        log_score=path.log_score,
        emission_weight=float(weight),
        censoring=censoring,
        driving_record=speech.driving_record,
        shift_s=speech.shift_s,
    )
    return Synthesis(row, phrases_of(speech, path.starts, path.labels))


def to_tables(model: Model) -> dict[str, pd.DataFrame]:
    """Return the tables initial, transitions, emissions, durations and decoder."""
    decoder = {"emission_weight": [model.weight], "censoring": [model.censoring], "frame_s": [model.frame_s]}
    return hsmm_tables.to_tables(model.hsmm, model.frame_s, model.floor) | {"decoder": pd.DataFrame(decoder)}


def from_tables(tables: Mapping[str, pd.DataFrame]) -> Model:
    """Return the model of ``to_tables``."""
    row = tables["decoder"].iloc[0]
    floor = float(tables["initial"]["floor"].iloc[0])
    return Model(
        hsmm_tables.from_tables(tables), float(row["frame_s"]), floor, float(row["emission_weight"]), row["censoring"]
    )
