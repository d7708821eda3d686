"""Sessions, strategies and controls on planted populations, whose voice and lips share something or do not."""

import numpy as np
import pandas as pd
import planted_population as planted
import pytest

from cospeech.errors import UserError
from cospeech.identity import classifiers, controls, enrolment, sessions, strategies, verification
from cospeech.identity.classifiers import Settings
from cospeech.identity.controls import CONTROLS, PAIRED
from cospeech.identity.strategies import Dimension
from cospeech.identity.verification import Bootstrap
from cospeech.metrics import equal_error

SMALL = Settings(states=4, iterations=6)


def rates(shared, seeds, conditions=()):
    """Mean equal error rates in percent, by condition and strategy."""
    found = []
    for seed in seeds:
        given = planted.population(seed, shared, nuisance=0.9, own=0.7)
        tables = []
        for session in sessions.sessions(given.clips)[:2]:
            scored, _ = strategies.of_session(given, session, SMALL, [0.15], conditions, 0.0, seed)
            tables += [strategies.trials(given, session, one) for one in scored]
        every = pd.concat(tables).groupby(["condition", "strategy"])
        found.append(
            {key: 100 * equal_error.equal_error(verification.of_table(own), "usual").rate for key, own in every}
        )
    return pd.DataFrame(found).mean()


def test_the_order_of_table_2_2_appears_where_a_shared_part_is_planted():
    found = rates(True, range(3), ["whitened"])
    order = ["audio", "audio + concatenated", "audio + lips", "audio + canonical"]
    assert (np.diff([found[PAIRED, name] for name in order]) < 0).all()
    assert found[PAIRED, "canonical"] < found[PAIRED, "concatenated"]
    assert found[PAIRED, "audio + canonical"] < found["whitened", "audio + canonical"]


def test_the_order_of_table_2_2_disappears_where_none_is_planted():
    found = rates(False, range(3), ["whitened"])
    assert found[PAIRED, "audio + canonical"] > found[PAIRED, "audio + lips"]
    assert found[PAIRED, "canonical"] > found[PAIRED, "concatenated"]
    assert found[PAIRED, "audio + canonical"] > found["whitened", "audio + canonical"]


@pytest.fixture(scope="module")
def given():
    return planted.population(1, True, speakers=5, repetitions=6, others=2)


def test_sessions_train_on_each_half_of_two_partitions(given):
    found = sessions.sessions(given.clips)
    own = given.clips["own_name"].to_numpy()
    assert [one.name for one in found] == ["1", "2", "3", "4"]
    for one, other in (found[:2], found[2:]):
        tested = one.test[own[one.test]]
        np.testing.assert_array_equal(np.sort(one.train), np.sort(other.test[own[other.test]]))
        assert not set(one.train) & set(one.test)
        assert sorted([*one.train, *tested]) == np.flatnonzero(own).tolist()
        assert (np.bincount(one.owner) == 3).all()
    assert set(found[0].train) != set(found[2].train) != set(found[1].train)
    for one in found:
        assert set(np.flatnonzero(~own)) <= set(one.test)
        assert [one.speakers[k] for k in one.owner] == given.clips["speaker"].iloc[one.train].tolist()


def test_a_speaker_with_one_repetition_is_left_out_and_named(given):
    clips = given.clips[~((given.clips["speaker"] == "s02") & (given.clips["repetition"] > 0))]
    assert "s02" not in sessions.registered(clips)
    assert "speaker 's02' has a single repetition" in verification.lacking(clips)[0]
    alone = clips[clips["speaker"].isin(["s02"])]
    with pytest.raises(UserError, match="0 speakers have two repetitions"):
        sessions.sessions(alone)


def test_speakers_without_impostors_are_named(given):
    clips = given.clips[given.clips["own_name"] | (given.clips["phrase"] != "name03")]
    assert verification.lacking(clips) == ["speaker 's03' has no impostors: nobody else says this name; add a clip"]
    assert "no clip is that of an impostor" in verification.lacking(given.clips[given.clips["own_name"]])[0]


def test_weak_classifiers_equal_concatenation_with_one_state(given):
    """With one state there is no alignment to disagree about, and Gaussians of diagonal covariance factorise."""
    session = sessions.sessions(given.clips)[0]
    pairs = controls.paired(given, session.train, 0.0)
    one_state, training = Settings(states=1, variance_floor=1e-6), given.chosen(session.train)
    wanted = [Dimension(0.0, n) for n in (1, 4, 12)]
    fusion = strategies.train_fusion(training, pairs, wanted, session.owner, 5, one_state)
    for by in strategies.fusion_ratios(given.chosen(session.test), fusion):
        np.testing.assert_allclose(by["weak"], by["canonical"], rtol=1e-8, atol=1e-8)


def test_the_product_rule_adds_log_ratios_of_each_classifier(given):
    session = sessions.sessions(given.clips)[0]
    training, tested = given.chosen(session.train), given.chosen(session.test)
    ratios = strategies.plain_ratios(tested, strategies.train_plain(training, session.owner, 5, SMALL))
    both = strategies.product_rule(ratios, ("audio", "lips"))
    np.testing.assert_allclose(both, ratios["audio"] + ratios["lips"])
    models = classifiers.train(training.stream(training.audio), session.owner, 5, SMALL)
    np.testing.assert_allclose(ratios["audio"], classifiers.log_ratios(models, tested.stream(tested.audio)))


