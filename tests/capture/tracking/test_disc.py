"""Centres of drawn discs, whole and cut, and the colours that they are found by."""

import numpy as np
import pytest
from pictures import SUIT, draw
from scipy import ndimage

from cospeech.capture.tracking import blobs, colour, disc
from cospeech.motion.markers import COLOURS

MIXERS = colour.mixers(colour.chroma(colour.SKIN))
FLAT = (0.0, 0.0)
"""What is usual of drawn discs, which have no shade at their rim: an outline that is their circle."""


def errors(name, radius, other, on_skin=False, distances=(0.7, 1.6), usual=disc.UNKNOWN):
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
        u, v, pixels, share, _ = disc.measure(
            y, cb, cr, 64, *MIXERS[name], *expected, radius, 0.6 * radius, 0.0, usual
        )
        assert pixels > 0
        found.append((np.hypot(u - centre[0], v - centre[1]), share))
    return np.array(found).T


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("radius", [4.5, 9.0])
@pytest.mark.parametrize("on_skin", [False, True])
def test_whole_disc_is_centred_to_a_tenth_of_a_pixel(name, radius, on_skin):
    away, share = errors(name, radius, None, on_skin, usual=FLAT)
    assert np.sqrt(np.mean(away**2)) < 0.1
    assert (share == 1).all()


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("other", ["suit", "skin", "own"])
def test_cut_disc_is_centred_though_its_pixels_are_not(name, other):
    """A fifth to three fifths of its area are hidden; told what whole discs show, all that is left is its outline."""
    away, share = errors(name, 9.0, name if other == "own" else other, usual=whole(name, 9.0))
    assert np.sqrt(np.mean(away**2)) < 0.15
    assert share.mean() < 0.8


def whole(name, radius):
    """What is usual of whole discs, as the tracker learns it."""
    found = [
        disc.measure(
            *draw((64, 64), [(32.3, 31.6, radius, name)], seed=seed), 64, *MIXERS[name], 32, 32, radius, 5.0, 0.0
        )
        for seed in range(10)
    ]
    light, inward = np.mean([shown[4] for shown in found], axis=0)
    return float(light), float(inward)


@pytest.mark.parametrize("name", COLOURS)
def test_a_disc_that_has_lost_a_narrow_strip_has_not_lost_one_on_the_other_side(name):
    """Its outline nearly fits two circles, a strip apart."""
    away, _ = errors(name, 4.7, "suit", distances=(1.75, 1.85), usual=whole(name, 4.7))
    assert np.quantile(away, 0.9) < 0.25


def test_half_a_disc_is_found_by_the_light_of_whole_ones():
    """Its bright middle is hidden. Cut at half of its own light, it would be too large for its circle."""
    rows, columns = np.mgrid[:64, :64]
    shade = np.clip(1.0 - 0.5 * ((columns - 32.0) ** 2 + (rows - 32.0) ** 2) / 81.0, 0.5, 1.0)

    def measure(hidden, seed, usual):
        y, *colours = draw((64, 64), [(32, 32, 9, "green"), *hidden], seed=seed)
        shaded = [np.round(128 + (plane - 128.0) * shade).astype(np.uint8) for plane in colours]
        return disc.measure(y, *shaded, 64, *MIXERS["green"], 32.0, 32.0, 9.0, 5.0, 0.0, usual)

    usual = np.mean([measure([], seed, (0.0, 0.3))[4] for seed in range(10)], axis=0)
    away = {True: [], False: []}
    for seed in range(20):
        for told, found in away.items():
            u, v, *_ = measure([(20, 32, 17, "suit")], seed, (float(usual[0]) if told else 0.0, float(usual[1])))
            found.append(np.hypot(u - 32, v - 32))
    assert np.mean(away[True]) < 0.2 < 0.4 < np.mean(away[False])


def test_hidden_disc_and_other_colour_are_not_seen():
    for discs in ([], [(32, 32, 9, "red")], [(32, 32, 20, "skin")], [(32, 32, 9, "white")]):
        y, cb, cr = draw((64, 64), discs)
        u, _, pixels, share, usual = disc.measure(y, cb, cr, 64, *MIXERS["green"], 32.0, 32.0, 9.0, 5.0, 0.0)
        assert np.isnan(u)
        assert (pixels, share, usual) == (0, 0, disc.UNKNOWN)


def test_window_at_the_edge_or_outside_of_the_picture_is_safe():
    y, cb, cr = draw((64, 64), [(2, 32, 9, "red")])
    u, v, _, share, _ = disc.measure(y, cb, cr, 64, *MIXERS["red"], 3.0, 32.0, 9.0, 5.0, 0.0)
    assert np.hypot(u - 2, v - 32) < 0.3
    assert share < 1
    assert np.isnan(disc.measure(y, cb, cr, 64, *MIXERS["red"], -80.0, 32.0, 9.0, 5.0, 0.0)[0])


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
