"""Random number generators that are seeded by name, so that no part of a run shifts the numbers of another."""

from __future__ import annotations

import zlib

import numpy as np


def random_source(seed: int, *names: str) -> np.random.Generator:
    """Return the random number generator of ``names`` under ``seed``.

    The stream depends on the seed and on the names in their order, and on nothing else that has been drawn.

    Parameters
    ----------
    seed : seed of the run, not negative.
    names : what the numbers are for, such as a method and a record.
    """
    return np.random.default_rng([seed, *(zlib.crc32(name.encode()) for name in names)])
