"""Array types for annotations; shapes and units are given in docstrings."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
Labels = npt.NDArray[Any]

Image = npt.NDArray[np.uint8]
"""A colour image, (height, width, 3)."""

Plane = npt.NDArray[np.uint8]
"""One channel of an image, (height, width)."""
