"""Wrong speech is that of another record or another moment, of the right length, and the same for every decoder."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.synthesis.speech import Streams, driving_speech, frame_labels

FRAME_S = 0.025


def streams(**lengths):
    """Different labels, planted labels and prosody frames for each record, of which each number tells its place."""
    labels, planted, prosody = {}, {}, {}
    for place, (name, n) in enumerate(lengths.items()):
        labels[name] = np.array([f"p{(k + place) % 7}" for k in range(n)], dtype=object)
        planted[name] = np.array([f"q{(k + place) % 5}" for k in range(n)], dtype=object)
        prosody[name] = pd.DataFrame(
            {
                "frame": np.arange(n),
                "time_s": segments.frame_times(n, 1 / FRAME_S),
                "intensity": 1000.0 * place + np.arange(n),
            }
        )
    return Streams(labels, prosody, planted)


def check_in_step(speech, every):
    """All streams of the speech come from the same frames of the driving record, at the times of the own record."""
    n_frames, source = speech.n_frames, speech.driving_record
    intensity = speech.prosody["intensity"].to_numpy()
    frames = (intensity % 1000).astype(int)
    assert set(intensity // 1000) == {list(every.labels).index(source)}
    np.testing.assert_array_equal(speech.labels, every.labels[source][frames])
    np.testing.assert_array_equal(speech.planted, every.planted[source][frames])
    assert len(speech.labels) == len(speech.planted) == len(speech.prosody) == n_frames
    np.testing.assert_array_equal(speech.prosody.index, np.arange(n_frames))
    np.testing.assert_array_equal(speech.prosody["frame"], np.arange(n_frames))
    np.testing.assert_allclose(speech.prosody["time_s"], segments.frame_times(n_frames, 1 / FRAME_S))
    return frames


def test_own_speech_is_that_of_the_record():
    every = streams(a=10, b=12)
    speech = driving_speech(every, "b", FRAME_S)
    assert check_in_step(speech, every).tolist() == list(range(12))
    assert (speech.record, speech.driving_record, speech.shift_s, speech.n_frames) == ("b", "b", 0.0, 12)
    pd.testing.assert_frame_equal(speech.prosody, every.prosody["b"])


@given(st.integers(400, 900), st.integers(0, 5000), st.floats(0.1, 5.0))
def test_shifted_speech_is_the_same_speech_far_enough_away(n_frames, seed, shift_s):
    every = streams(a=n_frames, b=30)
    speech = driving_speech(every, "a", FRAME_S, "shifted", seed, shift_s)
    shift = round(speech.shift_s / FRAME_S)
    assert speech.driving_record == "a"
    assert min(shift, n_frames - shift) >= round(shift_s / FRAME_S)
    np.testing.assert_array_equal(check_in_step(speech, every), np.roll(np.arange(n_frames), -shift))
    own = every.labels["a"]
    np.testing.assert_array_equal(speech.labels, np.concatenate([own[shift:], own[:shift]]))


@given(st.integers(1, 100), st.integers(0, 5000))
def test_shuffled_speech_is_that_of_another_record_cut_or_repeated(n_frames, seed):
    every = streams(a=n_frames, b=20, c=70)
    speech = driving_speech(every, "a", FRAME_S, "shuffled", seed)
    assert speech.driving_record in ("b", "c")
    assert speech.shift_s == 0.0
    source = every.labels[speech.driving_record]
    assert speech.labels.tolist() == [source[k % len(source)] for k in range(n_frames)]
    assert check_in_step(speech, every).tolist() == [k % len(source) for k in range(n_frames)]
    again = driving_speech(every, "a", FRAME_S, "shuffled", seed)
    assert again.driving_record == speech.driving_record


@given(st.sampled_from(["own", "shuffled", "shifted"]), st.integers(0, 500))
def test_what_drives_a_record_does_not_depend_on_the_kind_of_stream(drive, seed):
    every = streams(a=60, b=20, c=70)
    both = driving_speech(every, "a", FRAME_S, drive, seed, 0.2)
    labels = driving_speech(Streams(every.labels), "a", FRAME_S, drive, seed, 0.2)
    prosody = driving_speech(Streams({}, every.prosody), "a", FRAME_S, drive, seed, 0.2)
    for one in (labels, prosody):
        assert (one.driving_record, one.shift_s) == (both.driving_record, both.shift_s)
    assert labels.prosody is None
    assert labels.planted is None
    assert len(prosody.labels) == 0
    np.testing.assert_array_equal(labels.labels, both.labels)
    pd.testing.assert_frame_equal(prosody.prosody, both.prosody)


def test_the_streams_themselves_stay_as_they_are():
    every, fresh = streams(a=30, b=40), streams(a=30, b=40)
    for drive in ("own", "shuffled", "shifted"):
        speech = driving_speech(every, "a", FRAME_S, drive, 1, 0.1)
        if drive != "own":
            speech.prosody["intensity"] = 0.0
    for name in ("a", "b"):
        pd.testing.assert_frame_equal(every.prosody[name], fresh.prosody[name])


def test_every_other_record_is_drawn_for_some_seed():
    every = streams(a=5, b=5, c=5, d=5)
    drawn = {driving_speech(every, "a", FRAME_S, "shuffled", seed).driving_record for seed in range(40)}
    assert drawn == {"b", "c", "d"}


def test_a_record_too_short_to_be_shifted_is_named():
    with pytest.raises(UserError, match=r"record a: its 9.975 s are too short for a shift of 5 s .*shift_s"):
        driving_speech(streams(a=399, b=500), "a", FRAME_S, "shifted", 0, 5.0)
    assert driving_speech(streams(a=400, b=500), "a", FRAME_S, "shifted", 0, 5.0).shift_s == 5.0


def test_the_only_record_of_an_actor_cannot_be_shuffled():
    with pytest.raises(UserError, match="record a: its actor has no other record"):
        driving_speech(streams(a=50), "a", FRAME_S, "shuffled")


def test_frame_labels_need_segments_without_gaps():
    table = segments.from_labels("a", ["p1", "p1", "p2", "p1"], 1 / FRAME_S)
    assert frame_labels(table)["a"].tolist() == ["p1", "p1", "p2", "p1"]
    with pytest.raises(UserError, match="prosody segments of record a"):
        frame_labels(table.drop(index=1))
