"""The rotation between two point sets by Newton's method on the orthogonal group, as printed and as corrected.

The closed form, ``rigid.align``, has the same optimum and always finds it. The tests compare the two.

References
----------
M. E. Sargin, 2006, appendix B.
J. H. Manton, Optimization algorithms exploiting unitary constraints, IEEE Transactions on Signal Processing 50, 2002.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats

TOLERANCE = 1e-11
"""Norm of the gradient at which the search stops, relative to the sum of the products of the point sets."""

ROUNDING = 1e-14
"""Change of the cost, in the same unit, that may be due to rounding alone and does not count as a rise (step 6)."""

MOST_STEPS = 200

SKEW = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]],
    dtype=float,
)
"""A basis A_1, A_2, A_3 of the skew-symmetric matrices (B.14)."""


class Variant(Enum):
    """Which equations are used.

    ``PRINTED`` follows appendix B to the letter. ``CORRECTED`` has the sign of the Hessian (B.10), that of the
    gradient in the equation of the step (B.15), and the last row of K_n (B.8) right. The two slips in sign cancel
    except in the part of the Hessian that stems from the constraint, so that the printed method converges linearly
    and the corrected one quadratically.
    """

    PRINTED = "printed"
    CORRECTED = "corrected"


class Search(NamedTuple):
    """Where a search ended.

    Attributes
    ----------
    rotation : R (3, 3), orthogonal; a reflection if the search went astray.
    n_steps : number of Newton steps taken.
    converged : whether the gradient vanishes there (step 3); otherwise a step did not lower the cost (step 6), or
        there were too many steps.
    """

    rotation: Floats
    n_steps: int
    converged: bool


def newton_rotation(source: Floats, target: Floats, variant: Variant) -> Search:
    """Return the orthogonal matrix R that minimises |target - R source|^2 for centred point sets, by Newton's method.

    Parameters
    ----------
    source, target : (n, 3) corresponding points; their means are removed (B.3).
    """
    before, after = source - source.mean(axis=0), target - target.mean(axis=0)
    products, spread = after.T @ before, before.T @ before
    sign = -1.0 if variant is Variant.PRINTED else 1.0
    unit = float(np.linalg.norm(products))
    rotation = _start(before, after, variant)
    for n_steps in range(MOST_STEPS):
        slope = -2.0 * (products - rotation @ spread)
        if _norm_in_tangent(rotation, slope) < TOLERANCE * unit:
            return Search(rotation, n_steps, True)
        proposed = _nearest_orthogonal(rotation + _step(rotation, slope, spread, sign))
        if np.sum((proposed - rotation) * products) < -ROUNDING * unit:  # |after - R before|^2 rises
            return Search(rotation, n_steps, False)
        rotation = proposed
    return Search(rotation, MOST_STEPS, False)


def _start(before: Floats, after: Floats, variant: Variant) -> Floats:
    """Return the solution of the linearised problem (B.6-B.8), projected to an orthogonal matrix."""
    x, y, z = before.T
    zero = np.zeros_like(x)
    last = (-x, y, zero) if variant is Variant.PRINTED else (y, -x, zero)
    rows = np.stack([np.stack([zero, z, -y]), np.stack([-z, zero, x]), np.stack(last)])  # (row, column, point)
    stacked = rows.transpose(2, 0, 1).reshape(-1, 3)
    turn = np.linalg.lstsq(stacked, (after - before).ravel(), rcond=None)[0]
    return _nearest_orthogonal(np.eye(3) + np.einsum("k,kij->ij", turn, SKEW))


def _norm_in_tangent(rotation: Floats, slope: Floats) -> float:
    """Return the norm of step 3, sqrt(tr(D'D - R'D R'D)), which the part of the gradient D along the group has.

    It is that of (R'D - D'R) / sqrt(2), which does not lose its digits at the optimum.
    """
    turned = rotation.T @ slope
    return float(np.linalg.norm(turned - turned.T)) / np.sqrt(2.0)


def _step(rotation: Floats, slope: Floats, spread: Floats, sign: float) -> Floats:
    """Return the Newton step Z in the tangent space (B.10-B.16), with the sign of B.10, which B.15 reverses."""
    hessian = sign * 2.0 * np.kron(spread, np.eye(3))
    turned = rotation.T @ slope
    hessian = hessian - 0.5 * np.kron((turned + turned.T).T, np.eye(3))
    basis = np.stack([(rotation @ skew).ravel(order="F") for skew in SKEW], axis=1)
    amounts = np.linalg.solve(basis.T @ hessian @ basis, -sign * basis.T @ slope.ravel(order="F"))
    step: Floats = (basis @ amounts).reshape(3, 3, order="F")
    return step


def _nearest_orthogonal(matrix: Floats) -> Floats:
    """Return the orthogonal matrix nearest to ``matrix`` (B.17-B.18), which may be a reflection."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt
