"""The HSMM with an emission weight (Sargin 2006, the exponents of eq. 4.18) chosen inside the training records.

The printed decoder counts a prosody label once a frame although it holds for a whole intonation phrase, and so cuts
gestures into pieces. The model, and so its tables, are those of ``hsmm``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cospeech.markov import hsmm
from cospeech.synthesis import System
from cospeech.synthesis.agreement import agreements
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.hsmm import Estimate, train

SYSTEM = System(
    name="hsmm_weighted",
    title="HSMM, emissions weighted",
    role="system",
    order=20,
)

INNER_FOLDS = 4
"""At most so many models are trained to choose a weight."""


def choose_weight(
    fold: Fold,
    counted: Mapping[str, hsmm.Counts],
    how: Estimate,
    weights: Sequence[float],
    censoring: hsmm.Censoring,
) -> float:
    """Return the emission weight that serves the training records best when each is held out in its turn.

    Parameters
    ----------
    counted : counts of every training record. how : how models are counted.
    weights : to choose from.

    Notes
    -----
    The criterion is the mean of ``agreements`` over the training records: kappa of the frames less the boundary
    distance in mean phrases. Among equals the largest weight wins, the nearest to the printed model; so it does where
    there is one training record and nothing to choose by.
    """
    names = list(fold.gestures)
    if len(names) < 2:
        return max(weights)
    groups = [names[first::INNER_FOLDS] for first in range(min(INNER_FOLDS, len(names)))]
    model_of = {}
    for held_out in groups:
        model = train([counts for name, counts in counted.items() if name not in held_out], how)
        model_of.update(dict.fromkeys(held_out, model))
    return best_weight(fold, model_of, weights, censoring)


def best_weight(
    fold: Fold,
    model_of: Mapping[str, hsmm.SemiMarkov],
    weights: Sequence[float],
    censoring: hsmm.Censoring,
) -> float:
    """Return the weight with the best mean agreement, ``model_of`` each training record being its model."""

    choices = sorted(weights, reverse=True)
    found = [
        agreements(actual, hsmm.decode_each(model_of[name], fold.speech[name], choices, censoring))
        for name, actual in fold.gestures.items()
    ]
    means = [float(np.mean(of_weight)) for of_weight in zip(*found, strict=True)]
    return choices[int(np.argmax(means))]
