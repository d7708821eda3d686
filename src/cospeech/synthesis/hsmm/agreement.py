"""How well synthesised phrases agree with actual ones: the criterion for choosing an emission weight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.markov import hsmm
from cospeech.metrics import agreement, boundaries


def agreements(actual: pd.DataFrame, paths: Sequence[hsmm.Path]) -> list[float]:
    """Return, for each path, kappa of the frames minus the boundary distance in units of the mean actual phrase.

    Parameters
    ----------
    actual : segment table of one record.
    paths : phrases that were synthesised for the same frames.

    Notes
    -----
    Kappa alone does not see where two phrases of the same label meet, and the boundary distance alone favours few
    boundaries. Random boundaries are about a quarter of a phrase away from the nearest one, whatever the tempo.
    """
    starts, labels = actual["start_frame"].to_numpy(), actual["label"].to_numpy(dtype=str)
    n_frames = int(actual["end_frame"].iloc[-1])

    def of(path: hsmm.Path) -> float:
        # Phrases are few and frames many, so labels become integers before they are repeated over the frames.
        _, codes = np.unique(np.concatenate([labels, path.labels.astype(str)]), return_inverse=True)
        real, made = (
            np.repeat(code, np.diff(np.append(start, n_frames)))
            for code, start in ((codes[: len(labels)], starts), (codes[len(labels) :], path.starts))
        )
        distance = boundaries.distance(path.starts, starts) / (n_frames / len(labels))
        return agreement.kappa(real, made, undefined=0.0) - distance

    return [of(path) for path in paths]
