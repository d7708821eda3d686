"""Enrolment of speakers, and identification of new clips with a threshold (Sargin 2006, 2.1 and 2.3.2).

The scheme is the one that the document proposes: the classifier of the voice, and weak classifiers of all pairs of
canonical components, by the product rule. The threshold is set by clips of impostors, which no model is trained on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.identity import classifiers, controls, features, sessions, strategies
from cospeech.identity.classifiers import Settings
from cospeech.identity.controls import Affine, Pairs
from cospeech.identity.features import Features
from cospeech.identity.sessions import Session
from cospeech.markov.word_hmm import WordHMMs
from cospeech.metrics import equal_error
from cospeech.metrics.equal_error import Trials

WORLD = "world"
"""What the world model is called in the table of models."""

TABLES = ("identity_speakers", "identity_models", "identity_transform", "identity_impostors")
"""The tables of a model, named as their schemas."""


class Model(NamedTuple):
    """Enrolled speakers.

    Attributes
    ----------
    speakers : their names, in the order of the models.
    phrases : what each of them says.
    shift : by how many frames the voice lags behind the lips.
    pairs : the canonical transform.
    audio : models of the voice; the world model is the last one.
    weak : models of each pair of canonical components.
    impostors : (n,) scores of the clips of impostors, from which thresholds are read.
    """

    speakers: list[str]
    phrases: list[str]
    shift: int
    pairs: Pairs
    audio: WordHMMs
    weak: list[WordHMMs]
    impostors: Floats


class Identification(NamedTuple):
    """The speaker whose model fits best, the log-ratio of it, and whether it is accepted."""

    speaker: str
    score: float
    accepted: bool


def enrol(given: Features, shift: int, settings: Settings, regularisation: float) -> Model:
    """Return a model of the speakers with two repetitions of their own name or more.

    Parameters
    ----------
    given : features of all clips, not synchronised. Clips of other names are those of impostors.
    shift : by how many frames the voice lags behind the lips.
    settings : of the word models.
    regularisation : of the canonical correlation analysis.

    Raises
    ------
    UserError : if fewer than two speakers can be enrolled, no clip is that of an impostor, a clip is too short, or a
        covariance matrix is singular.
    """
    own = features.shifted(given, shift)
    if own.clips["own_name"].all():
        raise UserError(
            "no clip is that of an impostor, without whom no threshold can be set; add clips in which speakers say "
            "the phrases of others"
        )
    with threadpool_limits(1, "blas"):  # sums must not depend on the number of cores
        whole = sessions.of_all(own.clips)
        pairs, audio, weak = _train(own, whole, settings, regularisation)
        _, impostors = strategies.best(_log_ratios(own.chosen(whole.test), pairs, audio, weak))
    phrase = own.clips[own.clips["own_name"]].drop_duplicates("speaker").set_index("speaker")["phrase"]
    said = [str(phrase[name]) for name in whole.speakers]
    return Model(whole.speakers, said, shift, pairs, audio, weak, impostors)


def _train(
    own: Features, session: Session, settings: Settings, regularisation: float
) -> tuple[Pairs, WordHMMs, list[WordHMMs]]:
    training, n_speakers = own.chosen(session.train), len(session.speakers)
    pairs = controls.paired(own, session.train, regularisation)
    components = pairs.components(training)
    streams = [training.audio, *(strategies.pair(components, index) for index in range(len(pairs.correlations)))]
    audio, *weak = (
        classifiers.train(training.stream(frames), session.owner, n_speakers, settings) for frames in streams
    )
    return pairs, audio, weak


def _log_ratios(own: Features, pairs: Pairs, audio: WordHMMs, weak: list[WordHMMs]) -> Floats:
    """Return the sum of the log-ratios of all classifiers, (K, R)."""
    total = classifiers.log_ratios(audio, own.stream(own.audio))
    components = pairs.components(own)
    for index, models in enumerate(weak):
        total = total + classifiers.log_ratios(models, own.stream(strategies.pair(components, index)))
    return total


def threshold(model: Model, false_accept: float) -> float:
    """Return the threshold at which at most this share of impostors is accepted, 0 to 1.

    Raises
    ------
    UserError : if the trials of impostors are too few to tell such a rate.
    """
    n = len(model.impostors)
    if false_accept * n < 1.0 - 1e-9:
        raise UserError(
            f"a false-accept rate of {100 * false_accept:g} % cannot be reached with {n} trials of impostors; "
            f"choose {100 / n:.2g} % or more, or enrol with more clips of impostors"
        )
    nobody = np.zeros(n, dtype=bool)
    return equal_error.threshold_at(Trials(model.impostors, nobody, nobody), "usual", false_accept)


def identify(model: Model, given: Features, at_least: float) -> list[Identification]:
    """Return who speaks in each clip.

    Parameters
    ----------
    given : features of the clips, not synchronised.
    at_least : the score at which a speaker is accepted.

    Raises
    ------
    UserError : if a clip has fewer frames than a model has states.
    """
    with threadpool_limits(1, "blas"):
        ratios = _log_ratios(features.shifted(given, model.shift), model.pairs, model.audio, model.weak)
    best, score = strategies.best(ratios)
    return [
        Identification(model.speakers[index], float(value), bool(value >= at_least))
        for index, value in zip(best, score, strict=True)
    ]


def to_tables(model: Model) -> dict[str, pd.DataFrame]:
    """Return a model as ``TABLES``, by name."""
    names = [*model.speakers, WORLD]
    parts = [("audio", 0, model.audio), *(("weak", index + 1, own) for index, own in enumerate(model.weak))]
    rows = [
        (kind, number, speaker, name, state + 1, feature + 1, own.stay[speaker, state],
         own.mean[speaker, state, feature], own.variance[speaker, state, feature])
        for kind, number, own in parts
        for speaker, name in enumerate(names)
        for state in range(own.stay.shape[1])
        for feature in range(own.mean.shape[2])
    ]  # fmt: skip
    columns = ["classifier", "pair", "number", "speaker", "state", "feature", "stay_probability", "mean", "variance"]
    bases = [("audio", model.pairs.first), ("lips", model.pairs.second)]
    transform = [
        (side, pair + 1, feature + 1, own.mean[feature], own.basis[pair, feature], model.pairs.correlations[pair])
        for side, own in bases
        for pair in range(len(own.basis))
        for feature in range(len(own.mean))
    ]
    return {
        "identity_speakers": pd.DataFrame(
            {
                "number": range(len(names) - 1),
                "speaker": model.speakers,
                "phrase": model.phrases,
                "shift": model.shift,
            }
        ),
        "identity_models": pd.DataFrame(rows, columns=columns),
        "identity_transform": pd.DataFrame(
            transform, columns=["side", "pair", "feature", "mean", "weight", "correlation"]
        ),
        "identity_impostors": pd.DataFrame({"trial": range(len(model.impostors)), "score": model.impostors}),
    }


def from_tables(tables: dict[str, pd.DataFrame]) -> Model:
    """Return the model of tables that ``to_tables`` returned."""
    speakers, impostors = tables["identity_speakers"], tables["identity_impostors"]
    transform, models = tables["identity_transform"], tables["identity_models"]
    sides = {str(side): own for side, own in transform.groupby("side")}
    first, second = (_affine(sides[side]) for side in ("audio", "lips"))
    correlations = sides["audio"].drop_duplicates("pair")["correlation"].to_numpy()
    found = {pair: _models(models[models["pair"] == pair]) for pair in models["pair"].unique().tolist()}
    return Model(
        [str(name) for name in speakers["speaker"]],
        [str(name) for name in speakers["phrase"]],
        int(speakers["shift"].iloc[0]),
        Pairs(first, second, False, correlations),
        found[0],
        [found[pair] for pair in sorted(found) if pair],
        impostors["score"].to_numpy(dtype=float),
    )


def _affine(rows: pd.DataFrame) -> Affine:
    shape = (int(rows["pair"].max()), int(rows["feature"].max()))
    mean, weight = (rows[name].to_numpy(dtype=float).reshape(shape) for name in ("mean", "weight"))
    return Affine(mean[0], weight)


def _models(rows: pd.DataFrame) -> WordHMMs:
    shape = (int(rows["number"].max()) + 1, int(rows["state"].max()), int(rows["feature"].max()))
    stay, mean, variance = (
        rows[name].to_numpy(dtype=float).reshape(shape) for name in ("stay_probability", "mean", "variance")
    )
    return WordHMMs(np.ascontiguousarray(stay[:, :, 0]), mean, variance)
