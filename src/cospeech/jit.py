"""The compiler of all kernels: numba, which keeps what it compiled, and looks for a BLAS only where one is used.

As it loads its first kernel, numba asks scipy whether there is a BLAS and so loads all of ``scipy.linalg``: 0.3 s of
each of a run's many processes. The answer serves ``np.correlate`` alone; a product of matrices asks for itself.
"""

from __future__ import annotations

import functools
import sys
from typing import Any

import numba

BLAS = "scipy.linalg.cython_blas"

if BLAS not in sys.modules:
    sys.modules[BLAS] = None  # type: ignore[assignment]  # the sign for importers that there is none
    try:
        import numba.np.arraymath  # it looks once, while it is loaded
    finally:
        del sys.modules[BLAS]

njit: Any = functools.partial(numba.njit, cache=True)
"""``numba.njit``, with or without further options, whose result is kept (see ``compiled``)."""