def test_scoring_in_parts_changes_nothing(given, monkeypatch):
    session = sessions.sessions(given.clips)[0]
    whole, _ = strategies.of_session(given, session, SMALL, [0.0, 0.3], [], 0.0, 1)
    monkeypatch.setattr(strategies, "ABREAST", 7)
    parts, _ = strategies.of_session(given, session, SMALL, [0.0, 0.3], [], 0.0, 1)
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(one.best, other.best)
        np.testing.assert_allclose(one.score, other.score, rtol=1e-9)


def test_controls_train_on_what_they_say(given):
    clip = int(np.flatnonzero(given.clips["own_name"])[3])
    own = controls._own(given, clip)
    scrambled = controls.WRONG_LIPS["scrambled"](given, clip, 1)
    np.testing.assert_allclose(np.sort(scrambled, axis=0), np.sort(own, axis=0))
    noise = controls.WRONG_LIPS["noise"](given, clip, 1)
    np.testing.assert_allclose(np.abs(np.fft.rfft(noise, axis=0)), np.abs(np.fft.rfft(own, axis=0)), atol=1e-9)
    np.testing.assert_allclose(np.cov(noise.T), np.cov(own.T), atol=1e-9)
    for name, wrong in controls.WRONG_LIPS.items():
        found = wrong(given, clip, 1)
        assert found.shape == own.shape, name
        assert abs(np.corrcoef(found.ravel(), own.ravel())[0, 1]) < 0.9, name
    for name in ("another speaker", "another name"):
        lips = controls.WRONG_LIPS[name](given, clip, 1)
        same, differs = ("phrase", "speaker") if name == "another speaker" else ("speaker", "phrase")
        fits = (given.clips[same] == given.clips[same].iloc[clip]) & (
            given.clips[differs] != given.clips[differs].iloc[clip]
        )
        sources = [controls.stretched(controls._own(given, k), len(own)) for k in np.flatnonzero(fits)]
        assert any(np.array_equal(lips, source) for source in sources)


def test_every_control_has_as_many_parameters(given):
    session = sessions.sessions(given.clips)[0]
    scored, correlations = strategies.of_session(given, session, SMALL, [0.1], CONTROLS, 0.0, 1)
    fused = [one for one in scored if one.strategy == "weak"]
    assert [one.condition for one in fused] == [PAIRED, *CONTROLS]
    assert {one.dimension.pairs for one in fused} == {int((correlations > 0.1).sum())}


def test_a_control_without_clips_is_left_out(given):
    alone = given.chosen(np.flatnonzero(given.clips["own_name"]))
    session = sessions.sessions(alone.clips)[0]
    scored, _ = strategies.of_session(alone, session, SMALL, [0.1], ["another name"], 0.0, 1)
    assert {one.condition for one in scored} == {PAIRED}


def test_equal_error_rates_have_a_row_per_session_and_for_all(given):
    tables = []
    for session in sessions.sessions(given.clips):
        scored, _ = strategies.of_session(given, session, SMALL, [0.0], [], 0.0, 1)
        tables += [strategies.trials(given, session, one) for one in scored]
    trials = pd.concat(tables, ignore_index=True)
    found = verification.equal_error_rates(trials, given.clips, Bootstrap(50, 0.95, 1))
    assert len(found) == 5 * 2 * 11
    own = found[(found["strategy"] == "audio") & (found["rates"] == "usual")]
    audio = trials[trials["strategy"] == "audio"]
    for name, value in zip(own["session"], own["eer_pct"], strict=True):
        part = audio if name is None or name != name else audio[audio["session"] == name]
        assert value == pytest.approx(100 * equal_error.equal_error(verification.of_table(part), "usual").rate)
    known = found.dropna(subset=["low"])
    assert (known["low"] <= known["high"]).all()


def test_an_enrolled_model_survives_its_tables_and_knows_its_speakers():
    given = planted.population(1, True, speakers=5, repetitions=6, others=2, own=1.0)
    model = enrolment.enrol(given, 0, SMALL, 0.1)
    again = enrolment.from_tables(enrolment.to_tables(model))
    threshold = enrolment.threshold(model, 0.1)
    assert threshold == enrolment.threshold(again, 0.1)
    found = enrolment.identify(model, given, threshold)
    assert found == enrolment.identify(again, given, threshold)
    own = given.clips["own_name"].to_numpy()
    speakers = given.clips["speaker"].tolist()
    right = [one.accepted and one.speaker == speaker for one, speaker in zip(found, speakers, strict=True)]
    assert np.mean(np.array(right)[own]) > 0.9
    assert np.mean([one.accepted for one, client in zip(found, own, strict=True) if not client]) <= 0.1


def test_a_false_accept_rate_beyond_the_trials_is_refused(given):
    model = enrolment.enrol(given, 0, SMALL, 0.1)
    with pytest.raises(UserError, match=r"rate of 0.1 % cannot be reached with 10 trials of impostors; choose 10 %"):
        enrolment.threshold(model, 0.001)
    with pytest.raises(UserError, match="no clip is that of an impostor"):
        enrolment.enrol(given.chosen(np.flatnonzero(given.clips["own_name"])), 0, SMALL, 0.1)
