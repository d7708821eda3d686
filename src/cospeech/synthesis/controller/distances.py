"""Expected distances of motion segments from the hidden states (Levine et al. 2010, 7.1).

The expected distance of a segment with kinematic parameters y from a state with the Gaussian N(mu, Sigma),

    delta(i) = E ||Y - y||,   Y ~ N(mu_i, Sigma_i),

is a six-dimensional integral in the paper. With X = ||Y - y||^2 and phi(s) = E exp(-s X), one dimension is enough:

    E sqrt(X) = 1 / (2 sqrt(pi)) * integral over s > 0 of (1 - phi(s)) s^(-3/2) ds,
    phi(s) = product over d of (1 + 2 s v_d)^(-1/2) exp(-s c_d^2 / (1 + 2 s v_d)),

where v_d are the eigenvalues of Sigma and c the coordinates of mu - y along its eigenvectors. The integrand decays
slowly in log s. A gamma distribution with the mean and the variance of X, for which E sqrt(X) is known, is therefore
subtracted; what remains decays quickly on both sides, and the trapezoidal rule in log s converges exponentially.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

NODES = 32
"""Nodes of the trapezoidal rule; the relative error is then below 5e-7 (see the tests)."""

FIRST, LAST = -6.0, 14.0
"""Range of the nodes in log(s E X)."""


@njit
def _expected_norms(variances: Floats, offsets: Floats, nodes: Floats, norms: Floats) -> None:
    """Write E ||Z|| for Gaussians Z in the coordinates of their eigenvectors.

    Parameters
    ----------
    variances : (S, D), not negative.
    offsets : (A, S, D) means.
    nodes : (N,) equidistant nodes in log(s E X).
    norms : (A, S), filled in.
    """
    n_segments, n_states, n_features = offsets.shape
    step = nodes[1] - nodes[0]
    scaled = np.exp(nodes)
    roots = np.exp(-0.5 * nodes)
    for a in range(n_segments):
        for i in range(n_states):
            mean = spread = 0.0
            for d in range(n_features):
                v, c = variances[i, d], offsets[a, i, d] ** 2
                mean += v + c
                spread += 2.0 * v * (v + 2.0 * c)
            if mean <= 0.0 or spread <= 1e-24 * mean * mean:
                norms[a, i] = math.sqrt(max(mean, 0.0))
                continue
            shape, scale = mean * mean / spread, spread / (mean * mean)
            rest = 0.0
            for n in range(len(nodes)):
                s = scaled[n] / mean
                exponent, product = 0.0, 1.0
                for d in range(n_features):
                    v, c = variances[i, d], offsets[a, i, d]
                    grown = 1.0 + 2.0 * s * v
                    product *= grown
                    exponent += s * c * c / grown
                gamma = math.exp(-shape * math.log1p(scaled[n] * scale))
                rest += (gamma - math.exp(-exponent) / math.sqrt(product)) * roots[n]
            known = math.exp(math.lgamma(shape + 0.5) - math.lgamma(shape)) * math.sqrt(scale)
            norms[a, i] = math.sqrt(mean) * (known + rest * step / (2.0 * math.sqrt(math.pi)))


def expected_distances(parameters: Floats, means: Floats, covariances: Floats, nodes: int = NODES) -> Floats:
    """Return the expected distance of every segment from every state, delta (A, S), in the unit of the parameters.

    Parameters
    ----------
    parameters : (A, D) kinematic parameters of the segments.
    means, covariances : (S, D) and (S, D, D) Gaussians of the states.
    nodes : nodes of the quadrature.
    """
    variances, axes = np.linalg.eigh(covariances)
    offsets = np.einsum("asd,sde->ase", means[None] - parameters[:, None], axes)
    norms = np.empty(offsets.shape[:2])
    grid = np.linspace(FIRST, LAST, nodes)
    _expected_norms(np.maximum(variances, 0.0), np.ascontiguousarray(offsets), grid, norms)
    return norms
