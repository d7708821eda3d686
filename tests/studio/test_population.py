"""The virtual population: what is planted in it is there, and only that."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.studio.population import names, phones, planting, speakers
from cospeech.studio.population.settings import Settings, speaker_names

SEED = 7


def settings(**changes):
    usual = {
        "speakers": 6, "repetitions": 4, "others": 2, "shared": 0.7, "own_voice": 1.0, "own_lips": 1.0,
        "delay_ms": 40.0, "sessions": 2, "fps": 15.0, "film": False, "sound": False,
    }  # fmt: skip
    return Settings(**(usual | changes))


def articulated(chosen, seed=SEED):
    """Return what everyone says, in the order in which it is said."""
    everyone = speakers.population(chosen, seed)
    said = [one for speaker in everyone for one in speakers.utterances(everyone, speaker, chosen, seed)]
    return {one: planting.utter(one, everyone, chosen, seed) for one in said}


def test_names_are_different_and_spoken_with_known_phones():
    drawn = names.draw(names.MOST, SEED)
    assert len(set(drawn)) == names.MOST == 1600
    symbols = {phone for name in drawn for phone in phones.pronounced(name)}
    assert symbols <= set(phones.PHONES)


def test_symbols_of_the_synthesiser_are_known():
    assert [phones.known(symbol) for symbol in ("aː", "t͡ʃ", "ʃ", "qx", "")] == ["a", "tʃ", "ʃ", "ə", ""]


def test_the_clips_are_those_of_the_settings():
    chosen = settings()
    table = speakers.clips_table(articulated(chosen), None, chosen)
    tables.validate(table, "clips", "x")
    assert len(table) == 6 * (4 + 2)
    own = table[table["own_name"]]
    assert own.groupby("speaker").size().tolist() == [4] * 6
    assert own.groupby("speaker")["phrase"].nunique().tolist() == [1] * 6
    assert own["phrase"].nunique() == 6
    assert own[own["speaker"] == "s1"]["session"].tolist() == ["session1", "session1", "session2", "session2"]
    others = table[~table["own_name"]].merge(own[["speaker", "phrase"]].drop_duplicates(), on="speaker")
    assert (others["phrase_x"] != others["phrase_y"]).all()
    assert set(others["phrase_x"]) <= set(own["phrase"])
    assert speaker_names(100)[0] == "s001"


def test_articulators_reach_their_targets_where_nothing_else_is_near():
    slow = phones.Spoken(["a", "m", "u"], np.array([0.0, 1.0, 2.0, 3.0]))
    reached = phones.movement(slow, np.array([-1.0, 0.5, 1.5, 2.5, 9.0]))
    expected = phones.targets(["a", "a", "m", "u", "u"])
    np.testing.assert_allclose(reached, expected, atol=0.02)


def test_neighbours_colour_a_consonant_but_not_its_closure():
    edges_s = np.array([0.0, 0.1, 0.17, 0.27])
    middle = np.array([0.135])
    open_around = phones.movement(phones.Spoken(["a", "m", "a"], edges_s), middle)[0]
    round_around = phones.movement(phones.Spoken(["u", "m", "u"], edges_s), middle)[0]
    assert open_around[0] > round_around[0] + 0.1
    assert open_around[1] > round_around[1] + 0.2
    assert min(open_around[2], round_around[2]) > 0.8


def test_movements_are_continuous():
    utterance = phones.spoken("Ayşe Yılmaz", 1.0, np.random.default_rng(0))
    path = phones.movement(utterance, np.arange(0.0, utterance.duration_s, 0.001))
    assert np.abs(np.diff(path, axis=0)).max() < 0.06


def test_planted_tables_match_their_schemas():
    chosen = settings()
    one, how = next(iter(articulated(chosen).items()))
    lips = planting.lips_table(one.clip, planting.lips(one, how, chosen, SEED), chosen.fps)
    tables.validate(lips, "lips", "x")
    tables.validate(planting.phones_table(one.clip, how.heard), "phones", "x")
    assert [f"d{n}" for n in range(1, 51)] == [name for name in lips.columns if name.startswith("d")]


def test_the_lips_lead_by_the_planted_delay():
    one, how = next(iter(articulated(settings(shared=1.0, delay_ms=120.0)).items()))
    times_s = np.arange(0.0, how.heard.duration_s, 0.01)
    np.testing.assert_allclose(how.lips(times_s), how.voice(times_s + 0.12), atol=1e-12)
    assert one.own_name


@pytest.mark.parametrize("shared", [0.0, 0.25, 1.0])
def test_the_shared_part_is_the_planted_share_of_the_variance(shared):
    chosen = settings(shared=shared, delay_ms=0.0, speakers=12)
    seen, heard = [], []
    for how in articulated(chosen).values():
        times_s = np.arange(0.2, how.heard.duration_s - 0.2, 0.02)
        seen.append(how.lips(times_s))
        heard.append(how.voice(times_s))
    r = [
        np.corrcoef(one, other)[0, 1]
        for one, other in zip(np.concatenate(seen).T, np.concatenate(heard).T, strict=True)
    ]
    # The limits of the articulators take a part of the movement, and silence is shorter elsewhere.
    assert np.mean(r) == pytest.approx(np.sqrt(shared), abs=0.12)


def between_and_within(features, groups):
    """Return the ratio of the variance between groups to that within them, on average over features."""
    table = pd.DataFrame(features)
    return float((table.groupby(groups).mean().var() / table.groupby(groups).var().mean()).mean())


@pytest.mark.parametrize(("own", "features"), [("own_voice", planting.cepstra), ("own_lips", planting.lips)])
def test_what_is_of_its_own_tells_speakers_apart_and_is_not_there_at_zero(own, features):
    ratio = {}
    for amount in (0.0, 1.0):
        chosen = settings(**{own: amount}, sessions=1)
        said = articulated(chosen)
        # The phrases of impostors: they are not those of a speaker.
        means = [features(one, how, chosen, SEED).mean(axis=0) for one, how in said.items() if not one.own_name]
        ratio[amount] = between_and_within(means, [one.speaker.name for one in said if not one.own_name])
    assert ratio[1.0] > 1.3 * ratio[0.0]


def test_the_same_seed_gives_the_same_features_and_another_one_does_not():
    chosen = settings()

    def first(seed):
        one, how = next(iter(articulated(chosen, seed).items()))
        return planting.cepstra(one, how, chosen, seed)[:40], planting.lips(one, how, chosen, seed)[:5]

    for one, again, other in zip(first(1), first(1), first(2), strict=True):
        np.testing.assert_array_equal(one, again)
        assert np.abs(one - other).max() > 0.01
