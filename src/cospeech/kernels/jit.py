"""The compiler of all kernels: numba with a cache, and without imports that the kernels do not need.

When it loads its first kernel, numba asks scipy for a BLAS, which imports all of ``scipy.linalg``, and imports cffi
with its C parser. This costs 0.3 s in every process of a run. The first is needed only for ``np.correlate``, because
matrix products ask again; the second for calls of C functions by cffi, which no kernel makes.
"""

from __future__ import annotations

import functools
import sys
from typing import Any

import numba

UNASKED = [name for name in ("scipy.linalg.cython_blas", "cffi") if name not in sys.modules]

sys.modules.update(dict.fromkeys(UNASKED))  # type: ignore[arg-type]  # None makes an import fail
try:
    import numba.core.typing.cffi_utils
    import numba.np.arraymath  # both look once, when they are imported
finally:
    for name in UNASKED:
        del sys.modules[name]

njit: Any = functools.partial(numba.njit, cache=True)
"""``numba.njit`` with a cache (see ``numba_cache``); further options may be given."""
