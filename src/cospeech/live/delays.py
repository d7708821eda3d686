"""Distributions of delays, in constant memory."""

from __future__ import annotations

import math

import numpy as np

SMALLEST_S, RATIO, N_BINS = 1e-6, 1.01, 2000
"""Bins have edges in a ratio of 1.01, from a microsecond to seven minutes, so quantiles are accurate to 1 %."""


class Delays:
    """Counts delays.

    Attributes
    ----------
    n : number of delays.
    longest_s : the longest one in seconds.
    """

    def __init__(self) -> None:
        self._counts = np.zeros(N_BINS, dtype=np.int64)
        self.n = 0
        self.longest_s = 0.0

    def add(self, delay_s: float) -> None:
        """Count a delay in seconds; one below a microsecond counts as a microsecond."""
        place = int(math.log(max(delay_s, SMALLEST_S) / SMALLEST_S) / math.log(RATIO))
        self._counts[min(place, N_BINS - 1)] += 1
        self.n += 1
        self.longest_s = max(self.longest_s, delay_s)

    def quantile_s(self, share: float) -> float:
        """Return the delay that a share of all delays does not exceed, in seconds; NaN if there is none."""
        if self.n == 0:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._counts), max(1, math.ceil(share * self.n))))
        return min(SMALLEST_S * RATIO ** (place + 1), self.longest_s)

    def line(self, what: str) -> str:
        """Return one line: what is delayed, and median, 90th and 99th percentile and longest delay in ms."""
        if self.n == 0:
            return f"{what}: none"
        values = [*(self.quantile_s(share) for share in (0.5, 0.9, 0.99)), self.longest_s]
        median, p90, p99, longest = (f"{1000 * value:.{1 if value >= 0.01 else 3}f}" for value in values)
        return f"{what}: median {median} ms, 90 % {p90} ms, 99 % {p99} ms, longest {longest} ms ({self.n})"
