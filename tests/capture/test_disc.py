"""Centres of drawn discs, whole and cut, and the colours that they are found by."""

import numpy as np
import pytest
from pictures import SUIT, draw
from scipy import ndimage

from cospeech.capture import blobs, colour, disc
from cospeech.markers import COLOURS

MIXERS = colour.mixers(colour.chroma(colour.SKIN))


def errors(name, radius, other, on_skin=False, distances=(0.7, 1.6)):
    """Distances in pixels of measured and drawn centres, and how well each was seen, over 40 pictures."""
    rng, found = np.random.default_rng(0), []
    for seed in range(40):
        centre, angle = rng.uniform(30, 34, 2), rng.uniform(0, 2 * np.pi)
        away = rng.uniform(*distances) * radius
        discs = [(*centre, radius, name)]
        if on_skin:
            discs.insert(0, (*(centre + 3), 26, "skin"))
        if other:
            discs.append((*(centre + away * np.array([np.cos(angle), np.sin(angle)])), radius, other))
        y, cb, cr = draw((64, 64), discs, seed=seed)
        expected = centre + rng.normal(0, radius / 9, 2)
        u, v, pixels, share = disc.measure(y, cb, cr, 64, *MIXERS[name], *expected, radius, 0.6 * radius, True)
        assert pixels > 0
        found.append((np.hypot(u - centre[0], v - centre[1]), share))
    return np.array(found).T


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("radius", [4.5, 9.0])
@pytest.mark.parametrize("on_skin", [False, True])
def test_whole_disc_is_centred_to_a_tenth_of_a_pixel(name, radius, on_skin):
    away, share = errors(name, radius, None, on_skin)
    assert np.sqrt(np.mean(away**2)) < 0.1
    assert (share == 1).all()


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("other", ["suit", "skin", "own"])
def test_cut_disc_is_centred_though_its_pixels_are_not(name, other):
    away, share = errors(name, 9.0, name if other == "own" else other)
    assert np.sqrt(np.mean(away**2)) < 0.2
    assert share.mean() < 0.8


def test_hidden_disc_and_other_colour_are_not_seen():
    for discs in ([], [(32, 32, 9, "red")], [(32, 32, 20, "skin")], [(32, 32, 9, "white")]):
        y, cb, cr = draw((64, 64), discs)
        u, _, pixels, share = disc.measure(y, cb, cr, 64, *MIXERS["green"], 32.0, 32.0, 9.0, 5.0, True)
        assert np.isnan(u)
        assert (pixels, share) == (0, 0)


def test_window_at_the_edge_or_outside_of_the_picture_is_safe():
    y, cb, cr = draw((64, 64), [(2, 32, 9, "red")])
    u, v, _, share = disc.measure(y, cb, cr, 64, *MIXERS["red"], 3.0, 32.0, 9.0, 5.0, True)
    assert np.hypot(u - 2, v - 32) < 0.3
    assert share < 1
    assert np.isnan(disc.measure(y, cb, cr, 64, *MIXERS["red"], -80.0, 32.0, 9.0, 5.0, True)[0])


def test_shares_sum_up_mixtures_and_leave_out_skin():
    rng = np.random.default_rng(0)
    for name, mixer in MIXERS.items():
        white, skin, tint = rng.dirichlet(np.ones(3), 100).T
        own = white if name == "white" else tint
        for tinted in ("red", "green") if name == "white" else (name,):
            parts = [white, skin, tint]
            names = [(235, 235, 235), colour.SKIN, COLOURS[tinted]]
            pixel = sum(part[:, None] * colour.chroma(rgb) for part, rgb in zip(parts, names, strict=True))
            side = (pixel[:, 1:] @ mixer.across > 0).astype(int)
            light = colour.chroma(COLOURS["white"])[0] / 235 if name == "white" else 1.0
            np.testing.assert_allclose(np.sum(mixer.share[side] * pixel, axis=1) * light, own, atol=1e-12)


def test_skin_of_the_actor_is_learnt_from_the_pictures():
    dark = (141, 85, 60)
    y, cb, cr = draw((96, 96), [(48, 48, 20, "skin"), (20, 20, 8, "red"), (70, 70, 8, "green")])
    found = colour.skin([(y, cb, cr)], [96])
    np.testing.assert_allclose(found, colour.chroma(colour.SKIN), atol=2)
    planes = np.empty((3, 40, 40), dtype=np.uint8)
    planes[:] = (np.round(colour.chroma(dark)) + np.array([0, 128, 128])).astype(np.uint8)[:, None, None]
    np.testing.assert_allclose(colour.skin([tuple(planes)], [40]), colour.chroma(dark), atol=0.6)
    np.testing.assert_allclose(colour.skin([tuple(draw((40, 40), []))], [40]), colour.chroma(colour.SKIN))
    assert max(SUIT) < 60


def test_blobs_are_those_of_scipy():
    amount = np.random.default_rng(0).integers(0, 256, (30, 40)).astype(np.uint8)
    blob, count = blobs.label(amount.astype(float), 128.0)
    other, n = ndimage.label(amount >= 128)
    assert count == n
    np.testing.assert_array_equal(blob, other)
    planes = np.full((3, 230, 240), 128, dtype=np.uint8)
    planes[0, 150:180, 100:140] = amount
    luma = np.array([[1.0, 0.0, 0.0]] * 2)
    found = blobs.find(*planes, (100, 150, 140, 180), np.zeros(2), luma, 128.0, 1)
    centres = np.array(ndimage.center_of_mass(amount, other, np.arange(1, n + 1)))
    np.testing.assert_allclose(found[:, :2], centres[:, ::-1] + [100, 150])
    np.testing.assert_array_equal(found[:, 2], np.bincount(other.ravel())[1:])
    coarse = blobs.find(*planes, (100, 150, 140, 180), np.zeros(2), luma, 128.0, 3)
    hit = np.unique(other[::3, ::3])[1:]
    assert sorted(coarse[:, 2]) == sorted(found[hit - 1, 2])
