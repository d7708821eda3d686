"""Disparities of planted images, and of a curved surface relative to what is believed of it."""

import cv2
import numpy as np
import planted_head
import pytest

from cospeech.capture.head import face, optics, reference
from cospeech.capture.head.disparity import find_disparities


def texture(seed, size=(60, 90)):
    rough = np.random.default_rng(seed).uniform(0, 255, size)
    return cv2.GaussianBlur(rough, (0, 0), 1.5) * 2 - 128


def shifted(picture, disparity):
    """The right image of a plane: x in the left image is at x - disparity."""
    rows, columns = np.indices(picture.shape, dtype=np.float32)
    return cv2.remap(picture, columns + np.float32(disparity), rows, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


def grey(picture):
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("seed", range(8))
def test_planted_disparities_are_found_to_a_tenth_of_a_pixel(seed):
    picture, planted = texture(seed), np.random.default_rng(seed).uniform(3, 9)
    pixels = np.random.default_rng(seed + 100).uniform((30, 15), (65, 45), (20, 2))
    found = find_disparities(grey(picture), grey(shifted(picture, planted)), pixels, np.full(20, 6.0), 6, 5)
    assert np.isfinite(found).mean() > 0.7
    assert np.nanmax(np.abs(found - planted)) < 0.1


@pytest.mark.parametrize("seed", range(8))
def test_whole_disparities_are_the_smallest_sum_of_absolute_differences(seed):
    draw = np.random.default_rng(seed)
    left, right = (grey(texture(seed + 50 * k)) for k in (0, 1))
    planted = int(draw.integers(2, 8))
    right[:, : 90 - planted] = left[:, planted:]
    x, y, half = 45, 30, 4
    costs = [
        np.abs(
            left[y - half : y + half + 1, x - half : x + half + 1].astype(int)
            - right[y - half : y + half + 1, x - d - half : x - d + half + 1]
        ).sum()
        for d in range(11)
    ]
    found = find_disparities(left, right, np.array([[x, y]], dtype=float), np.array([5.0]), 5, half)
    assert found[0] == pytest.approx(np.argmin(costs), abs=1e-6)


def test_what_is_flat_repeated_or_hidden_has_no_disparity():
    flat = np.full((60, 90), 100, dtype=np.uint8)
    pixels, expected = np.array([[45.0, 30.0]]), np.array([5.0])
    assert np.isnan(find_disparities(flat, flat, pixels, expected, 5, 5)).all()
    stripes = grey(128 + 80 * np.sin(np.arange(90) * 2 * np.pi / 5)[None].repeat(60, axis=0))
    assert np.isnan(find_disparities(stripes, stripes, pixels, expected, 8, 5)).all()
    left = grey(texture(1))
    hidden = shifted(left.astype(float), 5.0)
    hidden[20:41, 30:51] = texture(2)[20:41, 30:51]
    assert np.isnan(find_disparities(left, grey(hidden), pixels, expected, 5, 5)).all()


def test_the_surface_of_a_real_face_is_found_to_a_millimetre():
    """The picture of the astronaut on an ellipsoid; windows of constant disparity alone are off by up to 9 mm."""
    scene = planted_head.Scene(planted_head.cameras(640))
    left, right = planted_head.pair(scene, (0, 0, 0))
    own, _ = optics.rectified(scene.cameras)
    found = face.find_faces(left[0])
    assert len(found) == 1
    expected = own.disparities(np.array(planted_head.DISTANCE_M - planted_head.HALF_AXES_M[2]))
    known = reference.from_pair(left, right[0], found[0], own, round(float(expected)))
    inside = (known.points_m + scene.cameras[0].place_m) / planted_head.HALF_AXES_M
    off_mm = 1000 * (np.linalg.norm(inside, axis=1) - 1) * planted_head.HALF_AXES_M[2]
    assert len(off_mm) > 60
    assert np.abs(off_mm).mean() < 1.0
    assert np.percentile(np.abs(off_mm), 95) < 2.5
    radial = inside / planted_head.HALF_AXES_M
    aligned = np.einsum("ni,ni->n", known.normals, radial / np.linalg.norm(radial, axis=1, keepdims=True))
    assert np.median(np.degrees(np.arccos(np.minimum(aligned, 1)))) < 6
