"""The observations of table 3.1, their running statistics, and silences as a listener learns of them."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
import speaking_body

from cospeech.synthesis.bodylanguage import alignment, observations
from cospeech.synthesis.bodylanguage.observations import HIGH, LONG, MEDIUM, SHORT, SILENCE, STANDARD, Statistics


def random_syllables(rng, n):
    return speaking_body.syllables(rng, 100.0)[:n]


def test_26_of_36_observations_can_occur():
    assert observations.N_OBSERVATIONS == 36
    assert len(observations.OCCURRING) == 26
    assert [observations.index(*observations.features(one)) for one in range(36)] == list(range(36))
    silent = [
        observations.features(one) for one in observations.OCCURRING if observations.features(one)[2] == SILENCE
    ]
    assert silent == [(0, 0, SILENCE, SHORT), (0, 0, SILENCE, MEDIUM)]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((10.0, 5.0, -20.0, 0.20), (0, 0, STANDARD, MEDIUM)),
        ((14.0, 5.0, -20.0, 0.20), (1, 0, STANDARD, MEDIUM)),
        ((13.9, 7.0, -20.0, 0.20), (0, 1, STANDARD, MEDIUM)),
        ((14.0, 7.0, -17.0, 0.14), (1, 1, HIGH, SHORT)),
        ((10.0, 5.0, -17.1, 0.31), (0, 0, STANDARD, LONG)),
        ((np.nan, np.nan, -10.0, 0.16), (0, 0, HIGH, MEDIUM)),
    ],
)
def test_observations_are_those_of_table_3_1(values, expected):
    statistics = Statistics([10.0, 5.0, -20.0, 0.2], [4.0, 2.0, 6.0, 0.1], 1.0)
    assert observations.features(statistics.observation(values)) == expected


def test_running_statistics_equal_those_of_the_table():
    rng = np.random.default_rng(0)
    for _ in range(20):
        table = random_syllables(rng, int(rng.integers(1, 40)))
        running = Statistics(np.zeros(4), np.ones(4), 0.0)
        for row in table.to_dict("records"):
            running.add(observations.measured(row))
        mean, deviation = observations.statistics_of([table])
        known = [True, True, True, True] if table["f0_hz"].notna().any() else [False, False, True, True]
        np.testing.assert_allclose(np.array(running.mean)[known], mean[known], rtol=1e-9)
        np.testing.assert_allclose(np.array(running.deviation)[known], deviation[known], rtol=1e-6, atol=1e-6)


def test_statistics_start_from_those_of_training():
    statistics = Statistics([0.0] * 4, [1.0] * 4, observations.PRIOR_SYLLABLES)
    for _ in range(int(observations.PRIOR_SYLLABLES)):
        statistics.add([4.0] * 4)
    np.testing.assert_allclose(statistics.mean, 2.0)
    np.testing.assert_allclose(statistics.deviation, np.sqrt(0.5 + 4.0))


def test_observations_fill_the_record_and_silences_are_never_long():
    rng = np.random.default_rng(1)
    for _ in range(30):
        table = random_syllables(rng, 30)
        duration_s = float(table["end_s"].iloc[-1]) + rng.uniform(0.0, 3.0)
        wait_s = observations.waiting_time_s([table])
        found = observations.observe(table, duration_s, 0.025, wait_s)
        assert found[0].start_s == 0.0
        for one, following in pairwise(found):
            assert one.end_s == pytest.approx(following.start_s, abs=observations.SHORTEST_SILENCE_S)
            assert one.known_s <= following.known_s
        assert all(one.end_s <= one.known_s for one in found)
        assert all(observations.can_occur(one.observation) for one in found)
        silent = [observations.features(one.observation)[2] == SILENCE for one in found]
        assert len(found) - sum(silent) == len(table)
        length_s = table["end_s"] - table["start_s"]
        piece_s = max(length_s.mean(), observations.SHORTEST_SILENCE_S)
        for one, is_silent in zip(found, silent, strict=True):
            assert not is_silent or one.end_s - one.start_s <= piece_s + 1e-9
        assert found[-1].end_s >= duration_s - wait_s - piece_s - 0.05


def test_the_closure_of_a_stop_is_not_a_silence():
    """Each syllable but the first follows a gap; only the gaps that are long enough for a pause are observed."""
    gaps_s = [0.03, 0.12, 0.099, 0.11, 0.02]
    starts = np.cumsum([0.0, *(0.2 + np.array(gaps_s))])
    table = pd.DataFrame({"record": "one", "start_s": starts, "end_s": starts + 0.2, "known_s": starts + 0.21})
    table[["f0_rise_hz", "f0_fall_hz", "intensity_db"]] = 1.0
    found = observations.observe(table, float(starts[-1]) + 0.25, 0.025, 0.4)
    silent = [one for one in found if observations.features(one.observation)[2] == SILENCE]
    assert len(found) == len(table) + 2
    np.testing.assert_allclose([one.end_s - one.start_s for one in silent], [0.12, 0.11])


def test_long_silences_end_for_any_lengths_of_syllables():
    """Also where syllables are shorter than the shortest silence."""
    statistics = Statistics(np.array([0.0, 0.0, 0.0, 0.04]), np.full(4, 0.01), 10.0)
    listener = observations.Listener(statistics, 0.2)
    found = [one for frame in range(80) for one in listener.hear(0.025 * (frame + 1), [])]
    np.testing.assert_allclose(np.diff([one.end_s for one in found]), observations.SHORTEST_SILENCE_S)
    assert found[-1].end_s == pytest.approx(1.7, abs=0.11)


def test_a_listener_needs_nothing_that_is_not_known_yet():
    """Cutting off the rest of the speech does not change what was observed before."""
    rng = np.random.default_rng(2)
    table = random_syllables(rng, 40)
    whole = observations.Listener(Statistics([5.0, 5.0, -25.0, 0.2], [5.0, 5.0, 6.0, 0.1], 10.0), 0.4)
    cut = observations.Listener(Statistics([5.0, 5.0, -25.0, 0.2], [5.0, 5.0, 6.0, 0.1], 10.0), 0.4)
    rows = table.to_dict("records")
    heard = {"whole": [], "cut": []}
    for frame in range(int(table["known_s"].iloc[-1] / 0.025) + 1):
        time_s = (frame + 1) * 0.025
        new = [row for row in rows if frame == int(row["known_s"] / 0.025)]
        heard["whole"] += [(frame, one) for one in whole.hear(time_s, new)]
        if time_s < 5.0:
            heard["cut"] += [(frame, one) for one in cut.hear(time_s, new)]
    assert heard["cut"]
    assert heard["whole"][: len(heard["cut"])] == heard["cut"]
    assert all(one.known_s == (frame + 1) * 0.025 for frame, one in heard["whole"])


def test_observations_go_with_the_subunit_at_the_end_of_the_next_one():
    """The example of figure 4.1, in numbers: four syllables, three subunits."""
    subunits = pd.DataFrame({"start_s": [0.0, 1.0, 2.0], "end_s": [1.0, 2.0, 3.0], "cluster": [7, 3, 3]})
    ends = [0.5, 1.1, 1.3, 1.9, 2.4, 3.0]
    observed = [observations.Observed(k, 0.0, end_s, end_s) for k, end_s in enumerate(ends)]
    path = alignment.align(observed, subunits)
    assert path.observation.tolist() == [0, 1, 2, 3, 4]
    assert path.cluster.tolist() == [3, 3, 3, 3, 3]
    assert path.start.tolist() == [True, False, False, True, False]
    np.testing.assert_allclose(path.elapsed, [0.1, 0.3, 0.9, 0.4, 1.0])
    assert alignment.skipped_share([path], 3) == pytest.approx(1 / 3)
