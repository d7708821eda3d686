"""The strategies of Sargin 2006, tables 2.1 and 2.2: classifiers of single streams, and sums of their log-ratios.

Bayesian decision fusion, the product rule, adds the log-likelihood ratios rho (2.1) of the classifiers. The score of
a clip is that of the speaker with the greatest sum (2.2).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from cospeech.data.arrays import Floats, Integers
from cospeech.identity import classifiers, controls
from cospeech.identity.classifiers import Settings
from cospeech.identity.controls import Pairs
from cospeech.identity.features import Features
from cospeech.identity.sessions import Session
from cospeech.markov.word_hmm import WordHMMs

PLAIN = {
    "audio": ("audio",),
    "lips": ("lips",),
    "concatenated": ("concatenated",),
    "audio + lips": ("audio", "lips"),
    "audio + concatenated": ("audio", "concatenated"),
}
"""The strategies of table 2.2 that need no canonical correlations, and the classifiers whose log-ratios they add."""

CANONICAL = {
    "canonical": ("canonical",),
    "weak": ("weak",),
    "audio + canonical": ("audio", "canonical"),
    "audio + weak": ("audio", "weak"),
    "audio + lips + canonical": ("audio", "lips", "canonical"),
    "audio + lips + weak": ("audio", "lips", "weak"),
}
"""The fusion schemes of table 2.1: ``canonical`` concatenates the canonical components, ``weak`` is the sum of weak
classifiers, one for each pair of them."""

STREAMS = ("audio", "lips", "concatenated")
"""The classifiers that need no transform."""

ABREAST = 500
"""Number of clips that are scored at a time, which bounds the memory."""


class Dimension(NamedTuple):
    """A threshold of the canonical correlations, and the number of pairs above it."""

    threshold: float
    pairs: int


class Scored(NamedTuple):
    """The tested clips under one strategy: index of the best speaker, and the log-ratio of this one, (K,) each."""

    condition: str
    strategy: str
    dimension: Dimension | None
    best: Integers
    score: Floats


class Fusion(NamedTuple):
    """The classifiers of canonical components.

    Attributes
    ----------
    pairs : the transforms.
    wanted : the dimensions.
    concatenated : models of the concatenated components, by number of pairs.
    weak : models of each pair.
    """

    pairs: Pairs
    wanted: Sequence[Dimension]
    concatenated: Mapping[int, WordHMMs]
    weak: Sequence[WordHMMs]


def dimensions(correlations: Floats, thresholds: Iterable[float]) -> list[Dimension]:
    """Return the number of canonical correlations above each threshold; a threshold above all of them is left out."""
    counts = [Dimension(threshold, int((correlations > threshold).sum())) for threshold in thresholds]
    return [dimension for dimension in counts if dimension.pairs]


def stream(features: Features, name: str) -> Floats:
    """Return the frames (T, D) of one of ``STREAMS``."""
    if name == "concatenated":
        return np.concatenate([features.audio, features.lips], axis=1)
    return features.audio if name == "audio" else features.lips


def pair(components: tuple[Floats, Floats], index: int) -> Floats:
    """Return the frames (T, 2) of one pair of components (2.8)."""
    return np.stack([components[0][:, index], components[1][:, index]], axis=1)


def concatenation(components: tuple[Floats, Floats], n_pairs: int) -> Floats:
    """Return the frames (T, 2 M) of the first M pairs of components (2.7)."""
    return np.concatenate([components[0][:, :n_pairs], components[1][:, :n_pairs]], axis=1)


def train_plain(
    features: Features, owner: Integers, n_speakers: int, settings: Settings, names: Sequence[str] = STREAMS
) -> dict[str, WordHMMs]:
    """Return the models of some of ``STREAMS``; see ``classifiers.train``."""
    return {
        name: classifiers.train(features.stream(stream(features, name)), owner, n_speakers, settings)
        for name in names
    }


def train_fusion(
    features: Features,
    pairs: Pairs,
    wanted: Sequence[Dimension],
    owner: Integers,
    n_speakers: int,
    settings: Settings,
) -> Fusion:
    """Return the models of the canonical components at some dimensions.

    Parameters
    ----------
    features : of the training clips.
    pairs : the transforms.
    wanted : the dimensions.
    owner, n_speakers, settings : see ``classifiers.train``.
    """
    components = pairs.components(features)

    def trained(frames: Floats) -> WordHMMs:
        return classifiers.train(features.stream(frames), owner, n_speakers, settings)

    numbers = dict.fromkeys(dimension.pairs for dimension in wanted)
    return Fusion(
        pairs,
        wanted,
        {n: trained(concatenation(components, n)) for n in numbers},
        [trained(pair(components, index)) for index in range(max(numbers, default=0))],
    )


def plain_ratios(features: Features, models: Mapping[str, WordHMMs]) -> dict[str, Floats]:
    """Return the log-ratios (K, R) of all clips by each stream."""
    return {
        name: classifiers.log_ratios(own, features.stream(stream(features, name))) for name, own in models.items()
    }


def fusion_ratios(features: Features, fusion: Fusion) -> list[dict[str, Floats]]:
    """Return, for each dimension, the log-ratios (K, R) of all clips by ``canonical`` and ``weak``."""
    components = fusion.pairs.components(features)
    concatenated = {
        n: classifiers.log_ratios(models, features.stream(concatenation(components, n)))
        for n, models in fusion.concatenated.items()
    }
    sums: list[Floats] = []
    for index, models in enumerate(fusion.weak):
        own = classifiers.log_ratios(models, features.stream(pair(components, index)))
        sums.append(sums[-1] + own if sums else own)
    return [{"canonical": concatenated[one.pairs], "weak": sums[one.pairs - 1]} for one in fusion.wanted]


def product_rule(ratios: Mapping[str, Floats], names: Sequence[str]) -> Floats:
    """Return the sum of the log-ratios of some classifiers."""
    total = ratios[names[0]]
    for name in names[1:]:
        total = total + ratios[name]
    return total


def of_session(
    features: Features,
    session: Session,
    settings: Settings,
    thresholds: Sequence[float],
    conditions: Sequence[str],
    regularisation: float,
    seed: int,
) -> tuple[list[Scored], Floats]:
    """Return all strategies of a session under all conditions, and its canonical correlations.

    Parameters
    ----------
    features : of all clips, synchronised.
    session : what is trained on and tested.
    settings : of the word models.
    thresholds : of the canonical correlations.
    conditions : of ``controls``; ``PAIRED`` is always computed, and sets the dimensions of all others. One that lacks
        clips is left out.
    regularisation, seed : see ``controls.control``.

    Raises
    ------
    UserError : if a covariance matrix is singular, or a clip is too short.
    """
    with threadpool_limits(1, "blas"):  # sums must not depend on the number of cores
        training = features.chosen(session.train)
        n_speakers = len(session.speakers)
        pairs = controls.paired(features, session.train, regularisation)
        wanted = dimensions(pairs.correlations, thresholds)
        plain = train_plain(training, session.owner, n_speakers, settings)
        fusions = {controls.PAIRED: train_fusion(training, pairs, wanted, session.owner, n_speakers, settings)}
        for name in conditions:
            other = controls.control(features, session.train, name, regularisation, seed)
            if other is not None:
                fusions[name] = train_fusion(training, other, wanted, session.owner, n_speakers, settings)
        return scored(features, session.test, plain, fusions), pairs.correlations


def ceiling(
    features: Features, session: Session, settings: Settings, wanted: Sequence[Dimension], regularisation: float
) -> list[Scored]:
    """Return all strategies with everything trained on the tested clips of clients as well; see ``of_session``."""
    with threadpool_limits(1, "blas"):
        seen = with_tested(features, session)
        training, n_speakers = features.chosen(seen.train), len(seen.speakers)
        pairs = controls.paired(features, seen.train, regularisation)
        plain = train_plain(training, seen.owner, n_speakers, settings)
        fusion = train_fusion(training, pairs, wanted, seen.owner, n_speakers, settings)
        found = scored(features, seen.test, plain, {controls.PAIRED: fusion})
    return [one._replace(condition=controls.CEILING) for one in found]


def scored(
    features: Features, test: Integers, plain: Mapping[str, WordHMMs], fusions: Mapping[str, Fusion]
) -> list[Scored]:
    """Return the scores of the tested clips under all strategies, in a fixed order.

    Parameters
    ----------
    features : of all clips, synchronised.
    test : (K,) index of the tested clips.
    plain : models of all ``STREAMS``.
    fusions : models of canonical components by condition, ``PAIRED`` first.
    """
    parts: dict[tuple[str, str, Dimension | None], list[tuple[Integers, Floats]]] = {}
    for first in range(0, len(test), ABREAST):
        own = features.chosen(test[first : first + ABREAST])
        ratios = plain_ratios(own, plain)
        for strategy, names in PLAIN.items():
            parts.setdefault((controls.PAIRED, strategy, None), []).append(best(product_rule(ratios, names)))
        for condition, fusion in fusions.items():
            for dimension, by in zip(fusion.wanted, fusion_ratios(own, fusion), strict=True):
                for strategy, names in CANONICAL.items():
                    found = best(product_rule(ratios | by, names))
                    parts.setdefault((condition, strategy, dimension), []).append(found)
    return [
        Scored(*key, np.concatenate([speaker for speaker, _ in found]), np.concatenate([score for _, score in found]))
        for key, found in parts.items()
    ]


def best(log_ratios: Floats) -> tuple[Integers, Floats]:
    """Return the index of the best speaker of each clip (2.2), and its log-ratio, (K,) each."""
    found = log_ratios.argmax(axis=1)
    return found, log_ratios[np.arange(len(found)), found]


def trials(features: Features, session: Session, one: Scored) -> pd.DataFrame:
    """Return the rows of the table ``trials`` of one strategy."""
    clips = features.clips.iloc[session.test]
    dimension = one.dimension
    return pd.DataFrame(
        {
            "session": session.name,
            "condition": one.condition,
            "strategy": one.strategy,
            "threshold": np.nan if dimension is None else dimension.threshold,
            "dimension": pd.array([None if dimension is None else dimension.pairs] * len(clips), dtype="Int64"),
            "trial": clips["clip"].to_numpy(),
            "speaker": clips["speaker"].where(clips["own_name"], None).to_numpy(),
            "best_speaker": np.array(session.speakers, dtype=object)[one.best],
            "score": one.score,
        }
    )


def with_tested(features: Features, session: Session) -> Session:
    """Return the session with the tested clips of clients among those that are trained on, which makes a ceiling."""
    tested = session.test[features.clips["own_name"].to_numpy(dtype=bool)[session.test]]
    place = {name: index for index, name in enumerate(session.speakers)}
    owner = features.clips["speaker"].iloc[tested].map(place).to_numpy(dtype=np.int64)
    return session._replace(
        train=np.concatenate([session.train, tested]), owner=np.concatenate([session.owner, owner])
    )
