"""How well made phrases agree with real ones: what an emission weight is chosen by, inside the training records."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech import segments
from cospeech.markov import semi


def kappa(actual: npt.ArrayLike, made: npt.ArrayLike) -> float:
    """Return Cohen's kappa of two label sequences, (T,) each; 0 where chance alone would agree wholly."""
    names = tuple(sorted(set(np.asarray(actual)) | set(np.asarray(made))))
    one, other = semi.encode(actual, names, "actual"), semi.encode(made, names, "made")
    together = np.bincount(one * len(names) + other, minlength=len(names) ** 2).reshape(len(names), -1) / len(one)
    right = float(np.trace(together))
    chance = float(together.sum(axis=1) @ together.sum(axis=0))
    return (right - chance) / (1 - chance) if chance < 1 else 0.0


def boundary_distance(actual: npt.ArrayLike, made: npt.ArrayLike) -> float:
    """Return the mean distance of starts ``made``, (L,), to the nearest of ``actual``, (L',) (Özkul 2012, 7.2)."""
    real, given = np.asarray(actual), np.asarray(made)
    after = np.searchsorted(real, given)
    before = real[np.clip(after - 1, 0, len(real) - 1)]
    behind = real[np.clip(after, 0, len(real) - 1)]
    return float(np.mean(np.minimum(np.abs(given - before), np.abs(behind - given))))


def agreement(actual: pd.DataFrame, path: semi.Path) -> float:
    """Return kappa of the frames less the boundary distance in units of the mean real phrase.

    Parameters
    ----------
    actual : segment table of one record. path : phrases made for the same frames.

    Notes
    -----
    Kappa alone does not see where neighbouring phrases of one label meet, and the boundary distance alone can be won
    by few boundaries. Boundaries that know nothing lie about a quarter of a phrase away, whatever the corpus' tempo.
    """
    n_frames = int(actual["end_frame"].iloc[-1])
    made = np.repeat(path.labels, np.diff(np.append(path.starts, n_frames)))
    distance = boundary_distance(actual["start_frame"], path.starts) / (n_frames / len(actual))
    return kappa(segments.to_labels(actual), made) - distance
