"""The worlds: their processes follow the planted distributions, and the coupling is what it says."""

import hashlib
import itertools

import numpy as np
import pandas as pd
import pytest

from cospeech.data import segments, tables
from cospeech.data.rng import random_source
from cospeech.data.vocabulary import GESTURES
from cospeech.studio import arousal, scenes, script, subunits, syllables, worlds

FRAME_S, SEED, LONG_S = 0.025, 2012, 1800.0
WORLDS = ("vigour", "syllables", "all")
# The number of cells that are tested together is at most two hundred, and seeds are fixed.
FAR = 4.5


def scene(world, record="r", duration_s=60.0, coupling=0.8, seed=SEED, **own):
    someone = scenes.player("ada", world, seed, FRAME_S, 10.0)
    return scenes.write(someone, record, duration_s, worlds.couplings(world, coupling, own), FRAME_S, seed)


@pytest.fixture(scope="module")
def hours():
    """Scenes of half an hour at coupling 0, 0.5 and 1 of every world."""
    return {
        (world, coupling): scene(world, "long", LONG_S, coupling) for world in WORLDS for coupling in (0.0, 0.5, 1.0)
    }


def states(table):
    return np.array([arousal.STATES.index(label) for label in segments.to_labels(table)])


def test_the_world_of_phrases_is_what_it_was_before_there_were_others():
    planted = scene("phrases", "ada_1", 60.0, 0.8)
    assert planted.syllables is planted.spoken is planted.shown is planted.subunits is planted.delivery() is None
    columns = [planted.gestures[["start_frame", "label"]], planted.prosody[["start_frame", "label"]]]
    text = "".join(table.to_csv(index=False, lineterminator="\n") for table in columns)
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == "f008df88dc267e99"


def test_couplings_belong_to_the_parts_of_a_world():
    assert worlds.couplings("vigour", 0.3, {}) == (None, 0.3, None, None)
    assert worlds.couplings("all", 0.3, {"syllables": 1.0}) == (0.3, 0.3, 1.0, None)
    assert worlds.couplings("patterns", 0.3, {}, head=0.7) == (None, None, None, 0.3)
    assert worlds.couplings("phrases", 0.3, {}, head=0.7) == (0.3, None, None, 0.7)


@pytest.mark.parametrize("coupling", [0.0, 0.3, 1.0])
def test_coupling_is_the_share_of_time_in_which_the_body_listens(coupling):
    times_s = np.arange(0.0, 600.0, 0.5)
    shares = [
        worlds.listens(times_s, worlds.listening(600.0, coupling, random_source(k, "x"))).mean() for k in range(200)
    ]
    assert abs(np.mean(shares) - coupling) <= FAR * np.std(shares) / np.sqrt(len(shares))


@pytest.mark.parametrize("world", WORLDS)
def test_a_scene_is_complete_reproducible_and_matches_its_schemas(world):
    one, again, other = (scene(world, record) for record in ("a", "a", "b"))
    for name, (attribute, schema) in scenes.TABLES.items():
        table = getattr(one, attribute)
        if table is None:
            continue
        tables.validate(table, schema, name)
        pd.testing.assert_frame_equal(table, getattr(again, attribute))
        assert not table.drop(columns="record").equals(getattr(other, attribute).drop(columns="record"))
    for table in (one.gestures, one.prosody):
        segments.check(table, "a")
        assert table["end_frame"].iloc[-1] == 2400
    restored = scenes.of_record(scenes.tables([other, one]), "a")
    for name in ("gestures", "prosody", "syllables", "spoken", "shown", "subunits"):
        if getattr(one, name) is not None:
            pd.testing.assert_frame_equal(getattr(restored, name), getattr(one, name))


@pytest.mark.parametrize("world", WORLDS)
def test_what_is_planted_of_actors_matches_its_schemas(world):
    players = {actor: scenes.player(actor, world, SEED, FRAME_S, 10.0) for actor in ("ada", "deniz")}
    planted = scenes.truth(players, dict.fromkeys(players, worlds.couplings(world, 0.8, {})))
    assert ("arousal_states" in planted) == (world != "syllables")
    assert ("subunit_kinds" in planted) == (world != "vigour")
    for name, table in planted.items():
        tables.validate(table, name, name)
        assert set(table["actor"]) == {"ada", "deniz"}


