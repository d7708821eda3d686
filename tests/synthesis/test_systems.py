"""Every system covers its record, keeps to what it may know, and does what its name says."""

import numpy as np
import pandas as pd
import pytest
from cospeech.synthesis.fold import Fold, fold
from coupled_actor import FRAME_S, Actor, corpus

from cospeech.data import segments, tables
from cospeech.markov import hsmm as semi
from cospeech.synthesis import (
    another,
    clock,
    hsmm,
    hsmm_sampled,
    hsmm_weighted,
    majority,
    oracle,
    prior,
    random_phrases,
    systems,
    wrong_speech,
)
from cospeech.synthesis.speech import frame_labels, heard

SEED = 2012
HOW = hsmm.Estimate(segments.GESTURES, 8, 10.0, 1e-6, "none", 1.0)


class Case:
    """A fold of four records of 40 s, its model and its speech."""

    def __init__(self):
        self.gestures, self.prosody = corpus(3, 4, 40.0, 0.8)
        self.fold = fold("r1", self.gestures, self.prosody, FRAME_S)
        self.labels = frame_labels(self.prosody)
        self.model = hsmm.train(hsmm.counts(self.fold, HOW).values(), HOW)
        self.speech = heard(self.labels, "r1", FRAME_S)

    def everything(self, censoring="none", seed=SEED):
        """What every system makes, by name."""
        made = {
            "hsmm": hsmm.synthesise(self.model, self.speech, censoring=censoring),
            "hsmm_weighted": hsmm.synthesise(self.model, self.speech, 0.25, censoring),
            "hsmm_sampled": hsmm_sampled.synthesise(self.model, self.speech, 0.25, censoring, seed),
            "random": random_phrases.synthesise(self.fold, seed),
            "prior": prior.synthesise(self.model, self.speech, censoring),
            "clock": clock.synthesise(self.fold),
            "majority": majority.synthesise(self.fold),
            "another": another.synthesise(self.fold, ["r0", "r1", "r2", "r3"]),
        }
        for name, system in systems(studio=False).items():
            if system.drive != "own":
                speech = heard(self.labels, "r1", FRAME_S, system.drive, seed, 5.0)
                made[name] = wrong_speech.synthesise(system, self.model, speech, 0.25, censoring, seed)
        return made


@pytest.fixture(scope="module")
def case():
    return Case()


def test_all_systems_cover_the_record_and_say_how(case, tmp_path):
    made = case.everything()
    assert set(made) == set(systems(studio=False))
    for name, (phrases, decoding) in made.items():
        segments.check(phrases, name)
        assert phrases["end_frame"].iloc[-1] == case.fold.n_frames
        assert set(phrases["record"]) == {"r1"}
        tables.write(phrases, tmp_path / name / "phrases.parquet", "segments", corpus="virtual", config_hash="0")
        tables.write(decoding, tmp_path / name / "decoding.parquet", "decoding", corpus="virtual", config_hash="0")
        read = tables.read(tmp_path / name / "decoding.parquet", "decoding")
        assert read["record"].tolist() == ["r1"]
        has_model = name not in ("random", "clock", "majority", "another")
        assert read["log_score"].notna().all() == has_model
        assert read["driving_record"].notna().all() == (has_model and name != "prior")


@pytest.mark.parametrize("censoring", ["none", "right"])
def test_every_score_can_be_had_from_the_tables_again(case, censoring):
    model_tables = semi.to_tables(case.model, FRAME_S, HOW.floor)
    checked = 0
    for name, (phrases, decoding) in case.everything(censoring).items():
        row = decoding.iloc[0]
        if row["log_score"] is None:
            continue
        observed = case.speech.labels
        if systems(studio=False)[name].drive != "own":
            source = case.labels[row["driving_record"]]
            observed = np.resize(np.roll(source, -round(row["shift_s"] / FRAME_S)), case.fold.n_frames)
        score = semi.path_score(model_tables, phrases, observed, row["emission_weight"], row["censoring"])
        assert score == pytest.approx(row["log_score"], abs=1e-9)
        assert row["censoring"] == censoring
        checked += 1
    assert checked == 10


