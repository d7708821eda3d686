"""Every system covers its record, learns from nothing else than its training data, and does what its name says."""

import inspect

import numpy as np
import pandas as pd
import pytest
from coupled_actor import FRAME_S, PATTERNS, CoupledActor, corpus
from hypothesis import given
from hypothesis import strategies as st
from one_fold import (
    ACTOR,
    HELD_OUT,
    MOTION_FPS,
    N_FRAMES,
    RECORDS,
    SEED,
    SHARED,
    all_systems,
    prosody_tables,
    truth_of,
)
from path_score import score_by_rows

from cospeech.data import segments, tables
from cospeech.data.vocabulary import GESTURES
from cospeech.errors import UserError
from cospeech.markov import hsmm
from cospeech.motion import skeleton
from cospeech.synthesis.hsmm import model as hsmm_model
from cospeech.synthesis.interface import Method, Speech, Training
from cospeech.synthesis.session import Driving, Session, Trained, method_of, synthesise
from cospeech.synthesis.speech import Streams, Wrong
from cospeech.synthesis.training import fold

SYSTEMS = all_systems()
TOYS = ("toy_habits", "toy_lift")
CLOSED = ("random", "clock", "majority", "another")
"""Systems without an HSMM."""


@pytest.fixture(scope="module")
def made(one_fold):
    return one_fold.everything(SYSTEMS)


@pytest.fixture(scope="module")
def model_tables(one_fold):
    return one_fold.session().tables(SYSTEMS["hsmm"])


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_system_covers_the_record_and_says_how(made, tmp_path, name):
    phrases, decoding = made[name].phrases, made[name].decoding
    segments.check(phrases, name)
    assert phrases["end_frame"].iloc[-1] == N_FRAMES
    assert set(phrases["record"]) == {HELD_OUT}
    assert set(phrases["label"]) <= set(GESTURES)
    tables.write(phrases, tmp_path / "phrases.parquet", "segments", corpus="virtual", config_hash="0")
    tables.write(decoding, tmp_path / "decoding.parquet", "decoding", corpus="virtual", config_hash="0")
    read = tables.read(tmp_path / "decoding.parquet", "decoding")
    assert read["record"].tolist() == [HELD_OUT]
    assert read["failure"].isna().all()
    assert read["log_score"].notna().all() == (name not in CLOSED)
    assert read["driving_record"].notna().all() == (name not in (*CLOSED, "prior"))


@pytest.mark.parametrize("censoring", ["none", "right"])
def test_every_score_can_be_recomputed_from_the_tables(one_fold, censoring):
    session = one_fold.session(censoring=censoring)
    checked = []
    for name, one in one_fold.everything(SYSTEMS, censoring=censoring).items():
        row = one.decoding.iloc[0]
        if row["log_score"] is None:
            continue
        streams = one_fold.streams.planted if name == "oracle" else one_fold.streams.labels
        source = streams[row["driving_record"] or HELD_OUT]
        observed = np.resize(np.roll(source, -round((row["shift_s"] or 0.0) / FRAME_S)), N_FRAMES)
        found = session.tables(SYSTEMS[name])
        score = score_by_rows(found, one.phrases, observed, row["emission_weight"], row["censoring"])
        assert score == pytest.approx(row["log_score"], abs=1e-9)
        assert row["censoring"] == censoring
        checked.append(name)
    assert checked == [name for name in SYSTEMS if name not in CLOSED]
    assert len(checked) == 11


def test_the_best_path_scores_higher_than_the_paths_of_other_systems_on_the_same_speech(one_fold, made, model_tables):
    def score(name, weight):
        return score_by_rows(model_tables, made[name].phrases, one_fold.streams.labels[HELD_OUT], weight)

    others = ("hsmm_weighted", "hsmm_sampled", "random", "prior", "shuffled", "shifted", "clock")
    assert all(score("hsmm", 1.0) > score(name, 1.0) for name in others)
    assert all(score("prior", 0.0) > score(name, 0.0) for name in ("hsmm", "hsmm_sampled", "random", "clock"))
    assert score("hsmm_weighted", 0.25) > score("hsmm_sampled", 0.25)


