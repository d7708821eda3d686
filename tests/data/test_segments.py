"""Properties of conversions between labels, segments and times."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import segments
from cospeech.errors import UserError

labels = st.lists(st.sampled_from(["rest", "left", "right"]), min_size=1, max_size=200)
rates = st.sampled_from([20.0, 25.0, 29.97, 30.0, 40.0, 100.0])


@given(labels, rates)
def test_labels_to_segments_and_back(stream, fps):
    table = segments.from_labels("a", stream, fps)
    segments.check(table, "a")
    assert segments.to_labels(table).tolist() == stream
    assert table["end_frame"].iloc[-1] == len(stream)
    assert (table["label"].to_numpy()[1:] != table["label"].to_numpy()[:-1]).all()


@given(st.lists(st.tuples(st.integers(1, 40), st.sampled_from(["a", "b"])), min_size=1, max_size=20), rates)
def test_neighbours_with_the_same_label_stay_two_segments(phrases, fps):
    lengths = [length for length, _ in phrases]
    stream = np.repeat([label for _, label in phrases], lengths)
    begins = np.zeros(len(stream), dtype=bool)
    begins[np.cumsum([0, *lengths[:-1]])] = True
    table = segments.from_labels("r", stream, fps, begins)
    assert (table["end_frame"] - table["start_frame"]).tolist() == lengths
    assert table["label"].tolist() == [label for _, label in phrases]


@given(labels, rates, rates)
def test_resampling_takes_the_label_at_each_frame_centre(stream, fps, new_fps):
    table = segments.from_labels("a", stream, fps)
    n_frames = max(1, int(len(stream) / fps * new_fps))
    resampled = segments.resample(table, n_frames, new_fps)
    segments.check(resampled, "a")
    expected = [stream[min(int((k + 0.5) / new_fps * fps + 1e-9), len(stream) - 1)] for k in range(n_frames)]
    centres = (np.arange(n_frames) + 0.5) / new_fps * fps
    clear = np.abs(centres - np.round(centres)) > 1e-6  # a centre on a boundary belongs to the later segment
    assert np.array_equal(segments.to_labels(resampled)[clear], np.array(expected, dtype=object)[clear])


def test_a_frame_centre_on_a_boundary_belongs_to_the_later_segment():
    """At 20 fps, every centre lies on a boundary of 25 ms."""
    n_frames = 2000
    table = segments.from_starts("a", np.arange(n_frames), np.arange(n_frames).astype(str), n_frames, 1 / 0.025)
    resampled = segments.resample(table, n_frames // 2, 20.0)
    assert resampled["label"].tolist() == [str(2 * k + 1) for k in range(n_frames // 2)]
    assert segments.at_times(table, [-1.0, 0.0, 0.025, 0.05, 49.975, 50.0, 99.0]).tolist() == [
        0,
        0,
        1,
        2,
        1999,
        1999,
        1999,
    ]


@given(labels, rates)
def test_resampling_to_the_same_grid_changes_nothing(stream, fps):
    table = segments.from_labels("a", stream, fps)
    pd.testing.assert_frame_equal(segments.resample(table, len(stream), fps), table)


def test_resampling_keeps_neighbours_with_the_same_label_apart():
    table = segments.from_starts("a", [0, 10], ["left", "left"], 20, 20.0)
    assert segments.resample(table, 40, 40.0)["start_frame"].tolist() == [0, 20]


@pytest.mark.parametrize(
    ("starts", "ends"), [([1], [5]), ([0, 4], [5, 9]), ([0, 6], [5, 9]), ([0, 5], [5, 5]), ([], [])]
)
def test_gaps_overlaps_and_empty_segments_are_refused(starts, ends):
    table = pd.DataFrame({"start_frame": np.array(starts, dtype=int), "end_frame": np.array(ends, dtype=int)})
    with pytest.raises(UserError, match=r"^here: "):
        segments.check(table, "here")


def test_frame_times_are_centres():
    assert segments.frame_times(3, 20.0).tolist() == pytest.approx([0.025, 0.075, 0.125])