def test_actors_of_different_worlds_share_tables_and_keep_their_own_scenes_and_couplings():
    """Each scene comes back from the union of the tables as it was, whatever the order of the worlds."""
    named = {
        world: scenes.player(f"in {world}", world, SEED, FRAME_S, 10.0) for world in ("phrases", *WORLDS, "patterns")
    }
    own = {world: worlds.couplings(world, 0.1 * k, {}) for k, world in enumerate(named)}
    written = {w: scenes.write(player, f"{w}_1", 60.0, own[w], FRAME_S, SEED) for w, player in named.items()}
    for order in itertools.islice(itertools.permutations(written), 0, None, 5):
        union = scenes.tables([written[world] for world in order])
        assert set(union) == set(scenes.TABLES)
        for world, one in written.items():
            restored = scenes.of_record(union, f"{world}_1")
            for attribute, _ in scenes.TABLES.values():
                expected, found = getattr(one, attribute), getattr(restored, attribute)
                assert (expected is None) == (found is None)
                if expected is not None:
                    pd.testing.assert_frame_equal(found, expected)
    planted = scenes.truth({f"in {world}": player for world, player in named.items()},
                           {f"in {world}": couplings for world, couplings in own.items()})  # fmt: skip
    states = planted["arousal_states"].groupby("actor")["coupling"].unique().map(list).to_dict()
    assert states == {"in vigour": [0.1], "in all": [pytest.approx(0.3)]}
    assert set(planted["subunit_kinds"]["actor"]) == {"in syllables", "in all"}


# Arousal


def test_arousal_spends_the_planted_share_of_time_in_each_state():
    own = arousal.model("ada", SEED, FRAME_S)
    counts = np.array(
        [np.bincount(arousal.process(own, 4800, FRAME_S, random_source(k, "x")), minlength=3) for k in range(400)]
    )
    shares = counts / 4800
    z = (shares.mean(axis=0) - own.share()) / (shares.std(axis=0) / np.sqrt(len(shares)))
    assert np.abs(z).max() < FAR
    assert own.share().sum() == pytest.approx(1.0)


def test_lags_are_whole_frames_in_their_range_and_differ_between_actors():
    lags = [arousal.model(actor, SEED, FRAME_S).lag_s for actor in "abcdefghijkl"]
    assert min(lags) >= 0.2 - 1e-9
    assert max(lags) <= 0.3 + 1e-9
    assert len(set(lags)) > 2
    np.testing.assert_allclose(np.array(lags) / FRAME_S, np.round(np.array(lags) / FRAME_S))


def test_hands_show_the_arousal_of_speech_earlier_by_the_lag(hours):
    lag = round(arousal.model("ada", SEED, FRAME_S).lag_s / FRAME_S)
    full = hours["vigour", 1.0]
    np.testing.assert_array_equal(states(full.shown)[:-lag], states(full.spoken)[lag:])


@pytest.mark.parametrize("coupling", [0.0, 0.5])
def test_states_agree_as_often_as_the_coupling_says(coupling):
    own = arousal.model("ada", SEED, FRAME_S)
    lag = round(own.lag_s / FRAME_S)
    agreement = []
    for k in range(80):
        spoken, shown = arousal.write(own, f"r{k}", 4800, coupling, FRAME_S, SEED)
        agreement.append((states(shown)[:-lag] == states(spoken)[lag:]).mean())
    expected = coupling + (1.0 - coupling) * (own.share() ** 2).sum()
    assert abs(np.mean(agreement) - expected) < FAR * np.std(agreement) / np.sqrt(len(agreement))


def test_the_form_of_gestures_does_not_depend_on_arousal(hours):
    """Gestures and arousal share no more information than gestures and the arousal at other times."""
    full = hours["vigour", 1.0]
    pd.testing.assert_frame_equal(full.gestures, hours["vigour", 0.0].gestures)
    forms = np.array([GESTURES.index(label) for label in segments.to_labels(full.gestures)])
    spoken = states(full.spoken)

    def information(shift):
        share = np.bincount(forms * 3 + np.roll(spoken, shift), minlength=21).reshape(7, 3) / len(forms)
        chance = share.sum(axis=1, keepdims=True) * share.sum(axis=0)
        return (share * np.log(np.maximum(share, 1e-12) / chance)).sum()

    wrong = [information(shift) for shift in range(2000, 70_000, 1700)]
    assert min(wrong) <= information(0) <= max(wrong)


# Syllables


def test_syllables_fill_the_speech_between_pauses_without_gaps():
    for k in range(8):
        planted = scene("all", f"r{k}", 40.0)
        own = planted.delivery().syllables
        starts, ends, peaks = (own[name].to_numpy() for name in ("start_s", "end_s", "peak_s"))
        assert ((starts < peaks) & (peaks < ends)).all()
        expected = syllables.stretches(planted.prosody)
        first = np.isin(starts.round(6), expected[:, 0].round(6))
        assert first.sum() == len(expected)
        np.testing.assert_allclose(starts[~first], ends[:-1][~first[1:]])
        np.testing.assert_allclose(ends[np.append(first[1:], True)], expected[:, 1])


