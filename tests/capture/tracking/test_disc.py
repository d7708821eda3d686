"""Centres of drawn discs, whole and occluded, and the unmixing of their colours."""

import numpy as np
import pytest
from pictures import SUIT, draw
from scipy import ndimage

from cospeech.capture.tracking import blobs, colour, disc
from cospeech.motion.markers import COLOURS

UNMIXERS = colour.unmixers(colour.chroma(colour.SKIN))
FLAT = (0.0, 0.0)
"""Reference of drawn discs, which have no shading at their rim: the outline is the circle itself."""


def errors(name, radius, other, on_skin=False, distances=(0.7, 1.6), reference=disc.UNKNOWN):
    """Return the errors of the measured centres in pixels and the visible fractions, over 40 images."""
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
            y, cb, cr, 64, *UNMIXERS[name], *expected, radius, 0.6 * radius, 0.0, reference
        )
        assert pixels > 0
        found.append((np.hypot(u - centre[0], v - centre[1]), share))
    return np.array(found).T


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("radius", [4.5, 9.0])
@pytest.mark.parametrize("on_skin", [False, True])
def test_a_whole_disc_is_centred_to_a_tenth_of_a_pixel(name, radius, on_skin):
    away, share = errors(name, radius, None, on_skin, reference=FLAT)
    assert np.sqrt(np.mean(away**2)) < 0.1
    assert (share == 1).all()


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("other", ["suit", "skin", "own"])
def test_an_occluded_disc_is_centred_by_its_outline(name, other):
    """A fifth to three fifths of its area are hidden; the reference of whole discs is known."""
    away, share = errors(name, 9.0, name if other == "own" else other, reference=whole(name, 9.0))
    assert np.sqrt(np.mean(away**2)) < 0.15
    assert share.mean() < 0.8


def whole(name, radius):
    """Return the reference of whole discs, as the tracker learns it."""
    found = [
        disc.measure(
            *draw((64, 64), [(32.3, 31.6, radius, name)], seed=seed), 64, *UNMIXERS[name], 32, 32, radius, 5.0, 0.0
        )
        for seed in range(10)
    ]
    light, inward = np.mean([shown[4] for shown in found], axis=0)
    return float(light), float(inward)


@pytest.mark.parametrize("name", COLOURS)
def test_a_disc_with_a_narrow_strip_hidden_is_not_mirrored(name):
    """Its outline nearly fits two circles that are offset by the width of the strip."""
    away, _ = errors(name, 4.7, "suit", distances=(1.75, 1.85), reference=whole(name, 4.7))
    assert np.quantile(away, 0.9) < 0.25


def test_half_a_disc_is_measured_at_the_level_of_whole_ones():
    """Its bright centre is hidden. At half of its own level, its outline would be too large for its circle."""
    rows, columns = np.mgrid[:64, :64]
    shade = np.clip(1.0 - 0.5 * ((columns - 32.0) ** 2 + (rows - 32.0) ** 2) / 81.0, 0.5, 1.0)

    def measure(hidden, seed, reference):
        y, *colours = draw((64, 64), [(32, 32, 9, "green"), *hidden], seed=seed)
        shaded = [np.round(128 + (plane - 128.0) * shade).astype(np.uint8) for plane in colours]
        return disc.measure(y, *shaded, 64, *UNMIXERS["green"], 32.0, 32.0, 9.0, 5.0, 0.0, reference)

    reference = np.mean([measure([], seed, (0.0, 0.3))[4] for seed in range(10)], axis=0)
    away = {True: [], False: []}
    for seed in range(20):
        for known, found in away.items():
            u, v, *_ = measure(
                [(20, 32, 17, "suit")], seed, (float(reference[0]) if known else 0.0, float(reference[1]))
            )
            found.append(np.hypot(u - 32, v - 32))
    assert np.mean(away[True]) < 0.2 < 0.4 < np.mean(away[False])


def test_a_hidden_disc_and_other_colours_are_not_detected():
    for discs in ([], [(32, 32, 9, "red")], [(32, 32, 20, "skin")], [(32, 32, 9, "white")]):
        y, cb, cr = draw((64, 64), discs)
        u, _, pixels, share, reference = disc.measure(y, cb, cr, 64, *UNMIXERS["green"], 32.0, 32.0, 9.0, 5.0, 0.0)
        assert np.isnan(u)
        assert (pixels, share, reference) == (0, 0, disc.UNKNOWN)


def test_a_window_at_the_edge_or_outside_the_image_is_safe():
    y, cb, cr = draw((64, 64), [(2, 32, 9, "red")])
    u, v, _, share, _ = disc.measure(y, cb, cr, 64, *UNMIXERS["red"], 3.0, 32.0, 9.0, 5.0, 0.0)
    assert np.hypot(u - 2, v - 32) < 0.3
    assert share < 1
    assert np.isnan(disc.measure(y, cb, cr, 64, *UNMIXERS["red"], -80.0, 32.0, 9.0, 5.0, 0.0)[0])


def test_mixtures_are_unmixed_exactly():
    rng = np.random.default_rng(0)
    for name, unmixer in UNMIXERS.items():
        white, skin, tint = rng.dirichlet(np.ones(3), 100).T
        own = white if name == "white" else tint
        for tinted in ("red", "green") if name == "white" else (name,):
            parts = [white, skin, tint]
            names = [(235, 235, 235), colour.SKIN, COLOURS[tinted]]
            pixel = sum(part[:, None] * colour.chroma(rgb) for part, rgb in zip(parts, names, strict=True))
            side = (pixel[:, 1:] @ unmixer.across > 0).astype(int)
            light = colour.chroma(COLOURS["white"])[0] / 235 if name == "white" else 1.0
            np.testing.assert_allclose(np.sum(unmixer.share[side] * pixel, axis=1) * light, own, atol=1e-12)


def test_the_skin_colour_of_the_actor_is_estimated_from_the_images():
    dark = (141, 85, 60)
    y, cb, cr = draw((96, 96), [(48, 48, 20, "skin"), (20, 20, 8, "red"), (70, 70, 8, "green")])
    found = colour.estimate_skin([(y, cb, cr)], [96])
    np.testing.assert_allclose(found, colour.chroma(colour.SKIN), atol=2)
    planes = np.empty((3, 40, 40), dtype=np.uint8)
    planes[:] = (np.round(colour.chroma(dark)) + np.array([0, 128, 128])).astype(np.uint8)[:, None, None]
    np.testing.assert_allclose(colour.estimate_skin([tuple(planes)], [40]), colour.chroma(dark), atol=0.6)
    np.testing.assert_allclose(colour.estimate_skin([tuple(draw((40, 40), []))], [40]), colour.chroma(colour.SKIN))
    assert max(SUIT) < 60


def test_blobs_match_those_of_scipy():
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
