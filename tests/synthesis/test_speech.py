"""Wrong speech: another record's or another moment's, of the right length, and the same for every decoder."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.errors import UserError
from cospeech.synthesis.speech import frame_labels, heard

FRAME_S = 0.025


def labels(**lengths):
    """A different stream of labels for each record."""
    return {
        name: np.array([f"p{(k + place) % 7}" for k in range(n)], dtype=object)
        for place, (name, n) in enumerate(lengths.items())
    }


def test_own_speech_is_the_records_own():
    speech = heard(labels(a=10, b=12), "b", FRAME_S)
    assert speech.labels.tolist() == labels(a=10, b=12)["b"].tolist()
    assert (speech.record, speech.driving_record, speech.shift_s, speech.n_frames) == ("b", "b", 0.0, 12)


@given(st.integers(400, 2000), st.integers(0, 5000), st.floats(0.1, 5.0))
def test_shifted_speech_is_the_same_speech_far_enough_away(n_frames, seed, shift_s):
    every = labels(a=n_frames, b=30)
    speech = heard(every, "a", FRAME_S, "shifted", seed, shift_s)
    frames = round(speech.shift_s / FRAME_S)
    assert speech.driving_record == "a"
    assert min(frames, n_frames - frames) >= round(shift_s / FRAME_S)
    np.testing.assert_array_equal(speech.labels, np.concatenate([every["a"][frames:], every["a"][:frames]]))


@given(st.integers(1, 100), st.integers(0, 5000))
def test_shuffled_speech_is_another_records_cut_or_wrapped_round(n_frames, seed):
    every = labels(a=n_frames, b=20, c=70)
    speech = heard(every, "a", FRAME_S, "shuffled", seed)
    assert speech.driving_record in ("b", "c")
    source = every[speech.driving_record]
    assert speech.labels.tolist() == [source[k % len(source)] for k in range(n_frames)]
    again = heard(every, "a", FRAME_S, "shuffled", seed)
    assert again.driving_record == speech.driving_record


def test_every_other_record_drives_now_and_then():
    every = labels(a=5, b=5, c=5, d=5)
    assert {heard(every, "a", FRAME_S, "shuffled", seed).driving_record for seed in range(40)} == {"b", "c", "d"}


def test_a_record_too_short_to_be_shifted_is_named():
    with pytest.raises(UserError, match=r"record a: is 9.975 s long, too short to be shifted by 5 s .*shift_s"):
        heard(labels(a=399, b=500), "a", FRAME_S, "shifted", 0, 5.0)
    assert heard(labels(a=400, b=500), "a", FRAME_S, "shifted", 0, 5.0).shift_s == 5.0


def test_a_record_alone_cannot_be_shuffled():
    with pytest.raises(UserError, match="record a: its actor has no other record"):
        heard(labels(a=50), "a", FRAME_S, "shuffled")


def test_frame_labels_need_segments_without_gaps():
    from cospeech.data import segments

    table = segments.from_labels("a", ["p1", "p1", "p2", "p1"], 1 / FRAME_S)
    assert frame_labels(table)["a"].tolist() == ["p1", "p1", "p2", "p1"]
    with pytest.raises(UserError, match="prosody segments of record a"):
        frame_labels(table.drop(index=1))
