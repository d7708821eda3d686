"""The Fréchet distance between the distributions of hand motion in a synthesised and a recorded record.

Both are described by a Gaussian of the features of windows: |m1 - m2|^2 + tr(S1 + S2 - 2 (S1 S2)^(1/2)). Ours are the
features below and not those of a trained encoder, so this is *not* the FGD of the literature, and its values cannot
be compared with those.

Per window of ``WINDOW_S``, one every ``STEP_S``, and per wrist: the mean position relative to the hips (3), the
logarithm of the mean speed, and that of the standard deviation of the position; ten features in all. They are divided
by their standard deviations in the recorded motion. The distance of two samples of one distribution is not 0, but the
larger, the fewer windows there are. The distance between the two halves of the recorded motion shows how large it is.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats

WINDOW_S, STEP_S = 1.5, 0.5

SLOWEST_M_S, SMALLEST_M = 1e-3, 1e-3
"""Added to speeds and to standard deviations before the logarithm, as hands may rest."""

FLOOR = 1e-6
"""Added to the variances."""

FEWEST = 20
"""Windows without which there is no distance; ten features need some more than that."""


def features(places: Floats, speed: Floats, fps: float) -> Floats:
    """Return the features (n, 10) of the windows, given positions (T, 2, 3) and speeds (T, 2) of the wrists."""
    length, step = max(1, round(WINDOW_S * fps)), max(1, round(STEP_S * fps))
    rows = []
    for first in range(0, len(places) - length + 1, step):
        inside = slice(first, first + length)
        spread = np.sqrt(places[inside].var(axis=0).sum(axis=1))
        quick = np.log(speed[inside].mean(axis=0) + SLOWEST_M_S)
        rows.append([*places[inside].mean(axis=0).ravel(), *quick, *np.log(spread + SMALLEST_M)])
    return np.array(rows).reshape(len(rows), 10)


def distance(one: Floats, other: Floats) -> float:
    """Return the Fréchet distance between Gaussians fitted to samples (n, D) and (m, D); NaN with too few of them."""
    if min(len(one), len(other)) < FEWEST:
        return math.nan
    floor = FLOOR * np.eye(one.shape[1])
    first, second = (np.cov(sample.T) + floor for sample in (one, other))
    values, axes = np.linalg.eigh(first)
    root = (axes * np.sqrt(values)) @ axes.T
    shared = np.sqrt(np.maximum(np.linalg.eigvalsh(root @ second @ root), 0.0)).sum()
    apart = one.mean(axis=0) - other.mean(axis=0)
    return float(apart @ apart + np.trace(first) + np.trace(second) - 2.0 * shared)


def between_halves(recorded: Floats) -> float:
    """Return the distance between the two halves of a sample (n, D) in their order."""
    half = len(recorded) // 2
    return distance(recorded[:half], recorded[half:])
