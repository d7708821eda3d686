"""The rules of the robust tracker, each tested on a body of which only the markers are drawn."""

import numpy as np
import pytest
from pictures import draw

from cospeech.capture.tracking import colour, reacquisition
from cospeech.capture.tracking.first_positions import NOMINAL_M
from cospeech.capture.tracking.robust_tracker import FOUND_SD, RobustTracker
from cospeech.geometry.camera import project
from cospeech.motion.markers import MARKERS, NAMES, RADIUS_M
from cospeech.studio import rig

CAMERAS = rig.cameras(696, 7)
VIEWS = range(len(CAMERAS))
BODY_M = np.array([NOMINAL_M[name] for name in NAMES])
LEFT, RIGHT = NAMES.index("left_hand"), NAMES.index("right_hand")
ELBOW, SHOULDER = NAMES.index("left_elbow"), NAMES.index("left_shoulder")


def tracker(body_m=BODY_M):
    return RobustTracker(CAMERAS, body_m, colour.unmixers(colour.chroma(colour.SKIN)), rig.FPS)


def radius_px(camera, point):
    return camera.focal_px[0] * RADIUS_M / (camera.rotation[2] @ point + camera.shift_m[2])


def filmed(places_m, hidden=(), cut=()):
    """Return images of markers (15, 3) without the (marker, view) pairs ``hidden``; half of ``cut`` is covered."""
    pictures = []
    for view, camera in enumerate(CAMERAS):
        discs = []
        for marker, point in enumerate(places_m):
            (x, y), radius = project(camera, point), radius_px(camera, point)
            if (marker, view) not in hidden:
                discs.append((x, y, radius, MARKERS[marker].colour))
            if (marker, view) in cut:
                discs.append((x + 1.2 * radius, y, radius, "suit"))
        pictures.append(tuple(draw((696, 520), discs, seed=view)))
    return pictures


def moved(**places_m):
    body = BODY_M.copy()
    for name, place in places_m.items():
        body[NAMES.index(name)] = place
    return body


def dropped(places_m, n_views=3, residual_px=0.0):
    """Return the names of the points (15, 3) that are rejected, each seen by ``n_views`` of the standing body."""
    points, used = places_m.copy(), np.arange(len(CAMERAS)) < np.full((len(NAMES), 1), n_views)
    tracker()._reject(points, used, np.full(len(NAMES), residual_px), np.zeros_like(used), np.full(len(NAMES), 1.2))
    assert (used.any(axis=1) == np.isfinite(points[:, 0])).all()
    return [name for name, point in zip(NAMES, points, strict=True) if np.isnan(point[0])]


def test_two_views_must_agree_more_closely_than_three():
    assert dropped(BODY_M, n_views=3, residual_px=0.6) == []
    assert dropped(BODY_M, n_views=2, residual_px=0.3) == []
    assert dropped(BODY_M, n_views=2, residual_px=0.6) == list(NAMES)


def test_the_point_that_violates_the_most_links_is_rejected():
    """Only the shoulder is rejected, with its links to chest, back and elbow, although the elbow moved farther."""
    aside, upward = np.array([0.118, 0.0, 0.0]), np.array([0.0, 0.115, 0.0])
    arm = {"left_elbow": BODY_M[ELBOW] + aside, "left_hand": BODY_M[LEFT] + aside}
    assert not reacquisition.link_lengths(BODY_M).violations(moved(**arm)).any()
    away = moved(left_shoulder=BODY_M[SHOULDER] + upward, **arm)
    assert reacquisition.link_lengths(BODY_M).violations(away)[ELBOW].sum() == 1
    assert dropped(away) == ["left_shoulder"]


@pytest.mark.parametrize(("elbow_m", "hand_m", "gone"), [(0.01, -0.09, "left_hand"), (0.07, -0.02, "left_elbow")])
def test_of_two_points_that_violate_their_link_the_one_that_moved_farther_is_rejected(elbow_m, hand_m, gone):
    up = np.array([0.0, 1.0, 0.0])
    stretched = moved(left_hand=BODY_M[LEFT] + hand_m * up, left_elbow=BODY_M[ELBOW] + elbow_m * up)
    assert reacquisition.link_lengths(BODY_M).violations(stretched).sum() == 2
    assert dropped(stretched) == [gone]


