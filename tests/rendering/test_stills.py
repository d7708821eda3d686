"""Still images: the most typical frame of a class, and the frames in which the arms are most active."""

import numpy as np
import pandas as pd
import pytest
from dancer import motion, phrases

from cospeech.data import segments
from cospeech.formats import canvas
from cospeech.motion import skeleton
from cospeech.rendering import stills

ORDER = ("raise_both", "rest", "left", "open", "right")


def posed(degrees, fps=20.0):
    """A body that raises its left arm forward by the given angle in each frame."""
    angles = np.zeros((len(degrees), len(skeleton.JOINTS), 3))
    angles[:, skeleton.JOINTS.index("left_arm"), 0] = -np.asarray(degrees)
    angles[:, skeleton.JOINTS.index("hips"), 1] = np.linspace(0, 300, len(degrees))  # turning has no effect
    return skeleton.motion_table(np.random.default_rng(0).normal(size=(len(degrees), 3)), angles, fps)


def test_the_typical_frame_is_closest_to_the_mean_stroke():
    # The strokes, i.e. the middle thirds, are 10, 10, 10 and 50, 60, 70; the mean of the second one is 60.
    moves = posed([0, 0, 0, 10, 10, 10, 0, 0, 0, 0, 0, 0, 50, 60, 70, 0, 0, 0])
    table = segments.from_starts("a", [0, 9], ["rest", "left"], 18, 20.0)
    found = stills.typical_frames(table, {"a": moves}, ORDER).set_index("label")
    assert found.loc["left", "frame"] == 13
    assert found.loc["rest", "frame"] == 3
    assert found.loc["rest", "distance_m"] == pytest.approx(0)
    assert found.loc["left", "time_s"] == pytest.approx(13.5 / 20)
    assert list(found.index) == ["rest", "left"]  # in the given order, without classes that do not occur
    assert found["n_phrases"].tolist() == [1, 1]


def test_phrases_are_counted_over_all_records():
    records = {"a": motion(100, seed=0), "b": motion(100, seed=1)}
    table = pd.concat([phrases(100, seed=k, record=record) for k, record in enumerate(records)])
    found = stills.typical_frames(table, records, ORDER).set_index("label")
    assert found["n_phrases"].to_dict() == table["label"].value_counts().to_dict()
    image = stills.grid(found.reset_index(), records, {})
    assert image.shape[1] == stills.GRID_COLUMNS * stills.CELL_PX[1]
    assert image.std() > 10


def test_the_strip_shows_where_the_arms_are_most_active():
    degrees = np.concatenate([np.zeros(40), 60 * np.abs(np.sin(np.arange(30))), np.zeros(40)])
    frames = stills.most_active_frames(posed(degrees), 8, 4)
    assert np.diff(frames).tolist() == [4] * 7
    assert frames[0] >= 38
    assert frames[-1] <= 71
    assert stills.most_active_frames(posed(np.zeros(5)), 8, 4).tolist() == [0, 0, 1, 1, 2, 2, 3, 4]


def test_a_strip_has_one_row_per_motion(tmp_path):
    image = stills.strip([motion(100), motion(100, seed=1)], [phrases(100)] * 2, ["first", "second"])
    assert image.shape[1] == stills.STRIP_FRAMES * stills.FRAME_PX[1]
    canvas.save(image, tmp_path / "strip.png")
    first = (tmp_path / "strip.png").read_bytes()
    canvas.save(image, tmp_path / "strip.png")
    assert (tmp_path / "strip.png").read_bytes() == first
    assert b"Software" not in first
