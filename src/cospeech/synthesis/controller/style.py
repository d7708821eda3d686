"""Style manipulation: the same speech in another tone (Levine et al. 2010, 8.2).

A tone is a transform T_m of kinematic parameters that maps the Gaussian of neutral motion to that of motion in the
tone. The expected distances of a segment become delta^m(i) = E ||T_m Y - y||, Y ~ N(mu_i, Sigma_i), and those of a
mixture of tones with the weights d are the sum over m of d(m) delta^m.

The paper then combines the value functions that were trained for single tones with the same weights, because the cost
is linear in d. The values are not: each is a minimum, and a sum of minima does not exceed the minimum of the sum. The
combination is therefore a lower bound, some percent too low. Training takes less than a second, so that the policy of
a mixture is trained for it; the combination is kept for comparison.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.synthesis.controller.distances import expected_distances
from cospeech.synthesis.controller.policy import Policy


class Transform(NamedTuple):
    """The transform y -> ``matrix`` (D, D) y + ``offset`` (D,)."""

    matrix: Floats
    offset: Floats


def fit(neutral: Floats, tone: Floats, floor: Floats) -> Transform:
    """Return the transform that maps a Gaussian fitted to ``neutral`` (N, D) to one fitted to ``tone`` (M, D).

    The paper does not say which of the many such transforms it takes. This is the one that moves the parameters least
    in the mean square, the optimal transport between the two Gaussians. Its matrix is symmetric.

    Parameters
    ----------
    neutral, tone : kinematic parameters of segments.
    floor : (D,) added to the variances, for tones with few segments.

    Raises
    ------
    UserError : if either has fewer than two segments.
    """
    if min(len(neutral), len(tone)) < 2:
        raise UserError(
            f"a style needs at least two segments of motion: {len(neutral)} are neutral, {len(tone)} have the style"
        )
    before, after = (
        np.cov(values.T, bias=True).reshape(len(floor), -1) + np.diag(floor) for values in (neutral, tone)
    )
    root = _power(before, 0.5)
    inverse = _power(before, -0.5)
    matrix = inverse @ _power(root @ after @ root, 0.5) @ inverse
    return Transform(matrix, tone.mean(axis=0) - matrix @ neutral.mean(axis=0))


def _power(matrix: Floats, exponent: float) -> Floats:
    """Return a power of a symmetric positive definite matrix."""
    values, axes = np.linalg.eigh(matrix)
    return (axes * values**exponent) @ axes.T


def tone_distances(parameters: Floats, means: Floats, covariances: Floats, transform: Transform) -> Floats:
    """Return delta^m (A, S), the expected distances of segments (A, D) from the transformed states."""
    turned = transform.matrix @ covariances @ transform.matrix.T
    return expected_distances(parameters, means @ transform.matrix.T + transform.offset, turned)


def mixed_distances(distances: Sequence[Floats], weights: Floats) -> Floats:
    """Return the expected distances (A, S) of a mixture of tones, given those of each tone and their weights."""
    return np.einsum("m,mas->as", weights, np.array(distances))


def combined(policies: Sequence[Policy], weights: Floats) -> Policy:
    """Return the paper's policy of a mixture of tones, the weighted sum of the value functions of single tones."""
    values = np.einsum("m,mbi->bi", weights, np.array([policy.values for policy in policies]))
    entering = np.einsum("m,mai->ai", weights, np.array([policy.entering for policy in policies]))
    bound = float(weights @ [policy.error_bound for policy in policies])
    return Policy(values, entering, max(policy.iterations for policy in policies), bound)


def combination_error(combination: Policy, trained: Policy) -> float:
    """Return the mean relative amount by which the combined values fall short of the trained ones."""
    return float((1.0 - combination.values / trained.values).mean())