@pytest.mark.parametrize(("hidden", "speed"), [(0, [2.0, 0.0, -1.0]), (1, [0.0, 0.0, 0.0])])
def test_only_a_marker_seen_in_the_previous_frame_has_a_velocity_when_reacquired(hidden, speed):
    tracked, now = tracker(), BODY_M[LEFT] + np.array([2.0, 0.0, -1.0]) / rig.FPS
    tracked.hidden[LEFT] = hidden
    pixels = np.array([project(camera, now) for camera in CAMERAS])
    seen = reacquisition.Candidate(now, np.ones(5, dtype=bool), pixels, np.full(5, 60), np.ones(5), 0.0)
    detected = tracker().step(filmed(BODY_M))
    tracked._accept(LEFT, seen, detected)
    np.testing.assert_allclose(detected.points_m[LEFT], now, atol=1e-9)
    np.testing.assert_allclose(tracked.states[LEFT], [now, speed, np.zeros(3)], atol=1e-6)


def test_a_hidden_hand_rests_within_reach_of_its_forearm():
    tracked = tracker()
    tracked.states[LEFT, 1] = 3.0
    shift = np.array([0.5, 0.0, 0.0])
    points = moved(left_elbow=BODY_M[ELBOW] + shift, left_hand=np.full(3, np.nan))
    tracked._hold_hidden(points)
    elbow, forearm = points[ELBOW], np.linalg.norm(BODY_M[LEFT] - BODY_M[ELBOW])
    assert np.linalg.norm(tracked.states[LEFT, 0] - elbow) == pytest.approx(forearm)
    assert np.linalg.norm(BODY_M[LEFT] - elbow) > 1.5 * forearm
    np.testing.assert_array_equal(tracked.states[LEFT, 1:], 0.0)


def test_two_half_occluded_views_reacquire_a_distant_hand_only_after_a_long_gap():
    """After a second the hand may be anywhere within reach; after one frame it cannot have moved so far."""
    far = moved(left_hand=BODY_M[ELBOW] + [0.20, 0.0, 0.12])
    everywhere = {(LEFT, view) for view in VIEWS}
    half = filmed(far, hidden=everywhere - {(LEFT, 3), (LEFT, 4)}, cut={(LEFT, 3), (LEFT, 4)})
    away = filmed(BODY_M, hidden=everywhere)
    for n_hidden, found in [(1, False), (20, True)]:
        tracked = tracker()
        for _ in range(3):
            tracked.step(filmed(BODY_M))
        for _ in range(n_hidden):
            assert not tracked.step(away).used[LEFT].any()
        detected = tracked.step(half)
        assert detected.used[LEFT].any() == found
        if found:
            np.testing.assert_allclose(detected.points_m[LEFT], far[LEFT], atol=5e-3)


def test_two_hands_seen_by_two_views_each_are_not_merged():
    """In front of the chest, each hand occludes the other from its side, and is half hidden in one of its two views.

    The rays of the outer views to the two hands intersect between the hands, and the predictions are such that each
    outer view would rather assign its disc to the wrong hand.
    """
    outer_right, inner_right, front, inner_left, outer_left = np.argsort([camera.place_m[0] for camera in CAMERAS])
    between, hands = np.array([0.02, 1.08, 0.27]), []
    for view in (outer_right, outer_left):
        toward = CAMERAS[view].place_m - between
        hands.append(between + 0.04 * toward / np.linalg.norm(toward))
    right, left = hands
    body = moved(left_hand=left, right_hand=right)
    hidden = {(LEFT, view) for view in (outer_right, inner_right, front)}
    hidden |= {(RIGHT, view) for view in (front, inner_left, outer_left)}
    tracked = tracker(body)
    for hand, aside in ((LEFT, -0.012), (RIGHT, 0.012)):
        tracked.states[hand, 0, 1] += aside
        tracked.covariances[hand] = np.diag(np.square([0.05, *FOUND_SD[1:]]))
    detected = tracked.step(filmed(body, hidden, cut={(RIGHT, inner_right), (LEFT, inner_left)}))
    np.testing.assert_allclose(detected.points_m[[RIGHT, LEFT]], hands, atol=4e-3)
