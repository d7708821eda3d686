"""Stage I: elementary patterns of the head and of the melody, each by a parallel HMM (Sargin 2006, 4.2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.markov import parallel, parallel_start
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.markov.parallel import ParallelHMM
from cospeech.synthesis.head.features import HEAD
from cospeech.synthesis.live import MELODY

SEGMENT_S = (1.0, 0.6, 1.6)
"""Mean durations of the random segments that initialise the restarts for the head, in turn."""

MELODY_SEGMENT_S = (0.5, 0.25, 1.0)
"""The same for the melody, whose patterns extend over several syllables."""

VARIANCE_FLOOR = 0.01
"""Minimum variance of a feature in a state, as a share of its variance over all frames."""

LONGEST = 1.5
"""Longest initial segment relative to the mean (see ``parallel_start``); the training records must have room for one
per pattern."""

TRIED = 6
"""Iterations after which the restarts are compared."""

TOLERANCE = 1e-4
"""Training ends when the log-likelihood gain per frame falls below this."""


class Kind(NamedTuple):
    """What patterns are made of: a prefix of their labels, features, and durations of the initial segments."""

    prefix: str
    features: tuple[str, ...]
    segment_s: tuple[float, ...]


GESTURES = Kind("g", HEAD, SEGMENT_S)
MELODIES = Kind("r", MELODY, MELODY_SEGMENT_S)


def affordable(n_patterns: int, longest: float, sequences: Sequence[Floats] | Sequence[Integers]) -> int:
    """Return ``n_patterns``, or fewer if the sequences have no room for that many segments of ``longest`` frames."""
    room = sum(len(frames) for frames in sequences) / (LONGEST * longest)
    return max(1, min(n_patterns, int(room)))


def begin(
    kind: Kind, sequences: list[Floats], fps: float, n_patterns: int, states: int, restart: int,
    rng: np.random.Generator,
) -> ParallelHMM:  # fmt: skip
    """Return the initial model of a restart."""
    length = max(states, round(kind.segment_s[restart % len(kind.segment_s)] * fps))
    floor = parallel_start.variance_floor(sequences, kind.features, VARIANCE_FLOOR)
    return parallel_start.from_clusters(sequences, n_patterns, states, length, floor, rng)


def learn(
    kind: Kind, sequences: list[Floats], fps: float, n_patterns: int, states: int, restarts: int, iterations: int,
    rng: np.random.Generator,
) -> LabelledHMM:  # fmt: skip
    """Return patterns, in a reproducible order.

    Of all restarts, only the one that is most likely after ``TRIED`` iterations is trained further.

    Parameters
    ----------
    sequences : (T, D) features each. fps : their frame rate.
    n_patterns, states : number of patterns, if there is data enough, and of states of each.
    """
    n_branches = affordable(n_patterns, max(states, fps * max(kind.segment_s)), sequences)
    floor = parallel_start.variance_floor(sequences, kind.features, VARIANCE_FLOOR)
    tried = [
        parallel.fit(begin(kind, sequences, fps, n_branches, states, restart, rng), sequences, floor, TRIED)
        for restart in range(restarts)
    ]
    best = tried[int(np.argmax([fit.log_likelihoods[-1] for fit in tried]))].model
    trained = parallel.fit(best, sequences, floor, iterations, TOLERANCE).model
    labels = tuple(f"{kind.prefix}{m + 1}" for m in range(n_branches))
    return LabelledHMM(ordered(kind, trained), labels, kind.features)


def branch_means(model: ParallelHMM) -> Floats:
    """Return the mean features of each branch, (M, D), its states weighted by their expected duration."""
    weight = 1.0 / (1.0 - model.stay)
    return np.asarray((model.mean * weight[:, :, None]).sum(axis=1) / weight.sum(axis=1)[:, None])


def ordered(kind: Kind, model: ParallelHMM) -> ParallelHMM:
    """Return the model with head patterns sorted by turn, from right to left, and melody patterns by intensity."""
    by = "y_deg" if kind == GESTURES else "intensity"
    order = np.argsort(branch_means(model)[:, kind.features.index(by)], kind="stable")
    return ParallelHMM(*(values[order] for values in model))


def label(model: ParallelHMM, frames: Floats) -> Integers:
    """Return the pattern of every frame (T,) of a sequence (T, D) (eq. 4.11-4.13)."""
    return parallel.decode(model, frames).branch
