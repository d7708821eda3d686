"""Processing of the detections of a whole take."""

import numpy as np
import pytest

from cospeech.capture.tracking import detections
from cospeech.capture.tracking.detections import Detections
from cospeech.motion.markers import NAMES

N_FRAMES, N_VIEWS, HAND = 9, 5, NAMES.index("left_hand")


def shown(frames, n_views, corrected=False):
    """Return the detections of a take in which ``n_views`` see the left hand in some frames, and all see the rest."""
    used = np.ones((N_FRAMES, len(NAMES), N_VIEWS), dtype=bool)
    used[:, HAND] = False
    used[frames, HAND, :n_views] = True
    by_hand = used & corrected
    points = np.where(used.any(axis=-1, keepdims=True), 1.0, np.nan) * np.ones(3)
    pixels = np.where(used[..., None], 10.0, np.nan) * np.ones(2)
    return Detections(pixels, used * 50, by_hand, used, points, np.where(used.any(axis=-1), 0.1, np.nan))


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
def test_isolated_points_from_two_views_are_dropped(frames, n_views, corrected, left):
    """Points at the ends of the take, whose neighbours are unknown, and manual corrections are kept."""
    before = shown(frames, n_views, corrected)
    after = detections.confirmed(before)
    assert np.flatnonzero(np.isfinite(after.points_m[:, HAND, 0])).tolist() == left
    for name, value in vars(shown(left, n_views, corrected)).items():
        np.testing.assert_array_equal(vars(after)[name], value, err_msg=name)
