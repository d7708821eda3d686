"""Distributions of delays."""

import re

import numpy as np
import pytest

from cospeech.live.delays import Delays


@pytest.mark.parametrize("seed", range(5))
def test_quantiles_are_right_to_one_percent(seed):
    rng = np.random.default_rng(seed)
    values = np.exp(rng.normal(-6, 2, 2000))
    delays = Delays()
    for value in values:
        delays.add(value)
    assert delays.n == 2000
    assert delays.longest_s == values.max()
    for share in (0.5, 0.9, 0.99, 1.0):
        assert delays.quantile_s(share) == pytest.approx(np.quantile(values, share, method="inverted_cdf"), rel=0.011)


def test_the_line_states_milliseconds_and_the_number():
    delays = Delays()
    assert delays.line("sound") == "sound: none"
    for value in (0.0001, 0.0002, 0.15, 4.0):
        delays.add(value)
    assert re.fullmatch(
        r"sound: median 0\.20[0-2] ms, 90 % 4000\.0 ms, 99 % 4000\.0 ms, longest 4000\.0 ms \(4\)",
        delays.line("sound"),
    )