def test_equal_seeds_give_equal_phrases_and_another_seed_gives_others(one_fold, made):
    again, other = one_fold.everything(SYSTEMS), one_fold.everything(SYSTEMS, seed=1)
    for name in SYSTEMS:
        pd.testing.assert_frame_equal(made[name].phrases, again[name].phrases)
        pd.testing.assert_frame_equal(made[name].decoding, again[name].decoding)
    for name in ("random", "hsmm_sampled", "shifted", "hsmm_sampled_shifted"):
        assert not made[name].phrases.equals(other[name].phrases)
    for name in ("hsmm", "hsmm_weighted", "prior", "clock", "majority", "another", "oracle"):
        assert made[name].phrases.equals(other[name].phrases)


@pytest.mark.parametrize("name", [name for name, system in SYSTEMS.items() if system.drive != "own"])
def test_a_matched_control_is_its_system_on_the_wrong_speech(one_fold, made, name):
    control, session, driving = SYSTEMS[name], one_fold.session(), one_fold.driving()
    method, model = session.trained(SYSTEMS[control.decoder])
    speech = driving.speeches(control)[0]
    assert speech.driving_record == HELD_OUT if control.drive == "shifted" else speech.driving_record != HELD_OUT
    assert not np.array_equal(speech.labels, one_fold.streams.labels[HELD_OUT])
    pd.testing.assert_frame_equal(method.synthesise(model, speech, SEED).phrases, made[name].phrases)


def test_controls_of_all_decoders_are_driven_by_the_same_wrong_speech(made):
    for drive in ("shuffled", "shifted"):
        rows = [made[name].decoding for name, system in SYSTEMS.items() if system.drive == drive]
        assert len(rows) == 3
        assert len({(row["driving_record"].iloc[0], row["shift_s"].iloc[0]) for row in rows}) == 1


@pytest.mark.parametrize("name", ["prior", "random", "clock", "majority", "another"])
def test_controls_without_speech_depend_on_its_length_only(one_fold, made, name):
    method, model = one_fold.session().trained(SYSTEMS[name])
    speech = one_fold.driving().speeches(SYSTEMS[name])[0]
    reversed_speech = Speech(HELD_OUT, FRAME_S, N_FRAMES, labels=speech.labels[::-1].copy())
    assert method.synthesise(model, reversed_speech, SEED).phrases.equals(made[name].phrases)


def test_random_phrases_are_phrases_of_the_training_records(one_fold, made):
    pool = {
        (row.label, row.end_frame - row.start_frame)
        for table in one_fold.training.gestures.values()
        for row in table.itertuples()
    }
    drawn = [(row.label, row.end_frame - row.start_frame) for row in made["random"].phrases.itertuples()]
    assert set(drawn[:-1]) <= pool  # the last one is cut


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_module_of_every_system_is_a_method(name):
    method = method_of(SYSTEMS[name])
    for function in ("train", "synthesise", "to_tables", "from_tables"):
        expected = list(inspect.signature(getattr(Method, function)).parameters)[1:]
        assert list(inspect.signature(getattr(method, function)).parameters) == expected


# ---------------------------------------------------------------- models as tables


def reread(found, schemas, folder):
    """The tables of a model, written to files and read again."""
    for name, table in found.items():
        tables.write(table, folder / f"{name}.parquet", schemas[name], corpus="virtual", config_hash="0")
    return {name: tables.read(folder / f"{name}.parquet", schemas[name]) for name in found}


def check_round_trip(one_fold, system, folder):
    session, driving = one_fold.session(), one_fold.driving()
    method, model = session.trained(system)
    found = session.tables(system)
    assert set(found) == set(system.tables)
    assert not {f"{name}.parquet" for name in found} & {"phrases.parquet", "decoding.parquet", "motion.parquet"}
    read = method.from_tables(reread(found, system.table_schemas, folder / "first"))
    twice = reread(method.to_tables(read), system.table_schemas, folder / "second")
    assert set(twice) == set(found)
    for name in found:
        assert (folder / f"first/{name}.parquet").read_bytes() == (folder / f"second/{name}.parquet").read_bytes()
    speech = driving.speeches(system)[0]
    for seed in (SEED, 1):
        before, after = (synthesise(system, Trained(method, one), speech, seed) for one in (model, read))
        for one, other in zip(before, after, strict=True):
            assert (one is None) == (other is None)
            if one is not None:
                pd.testing.assert_frame_equal(one, other)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_model_survives_its_tables_and_synthesises_the_same(one_fold, tmp_path, name):
    check_round_trip(one_fold, SYSTEMS[name], tmp_path)


