"""Agreement of two label sequences frame by frame, raw and beyond chance."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Codes = npt.NDArray[np.int64]


def share_right(actual: Codes, synthesised: Codes) -> float:
    """Return the share of frames with one label in both sequences; NaN without frames."""
    return float(np.mean(actual == synthesised)) if len(actual) else math.nan


def kappa(actual: Codes, synthesised: Codes) -> float:
    """Return Cohen's kappa of two label sequences (T,) of labels counted from 0.

    It is 1 for equal sequences and 0 for what the shares of the labels alone would give (Cohen 1960, eq. 1). Where
    both sequences are one and the same label throughout, chance is perfect and kappa undefined: NaN.
    """
    if len(actual) == 0:
        return math.nan
    n_labels = int(max(actual.max(), synthesised.max())) + 1
    counts = np.bincount(actual, minlength=n_labels) * np.bincount(synthesised, minlength=n_labels)
    chance = int(counts.sum()) / len(actual) ** 2
    if chance == 1.0:
        return math.nan
    return (share_right(actual, synthesised) - chance) / (1.0 - chance)
