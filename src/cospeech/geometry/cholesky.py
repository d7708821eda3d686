"""Compiled solution of small systems of linear equations with a symmetric, positive definite matrix.

``np.linalg.solve`` takes seconds to compile, and calls LAPACK, which takes longer than it solves.
"""

from __future__ import annotations

import math

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit


@njit
def solve_in_place(matrix: Floats, right: Floats) -> None:
    """Replace ``right`` (n, m) by the solution X of ``matrix`` X = right, and ``matrix`` (n, n) by its factor.

    Only the lower triangle of ``matrix`` is read, which becomes that of its Cholesky factor. The solution is NaN if
    the matrix is not positive definite.
    """
    size = len(matrix)
    for i in range(size):
        for j in range(i + 1):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            if i > j:
                matrix[i, j] = value / matrix[j, j]
            else:
                matrix[i, i] = math.sqrt(value) if value > 0.0 else math.nan
    for column in range(right.shape[1]):
        for i in range(size):
            value = right[i, column]
            for k in range(i):
                value -= matrix[i, k] * right[k, column]
            right[i, column] = value / matrix[i, i]
        for i in range(size - 1, -1, -1):
            value = right[i, column]
            for k in range(i + 1, size):
                value -= matrix[k, i] * right[k, column]
            right[i, column] = value / matrix[i, i]
