"""Seeded streams of random numbers."""

import numpy as np

from cospeech.data.rng import random_source


def test_a_stream_depends_on_the_seed_and_on_all_names_in_order():
    calls = [(3,), (3, "a"), (3, "a", "b"), (3, "b", "a"), (3, "ab"), (4, "a", "b")]
    draws = [random_source(*call).random() for call in calls]
    assert len(set(draws)) == len(calls)
    assert draws == [random_source(*call).random() for call in calls]


def test_streams_stay_the_same_as_they_were():
    """A changed stream would change every corpus, synthesis and interval that belongs to a seed."""
    expected = np.random.default_rng([3, 314096118, 3904355907]).random(4)  # CRC-32 of the two names
    np.testing.assert_array_equal(random_source(3, "cast", "a").random(4), expected)