def test_so_does_a_model_of_another_package_whose_schemas_lie_in_the_package(one_fold, packages, tmp_path):
    packages.install_toy()
    toys = {name: system for name, system in all_systems("toy-gestures").items() if name.startswith("toy_")}
    assert set(toys) == {f"{toy}{drive}" for toy in TOYS for drive in ("", "_shuffled", "_shifted")}
    for name, system in toys.items():
        check_round_trip(one_fold, system, tmp_path / name)
    path = tmp_path / "toy_lift" / "first" / "lift.parquet"
    assert tables.read_metadata(path)["schema"] == "toy_gestures:lift"


PHRASES = st.lists(st.tuples(st.sampled_from(GESTURES), st.integers(1, 40)), min_size=1, max_size=30)


def record_of(name, phrases):
    """The segment table of (label, length) pairs."""
    labels, lengths = zip(*phrases, strict=True)
    return segments.from_starts(
        name, np.cumsum(lengths) - lengths, np.array(labels, dtype=object), sum(lengths), 1 / FRAME_S
    )


@given(st.lists(PHRASES, min_size=1, max_size=3), PHRASES, st.integers(1, 200), st.integers(0, 99))
def test_any_records_make_models_that_survive_their_tables(records, spoken, n_frames, seed):
    """Neighbouring phrases of the same class, single frames, and classes that do not occur."""
    gestures = {f"r{place}": record_of(f"r{place}", phrases) for place, phrases in enumerate(records)}
    rng = np.random.default_rng(seed)
    speech = {name: rng.choice(PATTERNS, table["end_frame"].iloc[-1]) for name, table in gestures.items()}
    order = ("held", *gestures)
    training = Training("ada", FRAME_S, GESTURES, tuple(PATTERNS), gestures, speech, order=order)
    driving = Driving(Streams({"held": rng.choice(PATTERNS, n_frames)}), "held", FRAME_S, seed)
    session = Session(training, SHARED | {"max_duration_s": 1.0}, {})
    for name, system in SYSTEMS.items():
        if system.drive == "own" and "truth" not in system.needs:
            made = session.synthesise(system, driving)[0]
            method = method_of(system)
            read = method.from_tables(session.tables(system))
            again = method.synthesise(read, driving.speeches(system)[0], seed)
            pd.testing.assert_frame_equal(made.phrases, again.phrases)
            assert made.phrases["end_frame"].iloc[-1] == n_frames, name


# ---------------------------------------------------------------- what a fold keeps from its systems


def changed_in(table, others, record):
    """A table of several records with the rows of one record taken from another table."""
    return pd.concat([table[table["record"] != record], others[others["record"] == record]], ignore_index=True)


def test_nothing_of_the_held_out_record_reaches_any_model(one_fold, packages, tmp_path):
    packages.install_toy()
    systems = {
        name: system
        for name, system in all_systems("toy-gestures").items()
        if system.drive == "own" and system.tables
    }
    gestures, prosody = corpus(99, 4, 25.0, 0.1)  # another actor's, of another length
    truth = truth_of(CoupledActor(3), *(
        changed_in(own, others, HELD_OUT)
        for own, others in ((one_fold.gestures, gestures), (one_fold.prosody, prosody))
    ))  # fmt: skip
    motions = one_fold.motions | {HELD_OUT: skeleton.standing(3, MOTION_FPS)}
    exchanged = fold(
        ACTOR,
        HELD_OUT,
        changed_in(one_fold.gestures, gestures, HELD_OUT),
        changed_in(one_fold.prosody, prosody, HELD_OUT),
        one_fold.prosody_tables | prosody_tables([HELD_OUT], 1000, seed=7),
        motions,
        truth,
    )[0]
    without_gestures = fold(
        ACTOR,
        HELD_OUT,
        one_fold.gestures[one_fold.gestures["record"] != HELD_OUT],
        one_fold.prosody,
        one_fold.prosody_tables,
        one_fold.motions,
        one_fold.truth,
    )[0]
    settings = SHARED | {"emission_weights": [0.1, 0.3, 1.0]}
    for number, training in enumerate((one_fold.training, exchanged, without_gestures)):
        session = Session(training, settings, {})
        for name, system in systems.items():
            reread(session.tables(system), system.table_schemas, tmp_path / str(number) / name)
    for path in (tmp_path / "0").rglob("*.parquet"):
        for other in ("1", "2"):
            assert path.read_bytes() == (tmp_path / other / path.relative_to(tmp_path / "0")).read_bytes(), path
    assert len(list((tmp_path / "0").rglob("*.parquet"))) == sum(len(system.tables) for system in systems.values())


