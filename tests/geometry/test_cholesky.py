"""Solutions of small systems of equations, compared with NumPy's."""

import numpy as np
import pytest

from cospeech.geometry.cholesky import solve_in_place


@pytest.mark.parametrize(("size", "columns"), [(1, 1), (2, 3), (3, 3), (6, 1)])
def test_solutions_are_those_of_numpy(size, columns):
    rng = np.random.default_rng(size)
    for _ in range(20):
        root = rng.normal(size=(size, size))
        matrix, right = root @ root.T + 0.1 * np.eye(size), rng.normal(size=(size, columns))
        found = right.copy()
        solve_in_place(matrix.copy(), found)
        np.testing.assert_allclose(found, np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-12)


def test_what_is_not_positive_definite_has_no_solution():
    found = np.ones((2, 1))
    solve_in_place(np.array([[1.0, 2.0], [2.0, 1.0]]), found)
    assert np.isnan(found).all()
