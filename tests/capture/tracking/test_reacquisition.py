"""Reacquisition distinguishes a lost marker from others of its colour by free discs, disc size and bone lengths."""

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
    """Return discs (C, 1, 4) of a marker at ``POINT_M`` in some views, ``larger`` times their true area."""
    discs = np.full((len(CAMERAS), 1, 4), np.nan)
    for view in views:
        camera = CAMERAS[view]
        radius = camera.focal_px[0] * RADIUS_M / np.linalg.norm(camera.place_m - POINT_M)
        discs[view, 0] = *project(camera, POINT_M), larger * np.pi * radius**2, 1.0
    return discs


def test_rays_to_two_hands_are_not_combined_into_one_hand_between_them():
    right, left = 0, 4
    found = reacquisition.point_from_pair(packed(CAMERAS), seen_discs([right, left], 1.0), (right, 0), (left, 0), 1.2)
    np.testing.assert_allclose(found.point_m, POINT_M, atol=1e-6)
    assert found.used.tolist() == [True, False, False, False, True]
    half = reacquisition.point_from_pair(packed(CAMERAS), seen_discs([right, left], 0.5), (right, 0), (left, 0), 1.2)
    assert half.used.any()  # a disc may be partly occluded
    other = reacquisition.point_from_pair(
        packed(CAMERAS), seen_discs([right, left], 1.15), (right, 0), (left, 0), 1.2
    )
    assert not other.used.any()
    assert np.isnan(other.point_m).all()


def test_disc_size_is_not_checked_if_three_views_agree():
    found = reacquisition.point_from_pair(packed(CAMERAS), seen_discs([0, 1, 4], 1.5), (0, 0), (4, 0), 1.2)
    assert found.used.sum() == 3


@pytest.mark.parametrize(("claimed", "free"), [(NOTHING, [20.0, 60.0]), (np.array([[60.0, 30.0]]), [20.0])])
def test_a_disc_of_another_marker_is_not_free(claimed, free):
    planes = tuple(draw((100, 60), [(20, 30, 6, "red"), (60, 30, 6, "red")]))
    unmixer = colour.unmixers(colour.chroma(colour.SKIN))["red"]
    found = reacquisition.free_discs(*planes, 100, *unmixer, np.array([35.0, 30.0]), 60.0, 6.0, UNKNOWN, claimed)
    assert sorted(np.round(found[:, 0])) == free


def standing():
    """Return markers (15, 3) of a body of which only the links matter: hands hang 0.27 m below the elbows."""
    body = np.random.default_rng(0).normal(0.0, 0.3, (len(NAMES), 3))
    for side, sign in (("left", 1), ("right", -1)):
        body[NAMES.index(f"{side}_elbow")] = sign * 0.2, 1.13, 0.1
        body[NAMES.index(f"{side}_hand")] = sign * 0.2, 0.86, 0.1
    return body


def test_two_lost_hands_are_distinguished_by_their_forearms():
    """Both were last seen far from where they are now, each closer to the current position of the other."""
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
    unmixer, none = colour.unmixers(colour.chroma(colour.SKIN))["red"], np.empty((0, len(CAMERAS), 2))
    found = reacquisition.reacquire(
        packed(CAMERAS), np.full(5, 696), pictures, unmixer, lost, none, known, reacquisition.link_lengths(body), 1.2
    )  # fmt: skip
    for hand, point in zip(hands, now, strict=True):
        np.testing.assert_allclose(found[hand].point_m, point, atol=2e-3)


def best(discs, limit_px=1.2):
    """Return the result of ``reacquisition._best`` for a marker lost at ``POINT_M`` and without links."""
    no_links, nobody = np.full((1, len(NAMES)), np.nan), np.full((len(NAMES), 3), np.nan)
    return reacquisition._best(
        packed(CAMERAS), discs, POINT_M[None], np.full(1, 0.3), np.full(1, 0.3), no_links, no_links, nobody, limit_px
    )


def test_two_views_without_a_third_must_agree_closely():
    discs = seen_discs([0, 2], 1.0)
    assert best(discs).used.sum() == 2
    discs[2, 0, 1] += 1.3  # nearly perpendicular to the epipolar line: half of it is reprojection error
    assert best(discs, 1e3).rms == pytest.approx(0.6, abs=0.1)
    assert not best(discs).used.any()
    discs[3] = seen_discs([3], 1.0)[3]
    assert best(discs).used.sum() == 3


@pytest.mark.parametrize(("size", "whole"), [(0.85, True), (1.0, True), (1.2, True), (0.7, False), (1.4, False)])
def test_a_round_blob_of_similar_size_is_a_whole_disc_at_another_depth(size, whole):
    planes = tuple(draw((60, 60), [(30.3, 29.6, size * 9, "red")]))
    unmixer = colour.unmixers(colour.chroma(colour.SKIN))["red"]
    found = reacquisition.free_discs(*planes, 60, *unmixer, np.array([32.0, 30.0]), 20.0, 9.0, UNKNOWN, NOTHING)
    assert (len(found) == 1 and found[0, 3] == 1.0) == whole
    if whole:
        np.testing.assert_allclose(found[0, :2], [30.3, 29.6], atol=0.1)


def test_the_skull_is_stiffer_than_skin_and_clothes():
    body = standing()
    lengths = reacquisition.link_lengths(body)
    for one, other, rigid in [("head_left", "head_right", True), ("left_elbow", "left_hand", False)]:
        i, j = NAMES.index(one), NAMES.index(other)
        for stretch, misfit in [(1.05, False), (1.15, rigid), (1.3, True)]:
            pulled = body.copy()
            pulled[j] = body[i] + stretch * (body[j] - body[i])
            assert lengths.violations(pulled)[i, j] == misfit


def test_the_search_radius_grows_with_time_and_uncertainty():
    hidden, unsure_m = np.array([0, 0, 2, 30]), np.array([0.04, 0.2, 0.2, 9.0])
    np.testing.assert_allclose(reacquisition.search_radius_m(hidden, unsure_m), [0.12, 0.2, 0.36, 0.6])


def test_two_occluded_discs_are_accepted_only_close_to_the_prediction():
    """Rays through partly occluded discs in two views may intersect by chance; whole discs are enough anywhere."""
    discs, nothing = seen_discs([0, 4], 0.5), np.full((1, 3), np.nan)
    away = POINT_M + np.array([0.1, 0.0, 0.0])
    for share, expected_m, accepted in [(0.5, away, False), (0.5, POINT_M + 0.01, True), (1.0, away, True)]:
        discs[..., 3] = share
        found = reacquisition.point_from_pair(packed(CAMERAS), discs, (0, 0), (4, 0), 1.2)
        cost = reacquisition._cost(found, expected_m, 0.3, 0.03, np.full(1, np.nan), np.full(1, np.nan), nothing)
        assert np.isfinite(cost) == accepted


def test_a_lost_hand_is_kept_within_reach_of_its_forearm():
    body = standing()
    hand, elbow = NAMES.index("right_hand"), NAMES.index("right_elbow")
    places, known = body.copy(), body.copy()
    places[hand], known[hand] = (-1.04, 1.12, 0.27), np.nan
    held = reacquisition.link_lengths(body).clamp(places, known)
    np.testing.assert_allclose(np.linalg.norm(held[hand] - body[elbow]), 0.27)
    np.testing.assert_array_equal(np.delete(held, hand, axis=0), np.delete(body, hand, axis=0))
