"""Agreement of two label sequences frame by frame, raw and beyond chance."""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Integers


def share_right(actual: Integers, synthesised: Integers) -> float:
    """Return the share of frames that have the same label in both sequences; NaN without frames."""
    return float(np.mean(actual == synthesised)) if len(actual) else math.nan


def kappa(actual: Integers, synthesised: Integers, *, undefined: float = math.nan) -> float:
    """Return Cohen's kappa of two label sequences.

    It is 1 for equal sequences and 0 for the agreement that the shares of the labels alone lead to by chance
    (Cohen 1960, eq. 1).

    Parameters
    ----------
    actual, synthesised : (T,) labels as integers from 0, of the same set in both.
    undefined : the value where kappa is undefined, because there is no frame, or because both sequences have one and
        the same label throughout, so that chance agreement is perfect. A score keeps the default, NaN, and is left
        out of means; a criterion that compares candidates on the same record sets 0, as such a record says nothing
        in favour of any of them.
    """
    if len(actual) == 0:
        return undefined
    n_labels = int(max(actual.max(), synthesised.max())) + 1
    pairs = np.bincount(actual * n_labels + synthesised, minlength=n_labels**2).reshape(n_labels, n_labels)
    chance = int(pairs.sum(axis=1) @ pairs.sum(axis=0)) / len(actual) ** 2
    if chance == 1.0:
        return undefined
    right = int(np.trace(pairs)) / len(actual)
    return (right - chance) / (1.0 - chance)
