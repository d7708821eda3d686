"""The script: its samples follow the planted distributions, exactly where documented."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import segments, tables
from cospeech.data.rng import random_source
from cospeech.data.vocabulary import GESTURES
from cospeech.studio import cast, script
from cospeech.studio.patterns import NAMES

FRAME_S = 0.025
# About two hundred cells are tested together: by chance alone, one exceeds 4.5 standard deviations once in 700 test
# runs. The seeds are fixed.
FAR = 4.5


@pytest.fixture(scope="module")
def member():
    return cast.member("ada", 2012, FRAME_S, 10.0)


def draws(member, coupling, count, n_frames=1600, seed=7):
    return [script.sample(member, f"r{k}", n_frames, coupling, FRAME_S, seed) for k in range(count)]


def streams(drawn, n_frames):
    """Return the gesture class and the prosody pattern of every frame, (n_frames,) each."""
    lengths = (np.diff(np.append(starts, n_frames)) for starts in (drawn.gesture_starts, drawn.prosody_starts))
    return tuple(map(np.repeat, (drawn.gestures, drawn.patterns), lengths))


def deviations(hits, tries, probability):
    """Return the deviation of each count of hits from its expectation, in standard deviations."""
    expected = tries * probability
    spread = np.sqrt(np.maximum(tries * probability * (1 - probability), 1e-9))
    return np.where(tries > 0, (hits - expected) / spread, 0.0)


@settings(max_examples=40, deadline=None)
@given(
    coupling=st.floats(0, 1),
    duration_s=st.floats(2, 30),
    frame_s=st.sampled_from([0.01, 0.02, 0.025, 0.05]),
    seed=st.integers(0, 2**32),
)
def test_both_streams_cover_the_record_without_gaps(coupling, duration_s, frame_s, seed):
    someone = cast.member("ada", seed, frame_s, 10.0)
    gestures, prosody = script.write(someone, "x", duration_s, coupling, frame_s, seed)
    n_frames = round(duration_s / frame_s)
    for table in (gestures, prosody):
        segments.check(table, "x")
        tables.validate(table, "segments", "x")
        assert table["end_frame"].iloc[-1] == n_frames
    np.testing.assert_allclose(gestures["start_s"], gestures["start_frame"] * frame_s, rtol=1e-12)


def test_a_script_is_reproducible_and_differs_between_records(member):
    one, again, other = (script.write(member, name, 60.0, 0.8, FRAME_S, 1) for name in ("a", "a", "b"))
    for first, second in zip(one, again, strict=True):
        pd.testing.assert_frame_equal(first, second)
    assert one[0]["start_frame"].tolist() != other[0]["start_frame"].tolist()


def test_gestures_do_not_depend_on_coupling(member):
    loose, tight = (script.write(member, "a", 60.0, coupling, FRAME_S, 1)[0] for coupling in (0.0, 1.0))
    pd.testing.assert_frame_equal(loose, tight)


def test_initial_gestures_and_transitions_follow_the_planted_distributions(member):
    pairs = np.zeros((len(GESTURES), len(GESTURES)))
    first = np.zeros(len(GESTURES))
    for k in range(1500):
        labels = script.gesture_process(member, 1600, random_source(3, str(k)))[1]
        first[labels[0]] += 1
        np.add.at(pairs, (labels[:-1], labels[1:]), 1)
    assert np.abs(deviations(first, first.sum(), member.initial)).max() < FAR
    assert np.abs(deviations(pairs, pairs.sum(axis=1, keepdims=True), member.transitions)).max() < FAR


def test_durations_follow_the_planted_distributions(member):
    starts, labels = script.gesture_process(member, 800_000, random_source(3))
    lengths = np.diff(starts)
    for i in range(len(GESTURES)):
        ours = np.sort(lengths[labels[:-1] == i])
        found = np.searchsorted(ours, np.arange(1, 401), side="right") / len(ours)
        # Kolmogorov-Smirnov test, p = 0.001
        assert np.abs(found - np.cumsum(member.durations[i])).max() < 1.95 / np.sqrt(len(ours))


@pytest.mark.parametrize("coupling", [0.0, 0.5, 1.0])
def test_frames_follow_the_planted_emissions_exactly(member, coupling):
    """Frames of one record are dependent, but records are not, so the deviation is computed over records."""
    counts = np.zeros((1000, len(GESTURES), len(NAMES)))
    for k, drawn in enumerate(draws(member, coupling, len(counts))):
        np.add.at(counts[k], streams(drawn, 1600), 1)
    planted = member.emissions(coupling)
    surplus = counts - counts.sum(axis=2, keepdims=True) * planted
    z = surplus.sum(axis=0) / np.sqrt((surplus**2).sum(axis=0))
    assert np.abs(z).max() < FAR
    estimate = counts.sum(axis=0) / counts.sum(axis=(0, 2))[:, None]
    assert np.abs(estimate - planted).max() < 0.02


def test_durations_of_intonation_phrases_do_not_depend_on_the_pattern(member):
    drawn = script.sample(member, "long", 1_200_000, 0.0, FRAME_S, 3)
    lengths = np.diff(drawn.prosody_starts)
    assert (lengths.min(), lengths.max()) == (16, 64)
    counts = np.bincount(lengths, minlength=65)[16:]
    assert np.abs(deviations(counts, len(lengths), 1 / 49)).max() < FAR
    spread = lengths.std()
    for p in range(len(NAMES)):
        ours = lengths[drawn.patterns[:-1] == p]
        assert abs(ours.mean() - 40) < FAR * spread / np.sqrt(len(ours))


def test_a_coupled_phrase_restarts_its_speech_and_an_uncoupled_run_does_not(member):
    drawn = script.sample(member, "long", 200_000, 0.5, FRAME_S, 4)
    opens = drawn.coupled | np.append(True, drawn.coupled[:-1])
    restarts = drawn.gesture_starts[opens]
    assert np.isin(restarts, drawn.prosody_starts).all()
    inside = drawn.gesture_starts[~opens]
    assert np.isin(inside, drawn.prosody_starts).mean() < 0.06  # by chance a fortieth
    cut = np.diff(drawn.prosody_starts) < 16  # shorter than any sampled duration
    assert cut.any()
    assert np.isin(drawn.prosody_starts[1:][cut], restarts).all()


def test_at_coupling_0_speech_and_gestures_are_independent(member):
    """Gestures and speech of one record share no more information or boundaries than those of different records."""
    drawn = draws(member, 0.0, 150, 2400)
    gestures, prosody = map(np.array, zip(*(streams(one, 2400) for one in drawn), strict=True))
    edges = [np.zeros((150, 2400), dtype=bool) for _ in range(2)]
    for k, one in enumerate(drawn):
        edges[0][k, one.gesture_starts[1:]] = True
        edges[1][k, one.prosody_starts[1:]] = True

    def information(shift):
        cells = gestures * len(NAMES) + np.roll(prosody, shift, axis=0)
        share = np.bincount(cells.ravel(), minlength=56).reshape(len(GESTURES), len(NAMES)) / cells.size
        chance = share.sum(axis=1, keepdims=True) * share.sum(axis=0)
        return float((share * np.log(np.maximum(share, 1e-12) / chance)).sum())

    def meetings(shift):
        return int((edges[0] & np.roll(edges[1], shift, axis=0)).sum())

    for measure in (information, meetings):
        wrong = np.array([measure(shift) for shift in range(1, 60)])
        assert wrong.min() <= measure(0) <= wrong.max()


def test_coupling_is_the_fraction_of_coupled_phrases(member):
    coupled = np.concatenate([drawn.coupled for drawn in draws(member, 0.3, 300)])
    assert abs(deviations(coupled.sum(), len(coupled), 0.3)) < FAR


def test_examples_are_complete_phrases_spread_over_the_records(member):
    made = pd.concat([script.write(member, f"ada_{k}", 60.0, 0.8, FRAME_S, 2012)[0] for k in range(1, 5)])
    chosen = script.examples(made, 5, random_source(1, "x"))
    tables.validate(chosen, "annotations", "x")
    assert set(chosen["origin"]) == {"studio"}
    whole = made[made["record"].eq(made["record"].shift(-1))]
    keys = ["record", "start_s", "end_s"]
    found = chosen.merge(whole.rename(columns={"label": "gesture"}), on=[*keys, "gesture"])
    assert len(found) == len(chosen)
    assert (chosen["gesture"].value_counts().reindex(GESTURES) == 5).all()
    for gesture, ours in chosen.groupby("gesture"):
        present = whole.loc[whole["label"] == gesture, "record"].nunique()
        assert ours["record"].nunique() == min(5, present)


def test_a_rare_class_gives_fewer_examples():
    table = segments.from_starts("a", [0, 40, 100, 140], ["rest", "left", "rest", "open"], 200, 40.0)
    chosen = script.examples(table, 3, random_source(1, "x"))
    assert chosen["gesture"].tolist() == ["rest", "left", "rest"]  # the last phrase is cut off
