"""Clips for studies: within 8 to 12 s, at phrases, and without anything that names the version."""

from itertools import pairwise

import numpy as np
import pytest

from cospeech.data import segments, tables
from cospeech.motion import skeleton
from cospeech.rendering import survey_clips as clips
from cospeech.rendering import video

FPS = 20.0


@pytest.mark.parametrize("seed", range(50))
def test_clips_follow_one_another_and_end_at_phrases_where_possible(seed):
    rng = np.random.default_rng(seed)
    starts = np.concatenate([[0.0], np.cumsum(rng.exponential(rng.uniform(1.0, 8.0), 60))])
    duration_s = starts[-1] + 1.0
    found = clips.spans(starts, duration_s)
    assert found[0].start_s == 0.0
    for one, following in pairwise(found):
        assert one.end_s == following.start_s
    for span in found:
        length_s = span.end_s - span.start_s
        assert clips.SHORTEST_S - 1e-9 <= length_s <= clips.LONGEST_S + 1e-9
        inside = starts[(starts >= span.start_s + clips.SHORTEST_S) & (starts <= span.start_s + clips.LONGEST_S)]
        if len(inside):
            assert np.abs(np.append(starts, duration_s) - span.end_s).min() < 1e-9
            assert abs(length_s - 10.0) <= np.abs(inside - span.start_s - 10.0).min() + 1e-9
    assert duration_s - found[-1].end_s < clips.LONGEST_S


@pytest.mark.parametrize(("duration_s", "n_clips"), [(7.9, 0), (8.0, 1), (12.0, 1), (20.0, 2), (30.0, 2)])
def test_a_record_with_one_phrase_is_cut_by_length(duration_s, n_clips):
    found = clips.spans(np.zeros(1), duration_s)
    assert len(found) == n_clips
    assert all(span.end_s <= duration_s for span in found)


def test_a_clip_is_the_motion_of_its_seconds_and_shows_no_label():
    motion = skeleton.standing(400, FPS)
    motion["left_arm_x_deg"] = np.arange(400.0)
    phrases = segments.from_starts("r", [0, 200], ["rest", "left"], 400, FPS)
    panel = clips.cut(motion, phrases, clips.Span(2.5, 11.0))
    assert panel.motion["left_arm_x_deg"].tolist() == list(range(50, 220))
    assert panel.motion[["frame", "time_s"]].iloc[0].tolist() == [0.0, 0.025]
    labelled, blank = (
        next(iter(video.render([one], 10.0, 120, ""))) for one in (video.Panel("", panel.motion, phrases), panel)
    )
    assert (labelled != blank).any()
    again = clips.cut(motion, phrases.assign(label="right"), clips.Span(2.5, 11.0))
    np.testing.assert_array_equal(next(iter(video.render([again], 10.0, 120, ""))), blank)


def test_the_table_names_every_file():
    table = clips.table("r", [clips.Span(0.0, 9.0), clips.Span(9.0, 19.0)], ["original", "controller"])
    tables.validate(table, "survey_clips", "clips")
    assert table["file"].tolist() == ["0~original.mp4", "0~controller.mp4", "1~original.mp4", "1~controller.mp4"]
