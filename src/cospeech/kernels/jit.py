"""The compiler of all kernels: numba, which keeps what it compiled, and looks for a BLAS only where one is used.

As it loads its first kernel, numba asks scipy whether there is a BLAS and so loads all of ``scipy.linalg``, and cffi
with its parser of C: 0.3 s of each of a run's many processes. The first answer serves ``np.correlate`` alone, as a
product of matrices asks for itself; no kernel calls C by cffi.
"""

from __future__ import annotations

import functools
import sys
from typing import Any

import numba

UNASKED = [name for name in ("scipy.linalg.cython_blas", "cffi") if name not in sys.modules]

sys.modules.update(dict.fromkeys(UNASKED))  # type: ignore[arg-type]  # None is the sign for importers that there is none
try:
    import numba.core.typing.cffi_utils
    import numba.np.arraymath  # both look once, while they are loaded
finally:
    for name in UNASKED:
        del sys.modules[name]

njit: Any = functools.partial(numba.njit, cache=True)
"""``numba.njit``, with or without further options, whose result is kept (see ``compiled``)."""
