"""Canonical correlation analysis (Sargin 2006, appendix A), with and without regularisation.

Appendix A calls gamma both the eigenvalue of A.5 and the canonical correlation; the eigenvalue is its square.
Section 2.3.1 calls the diagonal of the between-set covariance squared canonical correlations; by A.6 and A.9 it is
the canonical correlations themselves. Equation 2.6 applies the transpose of H, but the rows of H are the basis
vectors (A.2), so that H itself is applied.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.linalg import solve_triangular

from cospeech.data.arrays import Floats
from cospeech.errors import UserError


class Covariances(NamedTuple):
    """Means (N_x,) and (N_y,), and the blocks of the joint covariance matrix (A.4)."""

    mean_x: Floats
    mean_y: Floats
    xx: Floats
    xy: Floats
    yy: Floats


class Canonical(NamedTuple):
    """A transform of two sets of features into N pairs of canonical components.

    Attributes
    ----------
    mean_x, mean_y : (N_x,) and (N_y,), subtracted first.
    basis_x, basis_y : (N, N_x) and (N, N_y), the matrices H of A.2.
    correlations : (N,) canonical correlations, in decreasing order.
    """

    mean_x: Floats
    mean_y: Floats
    basis_x: Floats
    basis_y: Floats
    correlations: Floats

    def project_x(self, frames: Floats) -> Floats:
        """Return the canonical components (T, N) of frames (T, N_x) (A.1)."""
        return np.ascontiguousarray((frames - self.mean_x) @ self.basis_x.T)

    def project_y(self, frames: Floats) -> Floats:
        """Return the canonical components (T, N) of frames (T, N_y) (A.1)."""
        return np.ascontiguousarray((frames - self.mean_y) @ self.basis_y.T)


def covariances(x: Floats, y: Floats) -> Covariances:
    """Return the covariances of frames (T, N_x) and (T, N_y) that belong together."""
    mean_x, mean_y = x.mean(axis=0), y.mean(axis=0)
    from_x, from_y = x - mean_x, y - mean_y
    n = len(x)
    return Covariances(mean_x, mean_y, from_x.T @ from_x / n, from_x.T @ from_y / n, from_y.T @ from_y / n)


def regularised(covariance: Floats, share: float) -> Floats:
    """Return a covariance matrix with its diagonal increased by ``share`` of it (a ridge)."""
    return covariance + share * np.diag(np.diagonal(covariance))


def whitening(covariance: Floats, what: str = "features") -> Floats:
    """Return the lower Cholesky factor of a covariance matrix.

    Raises
    ------
    UserError : if the matrix is singular.
    """
    scale = np.sqrt(np.diagonal(covariance))
    try:
        factor = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    except np.linalg.LinAlgError:
        factor = np.zeros_like(covariance)
    if not (np.diagonal(factor) > 1e-7 * scale).all():
        raise UserError(
            f"the covariance of {len(covariance)} {what} is singular: they depend on one another, one does not vary, "
            "or there are too few frames; give more speech or set identity.regularisation above 0"
        )
    return factor


def fit(x: Floats, y: Floats, regularisation: float = 0.0) -> Canonical:
    """Return the canonical transform of frames (T, N_x) and (T, N_y) that belong together.

    Parameters
    ----------
    x, y : the frames.
    regularisation : share of the variances that is added to them, which lowers the correlations.

    Raises
    ------
    UserError : if a covariance matrix is singular, as with fewer frames than features.
    """
    return of_covariances(covariances(x, y), regularisation)


def of_covariances(given: Covariances, regularisation: float = 0.0) -> Canonical:
    """Return the canonical transform that belongs to covariances; see ``fit``.

    With Cholesky factors L of the covariances within the sets, A.5 is solved by the singular value decomposition of
    L_x^-1 C_xy L_y^-T, whose singular values are the canonical correlations. The element of greatest size of each
    basis vector of x is positive.
    """
    factor_x = whitening(regularised(given.xx, regularisation), "audio features")
    factor_y = whitening(regularised(given.yy, regularisation), "lip features")
    coherence = solve_triangular(factor_y, solve_triangular(factor_x, given.xy, lower=True).T, lower=True).T
    left, correlations, right = np.linalg.svd(coherence, full_matrices=False)
    basis_x = solve_triangular(factor_x, left, lower=True, trans="T").T
    basis_y = solve_triangular(factor_y, right.T, lower=True, trans="T").T
    rows = np.arange(len(basis_x))
    signs = np.sign(basis_x[rows, np.abs(basis_x).argmax(axis=1)])[:, None]
    return Canonical(given.mean_x, given.mean_y, signs * basis_x, signs * basis_y, np.minimum(correlations, 1.0))


def principal(frames: Floats, n_components: int) -> tuple[Floats, Floats]:
    """Return the mean of frames (T, D), and the basis (N, D) of their first principal components with variance 1.

    Raises
    ------
    UserError : if the frames have fewer independent features.
    """
    mean = frames.mean(axis=0)
    centred = frames - mean
    values, vectors = np.linalg.eigh(centred.T @ centred / len(frames))
    order = np.argsort(values)[::-1][:n_components]
    if values[order[-1]] <= 1e-12 * values[order[0]]:
        raise UserError(f"the frames have fewer than {n_components} independent features; give more speech")
    basis = (vectors[:, order] / np.sqrt(values[order])).T
    signs = np.sign(basis[np.arange(len(basis)), np.abs(basis).argmax(axis=1)])[:, None]
    return mean, signs * basis


def correlation_table(session: str, correlations: Floats) -> pd.DataFrame:
    """Return the rows of the table ``canonical_correlations`` of one session."""
    return pd.DataFrame(
        {"session": session, "pair": np.arange(1, len(correlations) + 1), "correlation": correlations}
    )