def test_the_best_path_is_worth_more_than_what_others_make_of_the_same_speech(case):
    made = case.everything()
    model_tables = semi.to_tables(case.model, FRAME_S)

    def worth(name, weight):
        return semi.path_score(model_tables, made[name].phrases, case.speech.labels, weight)

    others = ("hsmm_weighted", "hsmm_sampled", "random", "prior", "shuffled", "shifted", "clock")
    assert all(worth("hsmm", 1.0) > worth(name, 1.0) for name in others)
    assert all(worth("prior", 0.0) > worth(name, 0.0) for name in ("hsmm", "hsmm_sampled", "random", "clock"))


def test_the_same_seed_gives_the_same_phrases_and_another_gives_others(case):
    one, two, other = case.everything(), case.everything(), case.everything(seed=1)
    for name in one:
        pd.testing.assert_frame_equal(one[name].phrases, two[name].phrases)
        pd.testing.assert_frame_equal(one[name].decoding, two[name].decoding)
    for name in ("random", "hsmm_sampled", "shifted", "hsmm_sampled_shifted"):
        assert not one[name].phrases.equals(other[name].phrases)
    for name in ("hsmm", "prior", "clock", "majority", "another"):
        assert one[name].phrases.equals(other[name].phrases)


def test_prior_hears_nothing(case):
    speech = case.speech._replace(labels=case.speech.labels[::-1].copy())
    assert prior.synthesise(case.model, speech, "none").phrases.equals(
        prior.synthesise(case.model, case.speech, "none").phrases
    )


def test_random_phrases_are_phrases_of_the_pool(case):
    phrases = random_phrases.synthesise(case.fold, SEED).phrases
    pool = {
        (row.label, row.end_frame - row.start_frame)
        for table in case.fold.gestures.values()
        for row in table.itertuples()
    }
    drawn = [(row.label, row.end_frame - row.start_frame) for row in phrases.itertuples()]
    assert set(drawn[:-1]) <= pool  # the last one is cut


# ---------------------------------------------------------------- by hand


def small_fold(n_frames, **streams):
    """A fold of records whose phrases are the runs of letters."""
    return Fold(
        record="held",
        n_frames=n_frames,
        frame_s=FRAME_S,
        gestures={name: segments.from_labels(name, list(text), 1 / FRAME_S) for name, text in streams.items()},
        speech={name: np.full(len(text), "p1", dtype=object) for name, text in streams.items()},
    )


def spelled(made):
    return "".join(segments.to_labels(made.phrases))


def test_clock_votes_at_each_share_of_the_time():
    # at the shares of 8 frames: rrrrlloo, rrllllll, llllllll; of four frames of record c each is two of eight
    known = small_fold(8, a="rrrrlloo", b="rrllllll", c="llll")
    assert spelled(clock.synthesise(known)) == "rrllllll"
    # one vote each at first and in the end, where r and o have more frames than their rival
    assert spelled(clock.synthesise(small_fold(4, a="rrro", b="orrl"))) == "rrro"


def test_majority_is_one_phrase_of_the_most_frequent_label():
    made = majority.synthesise(small_fold(5, a="rrrl", b="llrl"))
    assert made.phrases["label"].tolist() == ["l"]  # four frames each: the first by name
    assert majority.synthesise(small_fold(5, a="rrrl", b="rl")).phrases["label"].tolist() == ["r"]


def test_another_is_the_next_record_cut_or_continued():
    known = small_fold(7, a="rrll", c="ooor", d="lr")
    order = ["a", "held", "c", "d"]
    made = another.synthesise(known, order)
    assert spelled(made) == "ooorlrr"  # c, then d, then a
    assert made.phrases["start_frame"].tolist() == [0, 3, 4, 5, 6]  # records stay apart: r of d, r of a
    assert spelled(another.synthesise(small_fold(3, c="ooor", a="rrll"), order)) == "ooo"
    assert spelled(another.synthesise(small_fold(5, a="rl"), ["a", "held"])) == "rlrlr"