def test_training_data_lack_the_held_out_record_and_nothing_else(one_fold):
    others = [record for record in RECORDS if record != HELD_OUT]
    training = one_fold.training
    for mapping in (training.gestures, training.speech, training.prosody, training.motions):
        assert list(mapping) == others
    assert list(training.planted.gestures) == list(training.planted.speech) == others
    assert training.order == RECORDS
    everything, _ = fold(ACTOR, None, one_fold.gestures, one_fold.prosody, truth=one_fold.truth)
    assert list(everything.gestures) == list(everything.speech) == list(everything.planted.speech) == list(RECORDS)


# ---------------------------------------------------------------- by hand


def small(n_frames, **streams):
    """Training data of records whose phrases are the runs of letters, and the speech of a record of ``n_frames``."""
    return Training(
        "ada",
        FRAME_S,
        tuple("lor"),
        ("p1",),
        gestures={name: segments.from_labels(name, list(text), 1 / FRAME_S) for name, text in streams.items()},
        speech={name: np.full(len(text), "p1", dtype=object) for name, text in streams.items()},
    ), Streams({"held": np.full(n_frames, "p1", dtype=object)})


def spelled(name, training, streams):
    [made] = Session(training, SHARED, {}).synthesise(SYSTEMS[name], Driving(streams, "held", FRAME_S, SEED))
    return "".join(segments.to_labels(made.phrases)), made.phrases


def test_clock_takes_the_most_frequent_label_at_each_share_of_the_time():
    # at the shares of 8 frames: rrrrlloo, rrllllll, llllllll; of four frames of record c each is two of eight
    assert spelled("clock", *small(8, a="rrrrlloo", b="rrllllll", c="llll"))[0] == "rrllllll"
    # one vote each at first and in the end, where r and o have more frames than their rival
    assert spelled("clock", *small(4, a="rrro", b="orrl"))[0] == "rrro"


def test_majority_is_one_phrase_of_the_most_frequent_label():
    _, phrases = spelled("majority", *small(5, a="rrrl", b="llrl"))
    assert phrases["label"].tolist() == ["l"]  # four frames each: the first by name
    assert spelled("majority", *small(5, a="rrrl", b="rl"))[1]["label"].tolist() == ["r"]


def test_another_is_the_next_record_cut_or_continued():
    def another(n_frames, order, **streams):
        training, speech = small(n_frames, **streams)
        return spelled("another", Training(**(training.__dict__ | {"order": order})), speech)

    order = ("a", "held", "c", "d")
    text, phrases = another(7, order, a="rrll", c="ooor", d="lr")
    assert text == "ooorlrr"  # c, then d, then a
    assert phrases["start_frame"].tolist() == [0, 3, 4, 5, 6]  # records stay apart: r of d, r of a
    assert another(3, order, c="ooor", a="rrll")[0] == "ooo"
    assert another(5, ("a", "held"), a="rl")[0] == "rlrlr"
    assert another(5, ("a", "c"), a="rl", c="o")[0] == "rlorl"  # not the actor's record: all records in order


# ---------------------------------------------------------------- the emission weight


def weight_of(training, weights):
    tables_of_model = Session(training, SHARED | {"emission_weights": weights}, {}).tables(SYSTEMS["hsmm_weighted"])
    return tables_of_model["decoder"]["emission_weight"].iloc[0]


def test_of_equal_weights_the_largest_wins_and_a_single_record_chooses_nothing():
    gestures, prosody = corpus(3, 3, 30.0, 0.8)
    monotonous = prosody.assign(label="p1")  # every weight gives the same path
    actor = ACTOR._replace(records=("r0", "r1", "r2"))
    assert weight_of(fold(actor, "r0", gestures, monotonous)[0], [0.1, 0.5, 0.2]) == 0.5
    alone = fold(actor, "r0", gestures[gestures["record"] != "r1"], prosody)[0]
    assert weight_of(alone, [0.1, 0.5, 0.2]) == 0.5


def test_the_weight_is_chosen_on_records_that_its_model_has_not_seen(monkeypatch):
    """Each training record is decoded by a model of the others: in groups, if there are many records."""
    gestures, prosody = corpus(5, 7, 20.0, 0.8)
    records = tuple(f"r{number}" for number in range(7))
    training = fold(ACTOR._replace(records=records), "r0", gestures, prosody)[0]
    how = hsmm_model.estimate_of(SHARED)
    counted = hsmm_model.counts(training, how)
    seen = {}
    monkeypatch.setattr(hsmm_model, "best_weight", lambda gestures, speech, model_of, *rest: seen.update(model_of))
    hsmm_model.choose_weight(training, counted, how, [1.0], "none")
    assert sorted(seen) == sorted(training.gestures)
    assert len({id(model) for model in seen.values()}) == hsmm_model.INNER_FOLDS
    groups = {}
    for name, model in seen.items():
        groups.setdefault(id(model), []).append(name)
    for names in groups.values():
        expected = hsmm_model.estimate([own for name, own in counted.items() if name not in names], how)
        np.testing.assert_array_equal(seen[names[0]].emissions, expected.emissions)


