"""How well made phrases agree with real ones: what an emission weight is chosen by, inside the training records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Integers
from cospeech.markov import hsmm


def kappa(actual: npt.ArrayLike, made: npt.ArrayLike) -> float:
    """Return Cohen's kappa of two label sequences, (T,) each; 0 where chance alone would agree wholly."""
    names, codes = np.unique(np.concatenate([actual, made]), return_inverse=True)
    one, other = np.split(codes, 2)
    return _kappa_of_codes(one, other, len(names))


def _kappa_of_codes(one: Integers, other: Integers, n_names: int) -> float:
    together = np.bincount(one * n_names + other, minlength=n_names**2).reshape(n_names, -1) / len(one)
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


def agreements(actual: pd.DataFrame, paths: Sequence[hsmm.Path]) -> list[float]:
    """Return of each path kappa of the frames less the boundary distance in units of the mean real phrase.

    Parameters
    ----------
    actual : segment table of one record. paths : phrases made for the same frames.

    Notes
    -----
    Kappa alone does not see where neighbouring phrases of one label meet, and the boundary distance alone can be won
    by few boundaries. Boundaries that know nothing lie about a quarter of a phrase away, whatever the corpus' tempo.
    """
    starts, labels = actual["start_frame"].to_numpy(), actual["label"].to_numpy(dtype=str)
    n_frames = int(actual["end_frame"].iloc[-1])

    def of(path: hsmm.Path) -> float:
        # Phrases are few and frames many: the labels become numbers before they are laid out over the frames.
        names, codes = np.unique(np.concatenate([labels, path.labels.astype(str)]), return_inverse=True)
        real, made = (
            np.repeat(code, np.diff(np.append(start, n_frames)))
            for code, start in ((codes[: len(labels)], starts), (codes[len(labels) :], path.starts))
        )
        distance = boundary_distance(starts, path.starts) / (n_frames / len(labels))
        return _kappa_of_codes(real, made, len(names)) - distance

    return [of(path) for path in paths]
