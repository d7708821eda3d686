"""What tells a lost marker from another of its colour: whose disc it is, and whether it has the right size."""

import numpy as np
import pytest
from pictures import draw

from cospeech.capture.tracking import colour, disc, reacquisition
from cospeech.geometry.camera import project
from cospeech.geometry.triangulate import packed
from cospeech.motion.markers import NAMES, RADIUS_M
from cospeech.studio import rig

CAMERAS = rig.cameras(696, 7)
POINT_M = np.array([-0.23, 1.12, -0.37])
NOTHING = np.empty((0, 2))
UNKNOWN = np.array(disc.UNKNOWN)


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
    found = reacquisition.agree(packed(CAMERAS), seen_discs([right, left], 1.0), (right, 0), (left, 0), 1.2)
    np.testing.assert_allclose(found.point_m, POINT_M, atol=1e-6)
    assert found.used.tolist() == [True, False, False, False, True]
    half = reacquisition.agree(packed(CAMERAS), seen_discs([right, left], 0.5), (right, 0), (left, 0), 1.2)
    assert half.used.any()  # something may hide part of a disc
    other = reacquisition.agree(packed(CAMERAS), seen_discs([right, left], 1.15), (right, 0), (left, 0), 1.2)
    assert not other.used.any()
    assert np.isnan(other.point_m).all()


def test_where_three_views_agree_no_size_is_asked():
    found = reacquisition.agree(packed(CAMERAS), seen_discs([0, 1, 4], 1.5), (0, 0), (4, 0), 1.2)
    assert found.used.sum() == 3


@pytest.mark.parametrize(("owned", "free"), [(NOTHING, [20.0, 60.0]), (np.array([[60.0, 30.0]]), [20.0])])
def test_a_disc_of_another_marker_is_not_free(owned, free):
    planes = tuple(draw((100, 60), [(20, 30, 6, "red"), (60, 30, 6, "red")]))
    mixer = colour.mixers(colour.chroma(colour.SKIN))["red"]
    found = reacquisition.discs(*planes, 100, *mixer, np.array([35.0, 30.0]), 60.0, 6.0, UNKNOWN, owned)
    assert sorted(np.round(found[:, 0])) == free


def standing():
    """Markers (15, 3) of a body whose links alone matter: hands hang 0.27 m below the elbows."""
    body = np.random.default_rng(0).normal(0.0, 0.3, (len(NAMES), 3))
    for side, sign in (("left", 1), ("right", -1)):
        body[NAMES.index(f"{side}_elbow")] = sign * 0.2, 1.13, 0.1
        body[NAMES.index(f"{side}_hand")] = sign * 0.2, 0.86, 0.1
    return body


def test_two_lost_hands_are_told_apart_by_their_forearms():
    """Both were last seen far from where they are now, each nearer to where the other one is."""
    body = standing()
    hands = np.array([NAMES.index("left_hand"), NAMES.index("right_hand")])
    now = np.array([[0.04, 1.11, 0.30], [-0.04, 1.12, 0.29]])
    radius = np.array([[c.focal_px[0] * RADIUS_M / np.linalg.norm(c.place_m - p) for c in CAMERAS] for p in now])
    pictures = [
        tuple(draw((696, 520), [(*project(c, p), radius[k, view], "red") for k, p in enumerate(now)]))
        for view, c in enumerate(CAMERAS)
    ]
    expected = now[::-1]
    lost = reacquisition.Lost(
        hands, expected, np.array([[project(c, p) for c in CAMERAS] for p in expected]), radius,
        np.full(2, 0.3), np.full(2, 0.02), np.tile(UNKNOWN, (5, 1)),
    )  # fmt: skip
    known = body.copy()
    known[hands] = np.nan
    mixer, none = colour.mixers(colour.chroma(colour.SKIN))["red"], np.empty((0, len(CAMERAS), 2))
    found = reacquisition.seek(
        packed(CAMERAS), np.full(5, 696), pictures, mixer, lost, none, known, reacquisition.lengths(body), 1.2
    )  # fmt: skip
    for hand, point in zip(hands, now, strict=True):
        np.testing.assert_allclose(found[hand].point_m, point, atol=2e-3)


