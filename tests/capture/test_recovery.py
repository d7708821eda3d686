"""What tells a lost marker from another of its colour: whose disc it is, and whether it has the right size."""

import numpy as np
import pytest
from pictures import draw

from cospeech.capture import colour, recovery
from cospeech.capture.camera import project
from cospeech.capture.triangulate import packed
from cospeech.markers import RADIUS_M
from cospeech.studio import rig

CAMERAS = rig.cameras(696, 7)
POINT_M = np.array([-0.23, 1.12, -0.37])
NOTHING = np.empty((0, 2))


def seen_discs(views, larger):
    """Discs (C, 1, 4) of a marker at ``POINT_M`` in some views, ``larger`` times as large as they would be."""
    discs = np.full((len(CAMERAS), 1, 4), np.nan)
    for view in views:
        camera = CAMERAS[view]
        radius = camera.focal_px[0] * RADIUS_M / np.linalg.norm(camera.place_m - POINT_M)
        discs[view, 0] = *project(camera, POINT_M), larger * np.pi * radius**2, 1.0
    return discs


def test_the_rays_of_two_hands_at_either_side_do_not_make_one_hand_between_them():
    right, left = 0, 4
    found = recovery.agree(packed(CAMERAS), seen_discs([right, left], 1.0), (right, 0), (left, 0), 1.2)
    np.testing.assert_allclose(found.point_m, POINT_M, atol=1e-6)
    assert found.used.tolist() == [True, False, False, False, True]
    half = recovery.agree(packed(CAMERAS), seen_discs([right, left], 0.5), (right, 0), (left, 0), 1.2)
    assert half.used.any()  # something may hide part of a disc
    other = recovery.agree(packed(CAMERAS), seen_discs([right, left], 1.5), (right, 0), (left, 0), 1.2)
    assert not other.used.any()
    assert np.isnan(other.point_m).all()


def test_where_three_views_agree_no_size_is_asked():
    found = recovery.agree(packed(CAMERAS), seen_discs([0, 1, 4], 1.5), (0, 0), (4, 0), 1.2)
    assert found.used.sum() == 3


@pytest.mark.parametrize(
    ("owned", "rivals", "free"),
    [
        (NOTHING, NOTHING, [20.0, 60.0]),
        (np.array([[60.0, 30.0]]), NOTHING, [20.0]),
        (NOTHING, np.array([[70.0, 30.0]]), [20.0]),  # expected nearer to the second disc than ours is
        (NOTHING, np.array([[95.0, 30.0]]), [20.0, 60.0]),
    ],
)
def test_a_disc_belongs_to_the_lost_marker_that_is_expected_nearest(owned, rivals, free):
    planes = tuple(draw((100, 60), [(20, 30, 6, "red"), (60, 30, 6, "red")]))
    mixer = colour.mixers(colour.chroma(colour.SKIN))["red"]
    found = recovery.discs(*planes, 100, *mixer, np.array([35.0, 30.0]), 60.0, 6.0, owned, rivals)
    assert sorted(np.round(found[:, 0])) == free
