"""What is made of the sights of a whole film."""

import numpy as np
import pytest

from cospeech.capture.tracking import detections
from cospeech.capture.tracking.detections import Sights
from cospeech.motion.markers import NAMES

N_FRAMES, N_VIEWS, HAND = 9, 5, NAMES.index("left_hand")


def shown(frames, n_views, corrected=False):
    """Sights of a film in which the left hand is seen in some frames by as many views, and the rest always by all."""
    used = np.ones((N_FRAMES, len(NAMES), N_VIEWS), dtype=bool)
    used[:, HAND] = False
    used[frames, HAND, :n_views] = True
    by_hand = used & corrected
    points = np.where(used.any(axis=-1, keepdims=True), 1.0, np.nan) * np.ones(3)
    pixels = np.where(used[..., None], 10.0, np.nan) * np.ones(2)
    return Sights(pixels, used * 50, by_hand, used, points, np.where(used.any(axis=-1), 0.1, np.nan))


@pytest.mark.parametrize(
    ("frames", "n_views", "corrected", "left"),
    [
        ([4], 2, False, []),
        ([4], 3, False, [4]),
        ([4, 5], 2, False, [4, 5]),
        ([2, 4], 2, False, []),
        ([0], 2, False, [0]),
        ([8], 2, False, [8]),
        ([4], 2, True, [4]),
    ],
)
def test_what_two_views_show_in_one_frame_only_is_dropped(frames, n_views, corrected, left):
    """At the film's ends nobody knows the frame beside; a person who corrected a sight is believed."""
    before = shown(frames, n_views, corrected)
    after = detections.confirmed(before)
    assert np.flatnonzero(np.isfinite(after.points_m[:, HAND, 0])).tolist() == left
    for name, value in vars(shown(left, n_views, corrected)).items():
        np.testing.assert_array_equal(vars(after)[name], value, err_msg=name)