def best(discs, limit_px=1.2):
    """What ``recovery._best`` makes of discs for a marker that is lost at ``POINT_M`` and linked to nothing."""
    no_links, nobody = np.full((1, len(NAMES)), np.nan), np.full((len(NAMES), 3), np.nan)
    return reacquisition._best(
        packed(CAMERAS), discs, POINT_M[None], np.full(1, 0.3), np.full(1, 0.3), no_links, no_links, nobody, limit_px
    )


def test_two_views_that_nobody_contradicts_must_meet_closely():
    discs = seen_discs([0, 2], 1.0)
    assert best(discs).used.sum() == 2
    discs[2, 0, 1] += 1.3  # nearly across the line on which the first view sees the marker: half of it is a miss
    assert best(discs, 1e3).rms == pytest.approx(0.6, abs=0.1)
    assert not best(discs).used.any()
    discs[3] = seen_discs([3], 1.0)[3]
    assert best(discs).used.sum() == 3


@pytest.mark.parametrize(("size", "whole"), [(0.85, True), (1.0, True), (1.2, True), (0.7, False), (1.4, False)])
def test_a_round_blob_of_nearly_the_size_is_a_whole_disc_at_another_depth(size, whole):
    planes = tuple(draw((60, 60), [(30.3, 29.6, size * 9, "red")]))
    mixer = colour.mixers(colour.chroma(colour.SKIN))["red"]
    found = reacquisition.discs(*planes, 60, *mixer, np.array([32.0, 30.0]), 20.0, 9.0, UNKNOWN, NOTHING)
    assert (len(found) == 1 and found[0, 3] == 1.0) == whole
    if whole:
        np.testing.assert_allclose(found[0, :2], [30.3, 29.6], atol=0.1)


def test_the_skull_is_stiffer_than_skin_and_clothes():
    body = standing()
    lengths = reacquisition.lengths(body)
    for one, other, told in [("head_left", "head_right", True), ("left_elbow", "left_hand", False)]:
        i, j = NAMES.index(one), NAMES.index(other)
        for stretch, misfit in [(1.05, False), (1.15, told), (1.3, True)]:
            pulled = body.copy()
            pulled[j] = body[i] + stretch * (body[j] - body[i])
            assert lengths.misfits(pulled)[i, j] == misfit


def test_a_lost_marker_is_sought_as_far_as_it_may_have_gone():
    hidden, unsure_m = np.array([0, 0, 2, 30]), np.array([0.04, 0.2, 0.2, 9.0])
    np.testing.assert_allclose(reacquisition.search_radius_m(hidden, unsure_m), [0.12, 0.2, 0.36, 0.6])


def test_two_cut_discs_count_only_near_the_prediction():
    """Two views that see a hand in part may meet by chance; a whole disc in both is enough farther away too."""
    discs, nothing = seen_discs([0, 4], 0.5), np.full((1, 3), np.nan)
    away = POINT_M + np.array([0.1, 0.0, 0.0])
    for share, expected_m, told in [(0.5, away, False), (0.5, POINT_M + 0.01, True), (1.0, away, True)]:
        discs[..., 3] = share
        found = reacquisition.agree(packed(CAMERAS), discs, (0, 0), (4, 0), 1.2)
        cost = reacquisition._cost(found, expected_m, 0.3, 0.03, np.full(1, np.nan), np.full(1, np.nan), nothing)
        assert np.isfinite(cost) == told


def test_a_hand_that_ran_away_is_sought_where_its_forearm_reaches():
    body = standing()
    hand, elbow = NAMES.index("right_hand"), NAMES.index("right_elbow")
    places, known = body.copy(), body.copy()
    places[hand], known[hand] = (-1.04, 1.12, 0.27), np.nan
    held = reacquisition.lengths(body).held(places, known)
    np.testing.assert_allclose(np.linalg.norm(held[hand] - body[elbow]), 0.27)
    np.testing.assert_array_equal(np.delete(held, hand, axis=0), np.delete(body, hand, axis=0))
