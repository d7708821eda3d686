"""Detection, skin colour and optical flow on a real face: the astronaut of scikit-image."""

import cv2
import numpy as np
import planted_head
import pytest

from cospeech.capture.head import face, reference, skin
from cospeech.capture.head.bandpass import bandpass
from cospeech.capture.head.flow import find_flow


def planes(picture):
    y, cr, cb = cv2.split(cv2.cvtColor(picture, cv2.COLOR_BGR2YCrCb))
    return y, cb, cr


@pytest.fixture(scope="module")
def astronaut():
    return planes(planted_head.photograph())


def test_the_face_is_found_in_the_photograph_and_in_one_half_as_large(astronaut):
    for scale in (1.0, 0.6):
        luma = cv2.resize(astronaut[0], None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        (found,) = face.find_faces(luma)
        np.testing.assert_allclose(found.middle, scale * np.array([222, 127]), atol=8)
        assert found.width / scale == pytest.approx(90, abs=12)
    assert face.find_faces(astronaut[0][220:]) == []


def test_the_ellipse_of_the_skin_is_that_of_the_face(astronaut):
    (found,) = face.find_faces(astronaut[0])
    colour, ellipse = reference.locate(astronaut, found)
    eyes_and_mouth = np.array([(204.0, 100.0), (245.0, 102.0), (222.0, 146.0)])
    assert ellipse.contains(eyes_and_mouth, 0.9).all()
    assert not ellipse.contains(np.array([(100.0, 125.0), (350.0, 125.0), (222.0, 220.0)]), 1.1).any()
    suit, nose = np.array([astronaut[1][400, 250], astronaut[2][400, 250]]), colour.mean
    off = suit - nose
    assert off @ colour.precision @ off > skin.LIKELY


def test_a_filled_ellipse_is_found_as_it_was_drawn():
    y, cb, cr = (np.full((200, 200), value, dtype=np.uint8) for value in (90, 120, 118))
    for plane, value in ((cb, 105), (cr, 155)):
        cv2.ellipse(plane, (95, 110), (60, 40), 30.0, 0, 360, value, -1)
    found = skin.find_ellipse(cb, cr, face.Box(0, 0, 200, 200), skin.SkinColour(np.array([105.0, 155.0]), np.eye(2)))
    np.testing.assert_allclose(found.middle, (95, 110), atol=0.5)
    np.testing.assert_allclose(found.half_axes_px, (60, 40), atol=1.0)
    angle = np.degrees(np.arctan2(*np.linalg.eigh(found.precision)[1][::-1, 0])) % 180
    assert angle == pytest.approx(30, abs=1.5)
    assert (
        skin.find_ellipse(y, y, face.Box(0, 0, 200, 200), skin.SkinColour(np.array([10.0, 10.0]), np.eye(2))) is None
    )


@pytest.mark.parametrize("seed", range(6))
def test_flow_follows_the_homographies_of_one_frame(astronaut, seed):
    draw = np.random.default_rng(seed)
    (found,) = face.find_faces(astronaut[0])
    corners = np.array([(150, 60), (300, 60), (300, 210), (150, 210)], dtype=np.float32)
    moved = corners + draw.uniform(-3, 3, (4, 2)).astype(np.float32)
    homography = cv2.getPerspectiveTransform(corners, moved)
    after = cv2.warpPerspective(astronaut[0], homography, astronaut[0].shape[::-1], flags=cv2.INTER_CUBIC)
    _, ellipse = reference.locate(astronaut, found)
    before, after = bandpass(astronaut[0], 1.0), bandpass(after, 1.0)
    pixels = reference.corners(before, reference.inside(before.shape, ellipse, 0.9), found)
    there = cv2.perspectiveTransform(pixels[:, None], homography)[:, 0]
    seen, good = find_flow(before, after, pixels, pixels)
    assert good.mean() > 0.8
    assert np.median(np.linalg.norm(seen - there, axis=1)[good]) < 0.12


def test_a_point_that_is_covered_is_not_followed(astronaut):
    before = bandpass(astronaut[0], 1.0)
    covered = before.copy()
    covered[100:150, 190:250] = 128
    _, good = find_flow(
        before, covered, np.array([[220.0, 125.0], [290.0, 60.0]]), np.array([[220.0, 125.0], [290.0, 60.0]])
    )
    assert good.tolist() == [False, True]
