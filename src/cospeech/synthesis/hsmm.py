"""The hidden semi-Markov model of Özkul 2012, chapter 5, as printed; other systems decode it in other ways."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from cospeech.data import segments
from cospeech.markov import hsmm
from cospeech.synthesis import System
from cospeech.synthesis.fold import Fold
from cospeech.synthesis.result import Synthesis, of_path
from cospeech.synthesis.speech import Speech

SYSTEM = System(
    name="hsmm",
    title="HSMM as printed",
    role="system",
    order=10,
    controls=("shuffled", "shifted"),
)


class Estimate(NamedTuple):
    """How a model is counted.

    labels : gesture classes that there are. clusters : prosody clusters that there are.
    max_duration_s : longest phrase, D_max of eq. 5.3. floor, smoothing, amount : see ``semi.estimate``.
    """

    labels: tuple[str, ...]
    clusters: int
    max_duration_s: float
    floor: float
    smoothing: hsmm.Smoothing
    amount: float


def counts(fold: Fold, how: Estimate) -> dict[str, hsmm.Counts]:
    """Return the counts of each training record of the fold."""
    n_bins = max(1, round(how.max_duration_s / fold.frame_s))
    names = segments.prosody_labels(how.clusters)
    return {
        record: hsmm.count(phrases, fold.speech[record], tuple(how.labels), names, n_bins)
        for record, phrases in fold.gestures.items()
    }


def train(counted: Iterable[hsmm.Counts], how: Estimate) -> hsmm.SemiMarkov:
    """Return the model of the records that were counted (Özkul 2012, eq. 5.5-5.8)."""
    first, *others = counted
    return hsmm.estimate(sum(others, start=first), how.floor, how.smoothing, how.amount)


def synthesise(
    model: hsmm.SemiMarkov, speech: Speech, weight: float = 1.0, censoring: hsmm.Censoring = "none"
) -> Synthesis:
    """Return the best path of ``model`` under ``speech`` (Özkul 2012, eq. 5.9 and Alg. 1, where ``weight`` is 1)."""
    return of_path(hsmm.decode(model, speech.labels, weight, censoring), speech, weight, censoring)
