"""The systems that make heads: their tables, their frames, and that live and offline results are the same."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from planted_heads import FPS, speech_of

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.synthesis.head import SETTINGS, SYSTEMS, model, report
from cospeech.synthesis.interface import Training
from cospeech.synthesis.live import ANGLES, Heard, Stream, by_steps
from cospeech.synthesis.session import Trained, method_of, perform

NAMED = {system.name: system for system in SYSTEMS}
DRIVEN = {name: system for name, system in NAMED.items() if system.role == "system"}
CONTROLS = [name for name, system in NAMED.items() if system.role == "control"]


def made_by(name, trained, speech, seed=7):
    system = NAMED[name]
    return perform(system, Trained(method_of(system), trained), speech, seed).head


@pytest.mark.parametrize("name", DRIVEN)
def test_a_head_moves_over_the_whole_record_and_equal_seeds_give_equal_angles(trained, records, name):
    speech = speech_of(records, "r0")
    head = made_by(name, trained, speech)
    pd.testing.assert_frame_equal(head, made_by(name, trained, speech))
    assert not np.array_equal(head["y_deg"], made_by(name, trained, speech, seed=8)["y_deg"])
    assert (head[list(ANGLES)].std() > 0.1).all()


@pytest.mark.parametrize("name", DRIVEN)
@pytest.mark.parametrize("filters", ["printed", "kept"])
def test_steps_of_10_ms_make_what_a_whole_record_makes(trained, records, name, filters):
    trained = trained._replace(style=trained.style._replace(filters=filters))
    speech, method = speech_of(records, "r0"), method_of(DRIVEN[name])
    whole = by_steps(method, "head", trained, speech, 7).head
    melody = speech.melody[["pitch", "d_pitch", "intensity"]].to_numpy()
    state = method.start(trained, Stream("r0", 0.01, FPS), 7)
    parts = [
        method.step(state, Heard(k, (k + 0.5) / 100, "", {}, melody=melody[k : k + 1])) for k in range(len(melody))
    ]
    parts.append(method.end(state, speech))
    np.testing.assert_array_equal(np.concatenate(parts), whole[list(ANGLES)].to_numpy())


@pytest.mark.parametrize("name", DRIVEN)
@pytest.mark.parametrize("fps", [20.0, 25.0, 60.0])
def test_a_head_can_be_made_at_another_rate(trained, records, name, fps):
    own, other = (made_by(name, trained, speech_of(records, "r0", fps=rate)) for rate in (FPS, fps))
    at_times = np.interp(other["time_s"], own["time_s"], own["y_deg"])
    np.testing.assert_allclose(other["y_deg"], at_times, atol=1e-9)


def test_tables_round_trip_without_loss(trained, records, tmp_path):
    schemas = DRIVEN["head"].table_schemas
    stored = {}
    for name, table in model.to_tables(trained).items():
        path = tmp_path / f"{name}.parquet"
        tables.write(table, path, schemas[name], corpus="virtual", config_hash="0")
        stored[name] = tables.read(path, schemas[name])
    again = model.from_tables(stored)
    for name in DRIVEN:
        speech = speech_of(records, "r0")
        pd.testing.assert_frame_equal(made_by(name, trained, speech), made_by(name, again, speech))
    for before, after in zip(model.to_tables(trained).values(), model.to_tables(again).values(), strict=True):
        pd.testing.assert_frame_equal(before, after)


def test_speech_that_ends_before_or_after_the_motion_fills_it_anyway(trained, records):
    speech = speech_of(records, "r0")
    for n_melody, n_frames in ((100, 300), (6000, 60), (3, 40)):
        short = replace(speech, melody=speech.melody[:n_melody], n_motion_frames=n_frames)
        for name in DRIVEN:
            assert len(made_by(name, trained, short)) == n_frames


def test_a_short_corpus_gets_fewer_patterns(records):
    melody, head = records["r1"].melody[:600], records["r1"].head[:180]
    training = Training("ada", 0.025, (), (), {}, {}, melodies={"r1": melody}, heads={"r1": head})
    learnt = model.train(training, SETTINGS)
    assert len(learnt.stage.head.labels) == 180 // (1.5 * 1.6 * FPS)
    assert len(made_by("head", learnt, speech_of(records, "r0"))) == len(records["r0"].head)


def test_gaps_are_left_out_and_a_head_that_is_never_seen_is_refused(training):
    gap = training.heads["r1"].copy()
    gap.loc[300:400, list(ANGLES)] = np.nan
    gap.loc[700:702, list(ANGLES)] = np.nan
    stage, examples, angles = model.first_stage(
        replace(training, heads=training.heads | {"r1": gap}), SETTINGS, np.random.default_rng(0)
    )
    assert [(example.first, len(example.symbols)) for example in examples[:2]] == [(0, 300), (401, 1399)]
    assert [len(part) for part in angles] == [300, 1399, 1800, 1800]
    assert all(np.isfinite(part).all() for part in angles)
    assert stage.fps == FPS
    unseen = {record: head.assign(y_deg=np.nan) for record, head in training.heads.items()}
    with pytest.raises(UserError, match="actor ada: no training record shows the head in 10 successive frames"):
        model.train(replace(training, heads=unseen), SETTINGS)


def test_unknown_filters_are_named(training):
    with pytest.raises(UserError, match="filters: 'none'; known are printed, kept"):
        model.train(training, SETTINGS | {"filters": "none", "iterations": 1, "restarts": 1})


def test_reports_have_their_schemas_and_show_what_the_filters_do(training, trained, records, monkeypatch):
    monkeypatch.setattr(report, "COUNTS", range(2, 4))
    found = report.report(training, trained, speech_of(records, "r0"), 7)
    for name, table in found.items():
        tables.validate(table, DRIVEN["head"].report_schemas[name], name)
    assert found["curves"].groupby("stream").size().to_dict() == {"head": 2, "joint": 2, "melody": 2}
    alpha = found["curves"].groupby("stream")["alpha"]
    assert (alpha.last() > alpha.first()).all()
    assert found["means"]["share"].sum() == pytest.approx(1.0)
    assert found["means"]["y_deg"].iloc[0] == found["means"]["y_deg"].min() < 0.0
    steps = found["generation"].groupby("stage")["y_deg"].agg(lambda angles: angles.diff().abs().mean())
    assert steps["drawn"] > steps["median"] > steps["printed"]


@pytest.mark.parametrize("name", ["head", "head_weighted"])
def test_kept_filters_keep_spread_speed_and_jerk_of_the_training_records(training, trained, records, name):
    made = [made_by(name, trained, speech_of(records, record)) for record in training.heads]
    sizes = []
    for heads in (made, list(training.heads.values())):
        angles = [head[list(ANGLES)].to_numpy() for head in heads]
        moves = [[np.linalg.norm(np.diff(own, n=order, axis=0), axis=1).mean() for own in angles] for order in (1, 3)]
        sizes.append([np.concatenate(angles).std(axis=0).mean(), *np.mean(moves, axis=1)])
    np.testing.assert_allclose(sizes[0], sizes[1], rtol=0.15)


# ---------------------------------------------------------------- controls and ceiling


@pytest.mark.parametrize("name", [*CONTROLS, "head_ceiling"])
def test_controls_and_the_ceiling_survive_their_tables(training, trained, records, tmp_path, name):
    method, schemas = method_of(NAMED[name]), NAMED[name].table_schemas
    learnt = trained if name == "head_ceiling" else method.train(training, {})
    stored = {}
    for table, found in method.to_tables(learnt).items():
        tables.write(found, tmp_path / f"{table}.parquet", schemas[table], corpus="virtual", config_hash="0")
        stored[table] = tables.read(tmp_path / f"{table}.parquet", schemas[table])
    speech = speech_of(records, "r0", fps=25.0)
    before, after = (made_by(name, one, speech) for one in (learnt, method.from_tables(stored)))
    pd.testing.assert_frame_equal(before, after)


def test_the_head_that_does_not_move_and_the_mean_head_are_constant(training, records):
    pool = method_of(NAMED["head_still"]).train(training, {})
    speech = speech_of(records, "r0")
    assert (made_by("head_still", pool, speech)[list(ANGLES)] == 0).all(axis=None)
    known = np.concatenate([head[list(ANGLES)] for head in training.heads.values()])
    mean = made_by("head_mean", pool, speech)[list(ANGLES)]
    np.testing.assert_allclose(mean, np.tile(known.mean(axis=0), (len(mean), 1)), atol=1e-9)


def test_another_head_is_that_of_the_next_record_and_of_later_ones(training, records):
    pool = method_of(NAMED["head_another"]).train(training, {})
    speech = replace(speech_of(records, "r0"), n_motion_frames=4000)
    made = made_by("head_another", pool, speech)[list(ANGLES)].to_numpy()
    heads = [records[name].head[list(ANGLES)].to_numpy() for name in ("r1", "r2", "r3")]
    np.testing.assert_allclose(made, np.concatenate(heads)[:4000], atol=1e-9)
    last = made_by("head_another", pool, replace(speech_of(records, "r3"), n_motion_frames=100))
    np.testing.assert_allclose(last[list(ANGLES)], heads[0][:100], atol=1e-9)


def test_another_head_skips_what_could_not_be_measured(training, records):
    gap = training.heads["r1"].copy()
    gap.loc[50:60, list(ANGLES)] = np.nan
    pool = method_of(NAMED["head_another"]).train(replace(training, heads={"r1": gap, "r2": gap}), {})
    made = made_by("head_another", pool, speech_of(records, "r0"))
    between = made.loc[49:61, "y_deg"]
    np.testing.assert_allclose(between, np.linspace(between.iloc[0], between.iloc[-1], 13), atol=1e-9)


def test_nothing_learns_from_records_without_a_head(training):
    unseen = {record: head.assign(x_deg=np.nan) for record, head in training.heads.items()}
    with pytest.raises(UserError, match="actor ada: no training record shows the head"):
        method_of(NAMED["head_mean"]).train(replace(training, heads=unseen), {})
