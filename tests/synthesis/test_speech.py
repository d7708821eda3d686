"""Wrong speech is that of another record or another moment, of the right length, and the same for every decoder."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.synthesis.declaration import shortest_shifted_s
from cospeech.synthesis.speech import Streams, Wrong, driving_speeches, frame_labels

FRAME_S = 0.025
HEAD, TAIL = 12, 6
ENDS = Wrong(0.2, HEAD * FRAME_S, TAIL * FRAME_S)  # a shift of at least 8 frames


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


def of_draws(every, record, drive="own", seed=0, wrong=ENDS, draws=1):
    return driving_speeches(every, record, FRAME_S, drive, seed, wrong, draws)


def test_own_speech_is_that_of_the_record():
    every = streams(a=10, b=12)
    [speech] = of_draws(every, "b")
    assert check_in_step(speech, every).tolist() == list(range(12))
    assert (speech.record, speech.driving_record, speech.shift_s, speech.n_frames) == ("b", "b", 0.0, 12)
    pd.testing.assert_frame_equal(speech.prosody, every.prosody["b"])
    assert [one.draw for one in of_draws(every, "b", draws=3)] == [0, 1, 2]


@given(st.integers(400, 900), st.integers(0, 5000), st.floats(0.1, 5.0))
def test_without_ends_a_shift_is_circular_and_far_enough_in_both_directions(n_frames, seed, shift_s):
    every = streams(a=n_frames, b=30)
    [speech] = of_draws(every, "a", "shifted", seed, Wrong(shift_s))
    shift = round(speech.shift_s / FRAME_S)
    assert speech.driving_record == "a"
    assert min(shift, n_frames - shift) >= round(shift_s / FRAME_S)
    np.testing.assert_array_equal(check_in_step(speech, every), np.roll(np.arange(n_frames), -shift))
    own = every.labels["a"]
    np.testing.assert_array_equal(speech.labels, np.concatenate([own[shift:], own[:shift]]))


LENGTHS = st.integers(HEAD + TAIL + 1, 120)


@given(st.integers(HEAD + TAIL + 16, 120), LENGTHS, LENGTHS, st.integers(0, 500))
def test_the_ends_of_a_record_stay_out_of_the_interior(own, two, three, seed):
    every = streams(a=own, b=two, c=three)
    for drive in ("shuffled", "shifted"):
        for speech in of_draws(every, "a", drive, seed, draws=8):
            frames, length = check_in_step(speech, every), len(every.labels[speech.driving_record])
            inside = frames[HEAD : own - TAIL]
            assert ((inside >= HEAD) & (inside < length - TAIL)).all()
            # All of the interior in its order, from the shift on.
            shift = round(speech.shift_s / FRAME_S)
            expected = HEAD + (np.arange(len(inside)) + shift) % (length - HEAD - TAIL)
            np.testing.assert_array_equal(inside, expected)
            np.testing.assert_array_equal(frames[:HEAD], np.arange(HEAD))
            np.testing.assert_array_equal(frames[-TAIL:], np.arange(length - TAIL, length))


@given(st.integers(HEAD + TAIL, 120), st.integers(0, 500))
def test_eight_different_shifts_spread_over_all_that_are_possible(n_frames, seed):
    found = [speech.shift_s for speech in of_draws(streams(a=n_frames, b=40), "a", "shifted", seed, draws=8)]
    inner = n_frames - HEAD - TAIL
    possible = max(0, inner - 2 * 8 + 1)
    assert len(found) == len(set(found)) == min(8, possible)
    frames = np.sort(np.round(np.array(found) / FRAME_S).astype(int))
    assert ((frames >= 8) & (frames <= inner - 8)).all()
    if len(frames) == 8:  # one in each eighth, within a frame
        assert np.abs(np.diff(frames) - possible / 8).max() <= 1


@given(st.integers(1, 100), st.integers(0, 5000))
def test_without_ends_shuffled_speech_is_that_of_other_records_cut_or_repeated(n_frames, seed):
    every = streams(a=n_frames, b=20, c=70)
    drawn = of_draws(every, "a", "shuffled", seed, Wrong(5.0), draws=8)
    assert {speech.driving_record for speech in drawn} == {"b", "c"}  # all there are, each once
    assert len(drawn) == 2
    for speech in drawn:
        assert speech.shift_s == 0.0
        source = every.labels[speech.driving_record]
        assert speech.labels.tolist() == [source[k % len(source)] for k in range(n_frames)]
        assert check_in_step(speech, every).tolist() == [k % len(source) for k in range(n_frames)]


def test_a_record_that_is_shorter_than_the_ends_is_driven_by_ends():
    every = streams(a=HEAD + 2, b=40, c=HEAD - 2)
    [speech] = of_draws(every, "a", "shuffled", draws=8)  # c has no interior, and cannot be a partner
    assert check_in_step(speech, every).tolist() == [*range(HEAD), 38, 39]
    for speech in of_draws(every, "c", "shuffled", draws=8):
        assert check_in_step(speech, every).tolist() == list(range(HEAD - 2))


@given(st.sampled_from(["own", "shuffled", "shifted"]), st.integers(0, 500))
def test_what_drives_a_record_does_not_depend_on_the_kind_of_stream(drive, seed):
    every = streams(a=60, b=20, c=70)
    both = of_draws(every, "a", drive, seed, draws=8)
    labels = of_draws(Streams(every.labels), "a", drive, seed, draws=8)
    prosody = of_draws(Streams({}, every.prosody), "a", drive, seed, draws=8)
    for one, other, third in zip(both, labels, prosody, strict=True):
        for kind in (other, third):
            assert (one.driving_record, one.shift_s, one.draw) == (kind.driving_record, kind.shift_s, kind.draw)
        assert other.prosody is None
        assert other.planted is None
        assert len(third.labels) == 0
        np.testing.assert_array_equal(other.labels, one.labels)
        pd.testing.assert_frame_equal(third.prosody, one.prosody)


def test_the_streams_themselves_stay_as_they_are():
    every, fresh = streams(a=40, b=40), streams(a=40, b=40)
    for drive in ("own", "shuffled", "shifted"):
        [speech] = of_draws(every, "a", drive, 1)
        if drive != "own":
            speech.prosody["intensity"] = 0.0
    for name in ("a", "b"):
        pd.testing.assert_frame_equal(every.prosody[name], fresh.prosody[name])


def test_every_other_record_and_many_shifts_are_drawn_first_for_some_seed():
    every = streams(a=60, b=30, c=30, d=30)
    drawn = {of_draws(every, "a", "shuffled", seed)[0].driving_record for seed in range(40)}
    assert drawn == {"b", "c", "d"}
    assert len({of_draws(every, "a", "shifted", seed)[0].shift_s for seed in range(60)}) > 15


def test_a_record_too_short_to_be_shifted_is_left_out():
    wrong = Wrong(5.0, 3.0, 1.5)
    assert shortest_shifted_s(*wrong) == 14.5
    every = streams(a=579, b=580)
    assert of_draws(every, "a", "shifted", 0, wrong) == []
    [speech] = of_draws(every, "b", "shifted", 0, wrong, draws=8)
    assert speech.shift_s == 5.0


def test_the_only_record_of_an_actor_has_no_partner():
    assert of_draws(streams(a=50), "a", "shuffled") == []


def test_frame_labels_need_segments_without_gaps():
    table = segments.from_labels("a", ["p1", "p1", "p2", "p1"], 1 / FRAME_S)
    assert frame_labels(table)["a"].tolist() == ["p1", "p1", "p2", "p1"]
    with pytest.raises(UserError, match="prosody segments of record a"):
        frame_labels(table.drop(index=1))


def syllables_at(peaks_s, record="a", length_s=0.1):
    """Syllables around these peaks, known 0.15 s after them."""
    peaks = np.asarray(peaks_s, dtype=float)
    return pd.DataFrame(
        {
            "record": record,
            "syllable": np.arange(len(peaks)),
            "start_s": peaks - length_s / 2,
            "peak_s": peaks,
            "end_s": peaks + length_s / 2,
            "known_s": peaks + 0.15,
            "intensity_db": -20.0 - np.arange(len(peaks)),
        }
    )


def test_own_syllables_stay_where_they_are():
    own = syllables_at([0.1, 0.4, 1.01])  # the last one peaks after the last whole frame
    every = Streams({"a": streams(a=40).labels["a"]}, syllables={"a": own})
    pd.testing.assert_frame_equal(of_draws(every, "a")[0].syllables, own)


@pytest.mark.parametrize("drive", ["shuffled", "shifted"])
@pytest.mark.parametrize("seed", range(5))
def test_syllables_move_with_the_frames_in_which_they_peak(drive, seed):
    """A syllable of the source that peaks in a frame peaks in each frame of the record which that frame drives."""
    rng = np.random.default_rng(seed)
    n = {"a": 400, "b": 500, "c": 300}
    tables = {
        name: syllables_at(np.sort(rng.uniform(0.05, k * FRAME_S - 0.01, k // 10)), name) for name, k in n.items()
    }
    every = Streams(streams(**n).labels, streams(**n).prosody, syllables=tables)
    for speech in of_draws(every, "a", drive, seed, draws=3):
        source = tables[speech.driving_record]
        frames = (speech.prosody["intensity"].to_numpy() % 1000).astype(int)
        at = dict(iter(source.groupby((source["peak_s"] // FRAME_S).astype(int))))
        moved = speech.syllables
        assert set(moved["record"]) == {"a"}
        assert moved["syllable"].tolist() == list(range(len(moved)))
        own = moved.groupby(((moved["peak_s"] + 1e-9) // FRAME_S).astype(int))
        heard = {frame: rows["intensity_db"].tolist() for frame, rows in own if frame < len(frames)}
        wanted = {k: at[frame]["intensity_db"].tolist() for k, frame in enumerate(frames) if frame in at}
        assert heard == wanted
        inside = moved[(moved["start_s"] > 0) & (moved["end_s"] < n["a"] * FRAME_S)]
        assert (inside["start_s"] <= inside["peak_s"]).all()
        assert (inside["peak_s"] <= inside["end_s"]).all()
        np.testing.assert_allclose(inside["known_s"] - inside["peak_s"], 0.15)
        assert ((moved["end_s"] - moved["start_s"]) < 0.1 + 1e-9).all()
