"""The strip of stick figure and body that give route directions."""

import numpy as np
import pandas as pd

from cospeech.motion import skeleton
from cospeech.rendering import directions


def answer():
    """Ten seconds in which the left hand moves at a keyword, an accent follows, and two keywords adjoin."""
    times_s = (np.arange(300) + 0.5) / 30.0
    table = pd.DataFrame({"record": "a", "frame": np.arange(300), "time_s": times_s})
    table["keyword"], table["keyword_share"], table["accent_share"] = None, np.nan, np.nan
    for label, first in (("left", 60), ("right", 150), ("straight", 165)):
        table.loc[first : first + 14, "keyword"] = label
        table.loc[first : first + 14, "keyword_share"] = (np.arange(15) + 0.5) / 15
    table.loc[90:98, "accent_share"] = (np.arange(9) + 0.5) / 9
    moved = {"left_x_m": 0.2, "left_y_m": 0.2, "right_x_m": 0.0, "right_y_m": 0.0}
    return table.assign(head_px=np.where(table["accent_share"].notna(), 3.0, 0.0), **moved)


def test_the_strip_shows_rest_and_the_middle_of_each_event():
    assert directions.shown_frames(answer()).tolist() == [0, 67, 94, 157, 172]
    height, width = directions.CELL_PX
    image = directions.strip(answer(), "a")
    assert image.shape[1:] == (5 * width, 3)
    stick, body = image[26 : 26 + height].astype(int), image[26 + height :].astype(int)
    for row in (stick, body):
        cells = np.split(row, 5, axis=1)
        assert all(np.ptp(cell[40:200], axis=(0, 1)).min() > 100 for cell in cells)
    dark = [(cell[40:210] < 100).all(axis=2).sum() for cell in np.split(stick, 5, axis=1)]
    assert min(dark) > 300


def test_arms_and_head_of_the_body_move_at_their_own_events_only():
    position = directions.pose(answer()).position
    rest = position[0]
    hands = [skeleton.JOINTS.index(f"{side}_hand") for side in ("left", "right")]
    left, right, straight = (position[frame, hands] - rest[hands] for frame in (67, 157, 172))
    assert left[0, 0] > 0.2
    np.testing.assert_allclose(left[1], 0.0, atol=1e-12)
    assert right[1, 0] < -0.2
    np.testing.assert_allclose(right[0], 0.0, atol=1e-12)
    assert (straight[:, 2] > 0.1).all()
    turned = directions.pose(answer()).orientation[:, skeleton.JOINTS.index("head")]
    assert np.degrees(np.arccos(turned[94, 2, 2])) > 9.0
    np.testing.assert_allclose(turned[67], np.eye(3), atol=1e-12)