def test_the_weight_is_the_one_that_agrees_best(one_fold):
    """Recomputed over the three training records, each of which is held out in turn."""
    training, weights = one_fold.training, [0.05, 0.1, 0.2, 0.3, 0.5, 1.0]
    how = hsmm_model.estimate_of(SHARED)
    counted = hsmm_model.counts(training, how)
    means = []
    for weight in weights:
        agreed = []
        for name, actual in training.gestures.items():
            model = hsmm_model.estimate([own for other, own in counted.items() if other != name], how)
            agreed += hsmm_model.agreements(actual, [hsmm.decode(model, training.speech[name], weight)])
        means.append(np.mean(agreed))
    assert weight_of(training, weights) == weights[int(np.argmax(means))]


# ---------------------------------------------------------------- extremes


def test_a_record_of_one_gesture_and_a_record_of_one_sound_go_through():
    gestures, prosody = corpus(3, 3, 30.0, 0.8)
    names = ("r0", "r1", "r2")
    still = pd.concat(
        [segments.from_starts(name, [0], ["rest"], 1200, 1 / FRAME_S) for name in names], ignore_index=True
    )
    silent = prosody.assign(label="p3")
    for own, spoken in ((still, prosody), (gestures, silent), (still, silent)):
        training, streams = fold(ACTOR._replace(records=names), "r0", own, spoken)
        session = Session(training, SHARED | {"emission_weights": [0.2, 1.0], "censoring": "right"}, {})
        for name, system in SYSTEMS.items():
            if "truth" not in system.needs:
                made = session.synthesise(system, Driving(streams, "r0", FRAME_S, SEED, Wrong(5.0)))[0]
                segments.check(made.phrases, name)
                assert made.phrases["end_frame"].iloc[-1] == 1200


# ---------------------------------------------------------------- oracle


def test_the_oracle_decodes_planted_prosody_with_planted_parameters():
    actor = CoupledActor(3)
    gestures, prosody = corpus(3, 4, 40.0, 0.8)
    truth = truth_of(actor, gestures, prosody)
    clusters = pd.concat(  # found in the sound, whose prosody frames are one fewer than the script's
        [segments.from_starts(name, [0], ["p1"], N_FRAMES - 1, 1 / FRAME_S) for name in RECORDS]
    )
    training, streams = fold(ACTOR, HELD_OUT, gestures, clusters, truth=truth)
    assert {len(stream) for stream in streams.planted.values()} == {N_FRAMES - 1}
    weights = [0.05, 0.2, 1.0]
    session = Session(training, SHARED | {"emission_weights": weights}, {})
    model = session.trained(SYSTEMS["oracle"]).model
    assert model.weight in weights
    assert model.hsmm.durations.min() >= 0.9e-6
    np.testing.assert_allclose(model.hsmm.transitions, actor.process(0.8).transitions, atol=1e-5)
    [made] = session.synthesise(SYSTEMS["oracle"], Driving(streams, HELD_OUT, FRAME_S, SEED))
    assert made.phrases["end_frame"].iloc[-1] == N_FRAMES - 1
    actual = segments.resample(gestures[gestures["record"] == HELD_OUT], N_FRAMES - 1, 1 / FRAME_S)
    right = segments.to_labels(made.phrases) == segments.to_labels(actual)
    assert right.mean() > 0.3  # seven classes: chance is 0.18


def test_the_oracle_is_refused_where_nothing_was_planted(one_fold):
    gestures, prosody = corpus(3, 3, 30.0, 0.8)
    actor = ACTOR._replace(records=("r0", "r1", "r2"))
    training, streams = fold(actor, "r0", gestures, prosody)
    with pytest.raises(UserError, match="planted parameters exist for actors of the virtual studio only"):
        Session(training, SHARED, {}).tables(SYSTEMS["oracle"])
    driving = Driving(streams, "r0", FRAME_S, SEED)
    with pytest.raises(UserError, match="r0: its prosody was not planted"):
        one_fold.session().synthesise(SYSTEMS["oracle"], driving)