def test_syllables_are_shorter_and_louder_in_excitement_and_vary_as_planted(hours):
    full = hours["all", 0.5]
    own = full.delivery().syllables
    for feature, probabilities in syllables.LEVELS.items():
        counts = own[feature].value_counts().reindex(syllables.FEATURES[feature]).to_numpy()
        expected = len(own) * np.array(probabilities)
        assert np.abs((counts - expected) / np.sqrt(expected * (1 - np.array(probabilities)))).max() < FAR
    at_peak = states(full.spoken)[(own["peak_s"] / FRAME_S).astype(int)]
    duration_s = own["end_s"] - own["start_s"]
    typical = [duration_s[at_peak == state].median() for state in range(3)]
    assert typical[0] / typical[1] == pytest.approx(arousal.SYLLABLE[0], rel=0.08)
    assert typical[2] / typical[1] == pytest.approx(arousal.SYLLABLE[2], rel=0.08)
    pitch_st, level_db = full.delivery().contours(full.prosody, own["peak_s"].to_numpy())
    for values in (pitch_st, level_db):
        assert np.all(np.diff([np.median(values[at_peak == state]) for state in range(3)]) > 1.0)
    spread = [np.std(pitch_st[at_peak == state]) for state in range(3)]
    assert spread[0] < spread[1] < spread[2]


# Subunits


def heard_and_moved(planted):
    heard = syllables.heard(planted.syllables)
    return heard, dict(list(planted.subunits.groupby("section")))


@pytest.mark.parametrize("world", ["syllables", "all"])
def test_strokes_start_at_peaks_and_end_at_or_before_peaks(hours, world):
    heard, moved = heard_and_moved(hours[world, 0.5])
    peaks_s = heard["peak_s"].to_numpy()
    for table in moved.values():
        start, stroke_end, end = (table[name].to_numpy() for name in ("start_s", "stroke_end_s", "end_s"))
        assert start[0] == 0.0
        assert end[-1] == LONG_S
        np.testing.assert_array_equal(start[1:], end[:-1])
        assert np.isin(start[1:], peaks_s).all()
        assert ((start < stroke_end) & (stroke_end <= end)).all()
        assert (end - stroke_end)[:-1].max() > 0.3  # a stroke that is not interrupted is followed by a hold


def decisions(stream, table, peaks_s):
    """Yield the kind, the elapsed share and whether the subunit goes on, at each peak where that is decided."""
    starts, kinds = table["start_s"].to_numpy(), table["subunit"].tolist()
    row = np.searchsorted(starts, peaks_s[1:], side="left") - 1
    for time_s, current in zip(peaks_s[1:], row, strict=True):
        kind = stream.kinds.index(kinds[current])
        ends = current + 1 < len(starts) and starts[current + 1] == time_s
        yield kind, (time_s - starts[current]) / stream.nominal_s[kind], not ends


@pytest.mark.parametrize("section", ["head", "arms", "legs"])
def test_subunits_go_on_with_the_planted_probability(hours, section):
    stream = subunits.streams("ada", "syllables", SEED)[section]
    heard, moved = heard_and_moved(hours["syllables", 0.5])
    found = np.array(list(decisions(stream, moved[section], heard["peak_s"].to_numpy())))
    kinds, elapsed, goes_on = found[:, 0].astype(int), found[:, 1], found[:, 2]
    for kind in range(len(stream.kinds)):
        for low, high in itertools.pairwise((0.0, 0.4, 0.6, 0.8, 1.0, 1.3)):
            here = (kinds == kind) & (elapsed >= low) & (elapsed < high)
            f = np.array([stream.goes_on(kind, share) for share in elapsed[here]])
            spread = np.sqrt((f * (1.0 - f)).sum())
            assert abs(goes_on[here].sum() - f.sum()) < FAR * spread + 1.0


