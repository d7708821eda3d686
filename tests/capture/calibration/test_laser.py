"""The laser spot is detected with sub-pixel precision, and not where there is none."""

import numpy as np
import pytest

from cospeech.capture.calibration import laser

SIZE = (348, 260)


def picture(spots, seed=0, noise=1.0):
    """Return planes Y and Cr of red spots (x, y, strength) with bloom, on a dark ground."""
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    light, bloom = np.zeros(x.shape), np.zeros(x.shape)
    for at_x, at_y, strength in spots:
        square = (x - at_x) ** 2 + (y - at_y) ** 2
        light += strength * np.exp(-square / (2 * 0.9**2))
        bloom += strength * 0.15 * np.exp(-square / (2 * 4.0**2))
    rng = np.random.default_rng(seed)
    planes = 12 + 220 * (light + bloom), 128 + 70 * (light + bloom)
    return [np.clip(np.rint(plane + rng.normal(0, noise, plane.shape)), 0, 255).astype(np.uint8) for plane in planes]


def test_the_spot_is_found_to_a_tenth_of_a_pixel():
    rng = np.random.default_rng(1)
    places = rng.uniform([20, 20], np.array(SIZE) - 20, (60, 2))
    found = np.array([laser.find(*picture([(x, y, 0.9)], seed)) for seed, (x, y) in enumerate(places)])
    assert np.linalg.norm(found - places, axis=1).max() < 0.15
    assert np.abs((found - places).mean(axis=0)).max() < 0.02


def test_a_weaker_reflection_is_ignored():
    x, y = laser.find(*picture([(100.3, 80.6, 0.9), (250.0, 190.0, 0.35)]))
    assert np.hypot(x - 100.3, y - 80.6) < 0.15


@pytest.mark.parametrize(
    "spots",
    [[], [(250.0, 190.0, 0.2)], [(100.3, 80.6, 0.9), (250.0, 190.0, 0.85)]],
    ids=["dark", "a reflection alone", "two equals"],
)
def test_an_ambiguous_spot_is_not_detected(spots):
    assert np.isnan(laser.find(*picture(spots))).all()


def test_a_bright_white_light_is_not_a_spot():
    y, cr = picture([])
    y[100:104, 100:104] = 255
    assert np.isnan(laser.find(y, cr)).all()


def test_a_red_surface_is_not_a_spot():
    y, cr = picture([])
    y[100:160, 100:160] = 120
    cr[100:160, 100:160] = 200
    assert np.isnan(laser.find(y, cr)).all()


def test_a_spot_at_the_border_is_detected_or_missing_but_never_an_error():
    for x, y in [(0, 0), (SIZE[0] - 1, SIZE[1] - 1), (0, 100), (100, SIZE[1] - 1)]:
        found = np.array(laser.find(*picture([(x, y, 0.9)])))
        assert np.isnan(found).all() or np.linalg.norm(found - (x, y)) < 2.0


def test_padding_of_the_decoder_is_ignored():
    y, cr = picture([(100.3, 80.6, 0.9)])
    y, cr = (np.pad(plane, ((0, 0), (0, 36)), constant_values=255) for plane in (y, cr))
    x, row = laser.find(y, cr, SIZE[0])
    assert np.hypot(x - 100.3, row - 80.6) < 0.15


def test_the_table_becomes_observations_and_back():
    pictures = [picture([(50.0 + 20 * k, 60.0, 0.9)] if k != 2 else [], k) for k in range(4)]
    table = laser.detections("c2", ((y, cr, cr) for y, cr in pictures), SIZE[0])
    assert table["frame"].tolist() == [0, 1, 3]
    pixels, frames = laser.observations(table, ["c1", "c2"])
    assert frames.tolist() == [0, 1, 3]
    assert np.isnan(pixels[0]).all()
    np.testing.assert_array_equal(pixels[1], table[["x_px", "y_px"]])
