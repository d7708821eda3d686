"""Text and shapes on an image are clipped on every side."""

import numpy as np
import pytest

from cospeech.formats import canvas


@pytest.mark.parametrize(("top", "left"), [(-2, -1), (-2, 6), (6, -1), (6, 6), (2, 3), (-9, 2), (2, 40)])
def test_what_is_outside_is_clipped(top, left):
    image = np.zeros((8, 9, 3), dtype=np.uint8)
    opacity = np.linspace(0.2, 1, 12, dtype=np.float32).reshape(4, 3)
    canvas.lay(image, top, left, (100, 200, 50), opacity)
    room = np.zeros((80, 80))
    room[20 + top : 24 + top, 20 + left : 23 + left] = opacity
    np.testing.assert_array_equal(image, np.round(room[20:28, 20:29, None] * [100, 200, 50]).astype(np.uint8))


def test_text_stays_inside_the_image():
    image = np.full((24, 20, 3), 255, dtype=np.uint8)
    canvas.write(image, "a long text in a small picture", 5, 12, 14)
    assert (image != 255).any()
