"""Portraits of heads: a turned head looks to its side, curves and cursor are where the time is, and sound is kept."""

import av
import numpy as np
import pytest
import soundfile

from cospeech.motion import head
from cospeech.rendering import figure, heads, video

FPS = 30.0


def panel(title="original", seconds=2.0, angles=(0.0, 0.0, 0.0)):
    return heads.Panel(title, head.table(np.tile(np.asarray(angles, dtype=float), (round(seconds * FPS), 1)), FPS))


def portrait(angles):
    """One picture of a head in front of a white wall."""
    image = np.full((240, 240, 3), 255, dtype=np.uint8)
    moving = figure.pose(heads.body(np.array([angles], dtype=float), FPS))
    figure.Painter().figure(moving, figure.portrait((0, 0, 240, 240)), 0.0).draw(image, 0)
    return image


def lips(image):
    """The mean row and column of the pixels that are redder than skin, within the head."""
    part = image[:165, 60:180].astype(int)
    ratio = part[..., 0] - part[..., 1] - 45
    rows, columns = np.nonzero((ratio > 0) & (part.sum(axis=-1) < 600))
    return rows.mean(), columns.mean() + 60


def test_the_mouth_follows_the_head():
    row, column = lips(portrait((0, 0, 0)))
    assert abs(column - 120) < 1
    assert lips(portrait((0, 20, 0)))[1] > column + 5  # to the person's left, the right of the picture
    assert lips(portrait((0, -20, 0)))[1] < column - 5
    assert lips(portrait((15, 0, 0)))[0] > row + 3  # down
    assert lips(portrait((0, 0, 15)))[1] < column - 3  # towards the right shoulder


def test_a_video_has_a_panel_for_each_head_and_a_cursor_that_moves():
    panels = [panel(), panel("system", angles=(0, 25, 0))]
    images = [image.copy() for image in heads.render(panels, 10.0, 180, 2.0, "eda_1")]
    height, width = video.panel_size(180)
    assert len(images) == 20
    assert images[0].shape == (height, 2 * width, 3)
    assert not np.array_equal(images[0][:130, :width], images[0][:130, width:])
    strip = [image[140:160, :width].astype(int).sum(axis=(0, 2)) for image in images]
    assert np.argmin(strip[1]) < np.argmin(strip[10]) < np.argmin(strip[19])


def test_the_video_is_as_long_as_it_should_be_and_has_the_sound(tmp_path):
    soundfile.write(tmp_path / "a.wav", 0.1 * np.sin(np.arange(32000) / 9), 16000)
    heads.write_video(tmp_path / "a.mp4", [panel()], "x", 10.0, 120, 1.5, tmp_path / "a.wav")
    with av.open(str(tmp_path / "a.mp4")) as clip:
        assert clip.streams.video[0].frames == 15
        assert len(clip.streams.audio) == 1


def test_a_strip_shows_where_the_head_moves_most():
    angles = np.zeros((600, 3))
    angles[300:420, 1] = 20.0 * np.sin(np.arange(120) / 6.0)
    times_s = heads.liveliest(head.table(angles, FPS))
    assert len(times_s) == heads.STRIP_PICTURES
    assert times_s[0] == pytest.approx(10.0, abs=0.6)
    image = heads.strip([panel(), panel("system")], times_s)
    assert image.shape == (2 * (heads.PICTURE_PX[0] + 28), heads.STRIP_PICTURES * heads.PICTURE_PX[1], 3)


@pytest.mark.parametrize(("n_panels", "rows", "columns"), [(1, 1, 1), (3, 1, 3), (4, 2, 2), (5, 2, 3), (6, 2, 3)])
def test_many_panels_stand_in_rows(n_panels, rows, columns):
    panels = [np.full((4, 6, 3), shade, dtype=np.uint8) for shade in range(1, n_panels + 1)]
    [laid] = [image.copy() for image in heads.in_rows([np.hstack(panels)], 6)]
    assert laid.shape == (4 * rows, 6 * columns, 3)
    for place, panel in enumerate(panels):
        top, left = 4 * (place // columns), 6 * (place % columns)
        np.testing.assert_array_equal(laid[top : top + 4, left : left + 6], panel)
