"""The planted parameters are proper distributions, specific to each actor, and stationary where documented."""

import numpy as np
import pytest

from cospeech.data import tables
from cospeech.data.vocabulary import GESTURES
from cospeech.errors import UserError
from cospeech.studio import cast
from cospeech.studio.patterns import NAMES, PAUSE

FRAME_S = 0.025


@pytest.fixture(scope="module", params=["ada", "deniz", "someone_else"])
def member(request):
    return cast.member(request.param, 2012, FRAME_S, 10.0)


def test_every_row_is_a_distribution(member):
    for rows in (member.initial, member.transitions, member.durations, member.coupled, member.emissions(0.3)):
        assert np.all(rows >= 0)
        np.testing.assert_allclose(rows.sum(axis=-1), 1.0, atol=1e-12)


def test_an_actor_is_reproducible_and_differs_from_others(member):
    again = cast.member(member.actor, 2012, FRAME_S, 10.0)
    for name in ("initial", "transitions", "durations", "coupled"):
        np.testing.assert_array_equal(getattr(member, name), getattr(again, name))
    for other in (cast.member("nobody", 2012, FRAME_S, 10.0), cast.member(member.actor, 2013, FRAME_S, 10.0)):
        assert np.abs(other.coupled - member.coupled).sum(axis=1).max() > 0.5
        assert np.abs(other.transitions - member.transitions).max() > 0.02


def test_records_start_at_rest_and_rest_never_follows_itself(member):
    assert member.initial[cast.REST] == cast.OPENS_AT_REST
    assert member.transitions[cast.REST, cast.REST] == 0
    moving = np.delete(np.diag(member.transitions), cast.REST)
    np.testing.assert_allclose(moving, cast.REPEATS)


def test_each_gesture_has_its_own_main_pattern(member):
    favourite = member.coupled.argmax(axis=1)
    assert len(set(favourite)) == len(GESTURES)
    assert favourite[cast.REST] == PAUSE
    assert member.coupled.max(axis=1).min() > 0.5


def test_durations_stay_in_their_range_and_differ_by_class(member):
    seconds = np.arange(1, 401) * FRAME_S
    outside = (seconds < cast.SHORTEST_S) | (seconds > cast.LONGEST_S)
    assert member.durations.shape == (len(GESTURES), 400)
    assert not member.durations[:, outside].any()
    assert np.ptp(member.durations @ seconds) > 0.5


def test_occupancy_is_the_stationary_distribution(member):
    visits = np.full(len(GESTURES), 1 / len(GESTURES))
    for _ in range(2000):
        visits = 0.5 * visits + 0.5 * visits @ member.transitions
    frames = visits * (member.durations @ np.arange(1, 401))
    np.testing.assert_allclose(member.occupancy(), frames / frames.sum(), atol=1e-10)


@pytest.mark.parametrize("coupling", [0.0, 0.4, 1.0])
def test_coupling_interpolates_emissions_between_marginal_and_gesture_distribution(member, coupling):
    emissions = member.emissions(coupling)
    np.testing.assert_allclose(member.occupancy() @ emissions, member.marginal(), atol=1e-12)
    expected = {0.0: np.tile(member.marginal(), (len(GESTURES), 1)), 1.0: member.coupled}
    if coupling in expected:
        np.testing.assert_allclose(emissions, expected[coupling], atol=1e-12)


def test_tables_match_their_schemas_and_contain_every_actor():
    members = [cast.member(actor, 5, FRAME_S, 10.0) for actor in ("ada", "deniz")]
    made = cast.tables(members, dict.fromkeys((m.actor for m in members), 0.8), FRAME_S)
    groups = {"initial": [], "transitions": ["from_gesture"], "emissions": ["gesture"], "durations": ["gesture"]}
    for name, table in made.items():
        tables.validate(table, name, name)
        sums = table.groupby(["actor", *groups[name]])["probability"].sum()
        np.testing.assert_allclose(sums, 1.0, atol=1e-12)
        assert list(table["actor"].unique()) == ["ada", "deniz"]
    one = made["emissions"].query("actor == 'deniz' and gesture == 'open' and prosody == 'p3'")
    expected = members[1].emissions(0.8)[GESTURES.index("open"), NAMES.index("p3")]
    assert one["probability"].item() == expected
    np.testing.assert_allclose(made["durations"]["duration_s"], made["durations"]["bin"] * FRAME_S)


def test_a_maximum_duration_shorter_than_gestures_is_rejected():
    with pytest.raises(UserError, match=r"max_duration_s is 1\.0 s.*allow at least 1\.6 s"):
        cast.member("ada", 1, FRAME_S, 1.0)