@pytest.mark.parametrize("section", ["head", "arms", "legs"])
def test_the_next_subunit_depends_on_the_current_one_and_on_the_syllable_as_planted(hours, section):
    stream = subunits.streams("ada", "syllables", SEED)[section]
    table = heard_and_moved(hours["syllables", 0.5])[1][section]
    following, n = stream.following(), len(stream.kinds)
    np.testing.assert_allclose(following.sum(axis=-1), 1.0)
    codes = np.array([stream.kinds.index(kind) for kind in table["subunit"]])
    levels = [[syllables.FEATURES[name].index(level) for level in table[name][1:]] for name in syllables.FEATURES]
    chance = following[(*levels, codes[:-1])]  # (L, K): the probability of each next kind at each change
    counts, expected, variance = (np.zeros((4, 3, n)) for _ in range(3))
    taken = np.eye(n)[codes[1:]]
    for row, feature in enumerate([*levels, None]):
        for level in range(3) if feature is not None else (0,):
            here = np.array(feature) == level if feature is not None else np.full(len(taken), True)
            counts[row, level] = taken[here].sum(axis=0)
            expected[row, level] = chance[here].sum(axis=0)
            variance[row, level] = (chance[here] * (1.0 - chance[here])).sum(axis=0)
    assert (np.abs(counts - expected) <= FAR * np.sqrt(variance) + 1e-9).all()
    for current in range(n):
        here = codes[:-1] == current
        spread = np.sqrt((chance[here] * (1.0 - chance[here])).sum(axis=0))
        assert (np.abs(taken[here].sum(axis=0) - chance[here].sum(axis=0)) < FAR * spread + 1e-9).all()


def test_the_conditional_probabilities_are_those_of_the_formula():
    """A brute-force check of T_ij times the weights of three features, normalised."""
    stream = subunits.streams("deniz", "all", 3)["arms"]
    following = stream.following()
    for a, b, c, i in itertools.product(range(3), range(3), range(3), range(len(stream.kinds))):
        products = [
            stream.transitions[i, j] * stream.weights[0, j, a] * stream.weights[1, j, b] * stream.weights[2, j, c]
            for j in range(len(stream.kinds))
        ]
        np.testing.assert_allclose(following[a, b, c, i], np.array(products) / sum(products))


def test_the_body_follows_its_own_speech_where_it_listens(hours):
    for world in ("syllables", "all"):
        for coupling, sources in ((0.0, {"other"}), (1.0, {"own"})):
            planted = hours[world, coupling].syllables
            assert set(planted.loc[planted["followed"], "source"]) == sources
    half = hours["syllables", 0.5].syllables
    share = half.loc[half["source"] == "own", "followed"].mean()
    assert share == pytest.approx(0.5, abs=0.12)  # 300 spans


def test_at_coupling_0_subunits_and_own_syllables_are_independent(hours):
    """No more subunits start at the peaks of syllables than at those of another time; at coupling 1, all do."""

    def meetings(planted, shift_s=0.0):
        own = planted.syllables.query("source == 'own'")["peak_s"].to_numpy()
        starts = planted.subunits.query("section == 'arms'")["start_s"].to_numpy()[1:]
        edges = np.sort((own + shift_s) % LONG_S)
        row = np.clip(np.searchsorted(edges, starts), 1, len(edges) - 1)
        return (np.minimum(np.abs(edges[row] - starts), np.abs(edges[row - 1] - starts)) < 0.02).mean()

    free, tight = hours["syllables", 0.0], hours["syllables", 1.0]
    wrong = [meetings(free, shift_s) for shift_s in np.linspace(60.0, 1700.0, 60)]
    assert min(wrong) <= meetings(free) <= max(wrong)
    assert meetings(tight) == 1.0


def test_subunits_of_the_arms_are_the_gesture_phrases_or_the_beats_within_them(hours):
    forms = hours["syllables", 0.5]
    arms = forms.subunits.query("section == 'arms'")
    at_middle = segments.at_times(forms.gestures, (arms["start_s"] + arms["end_s"]) / 2)
    np.testing.assert_array_equal(forms.gestures["label"].to_numpy()[at_middle], arms["subunit"])
    both = hours["all", 0.5]
    assert set(both.subunits.query("section == 'arms'")["subunit"]) == set(subunits.BEATS)
    own = scenes.player("ada", "all", SEED, FRAME_S, 10.0).member
    expected = script.write(own, "long", LONG_S, 0.5, FRAME_S, SEED)[0]
    pd.testing.assert_frame_equal(both.gestures, expected)


def test_phrases_that_subunits_form_have_a_counted_model():
    own = scenes.player("ada", "syllables", SEED, FRAME_S, 10.0)
    counted = scenes.gesture_model(own, 10.0, FRAME_S, SEED)
    np.testing.assert_allclose(counted.transitions.sum(axis=1), 1.0)
    np.testing.assert_allclose(counted.durations.sum(axis=1), 1.0)
    assert np.diag(counted.transitions).max() == 0.0  # beats of one kind are one phrase
    np.testing.assert_allclose(counted.emissions(0.0), np.tile(own.member.marginal(), (len(GESTURES), 1)))
    planted = scenes.player("ada", "all", SEED, FRAME_S, 10.0)
    assert scenes.gesture_model(planted, 10.0, FRAME_S, SEED) is planted.member