def test_of_equal_weights_the_largest_wins_and_one_record_chooses_nothing():
    gestures, prosody = corpus(3, 3, 30.0, 0.8)
    mute = prosody.assign(label="p1")  # speech without a difference: every weight gives one path
    known = fold("r0", gestures, mute, FRAME_S)
    counted = hsmm.counts(known, HOW)
    assert hsmm_weighted.choose_weight(known, counted, HOW, [0.1, 0.5, 0.2], "none") == 0.5
    alone = fold("r0", gestures[gestures["record"] != "r1"], prosody, FRAME_S)
    assert hsmm_weighted.choose_weight(alone, hsmm.counts(alone, HOW), HOW, [0.1, 0.5, 0.2], "none") == 0.5


def test_a_record_of_one_gesture_and_a_record_of_one_sound_go_through():
    gestures, prosody = corpus(3, 3, 30.0, 0.8)
    still = pd.concat(
        [segments.from_starts(name, [0], ["rest"], 1200, 1 / FRAME_S) for name in ("r0", "r1", "r2")],
        ignore_index=True,
    )
    silent = prosody.assign(label="p3")
    for g, p in ((still, prosody), (gestures, silent), (still, silent)):
        known = fold("r0", g, p, FRAME_S)
        counted = hsmm.counts(known, HOW)
        model = hsmm.train(counted.values(), HOW)
        weight = hsmm_weighted.choose_weight(known, counted, HOW, [0.2, 1.0], "none")
        speech = heard(frame_labels(p), "r0", FRAME_S)
        for made in (
            hsmm.synthesise(model, speech, weight),
            hsmm_sampled.synthesise(model, speech, weight, "right", SEED),
            random_phrases.synthesise(known, SEED),
            clock.synthesise(known),
        ):
            segments.check(made.phrases, "made")
            assert made.phrases["end_frame"].iloc[-1] == 1200


# ---------------------------------------------------------------- oracle


def test_the_oracle_decodes_planted_prosody_with_planted_parameters():
    actor = Actor(3)
    gestures, prosody = corpus(3, 4, 40.0, 0.8)
    bins = np.arange(1, 401)
    planted = semi.SemiMarkov(
        segments.GESTURES,
        segments.prosody_labels(8),
        actor.initial,
        actor.transitions,
        0.2 * actor.patterns + 0.8 * actor.own_patterns,
        np.exp(-0.5 * ((bins * FRAME_S - actor.mean_s[:, None]) / 0.5) ** 2),
    )
    planted = semi.floored(planted, 0.0)
    truth = {
        name: pd.concat([table.assign(actor="somebody"), table.assign(actor="ada")], ignore_index=True)
        for name, table in semi.to_tables(planted, FRAME_S).items()
    }
    model = oracle.planted_model(truth, "ada", 1e-6)
    assert model.durations.min() >= 0.9e-6
    np.testing.assert_allclose(model.transitions, planted.transitions, atol=1e-5)
    found = pd.concat(  # the sound's prosody frames are one fewer than the script's
        [segments.from_starts(name, [0], ["p1"], 1599, 1 / FRAME_S) for name in ("r0", "r1", "r2", "r3")]
    )
    heard_by_oracle = oracle.planted_prosody(prosody, found, FRAME_S)
    assert heard_by_oracle.groupby("record")["end_frame"].max().tolist() == [1599] * 4
    known = fold("r1", gestures, heard_by_oracle, FRAME_S)
    weights = (0.05, 0.2, 1.0)
    weight = oracle.choose_weight(known, model, weights, "none")
    assert weight in weights
    made = hsmm.synthesise(model, heard(frame_labels(heard_by_oracle), "r1", FRAME_S), weight)
    assert made.phrases["end_frame"].iloc[-1] == 1599
    actual = segments.resample(gestures[gestures["record"] == "r1"], 1599, 1 / FRAME_S)
    right = segments.to_labels(made.phrases) == segments.to_labels(actual)
    assert right.mean() > 0.3  # seven classes: chance is 0.18
