"""The texture of a head that is filmed: skin with pores, freckles and moles, hair, brows, eyes, lips and a shirt.

A texture is an image whose rows and columns lie on the parts of ``mannequin``. Its detail is what optical flow
follows, and it is about as fine as the pixels of a camera in which a face is 140 pixels wide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Singles
from cospeech.data.rng import random_source
from cospeech.studio import mannequin
from cospeech.studio.mannequin import EYE_M, MOUTH_M, smooth
from cospeech.studio.stage import ycbcr

SIZES = {"head": (330, 420), "neck": (110, 180), "shoulders": (150, 420)}
"""Height and width of the texture of each part, texels."""

SKINS = ((224, 178, 150), (205, 150, 120), (188, 134, 104), (150, 104, 80))
HAIRS = ((38, 28, 24), (62, 42, 30), (96, 70, 46), (24, 22, 24))
IRISES = ((74, 50, 34), (88, 100, 62), (92, 116, 132), (52, 36, 28))
SHIRTS = ((70, 92, 130), (92, 112, 88), (128, 74, 72), (110, 108, 112))
LIP, MOUTH, WHITE = (176, 96, 92), (58, 26, 26), (226, 222, 216)
"""Red, green and blue in full light, from which each person has some."""

BLINKS = 8
"""Number of steps from an open eye to a closed one."""

SHADES = {
    "eye sockets": (0.30, (0.030, 0.010), (0.019, 0.011)),
    "beside the bridge of the nose": (0.18, (0.015, 0.010), (0.006, 0.010)),
    "below the nose": (0.32, (0.0, -0.0470), (0.013, 0.0035)),
    "nostrils": (0.85, (0.0075, -0.0435), (0.0038, 0.0022)),
    "wings of the nose": (0.20, (0.0180, -0.0390), (0.0030, 0.0060)),
    "below the lower lip": (0.22, (0.0, -0.0815), (0.018, 0.0035)),
    "folds beside the mouth": (0.14, (0.030, -0.052), (0.004, 0.014)),
    "below the eyes": (0.16, (0.031, -0.0105), (0.016, 0.0030)),
}
"""Shade of the skin where little light arrives: its share, and the middle and deviation of its profile, metres."""

EYE_WIDTH_M, UPPER_LID_M, LOWER_LID_M = 0.0145, 0.0058, 0.0044
IRIS_M, PUPIL_M = 0.0058, 0.0025


class Texture(NamedTuple):
    """The texture of one person.

    Attributes
    ----------
    open : (H, W, 3) Y, Cb, Cr in full light, with open eyes.
    eyes : (``BLINKS`` + 1, h, w, 3) the region of the eyes, from open to closed.
    corner : row and column of that region.
    """

    open: Singles
    eyes: Singles
    corner: tuple[int, int]


def texture(person: str, seed: int, contrast: float = 1.0) -> Texture:
    """Return the texture of a person, which the seed and the name determine.

    Parameters
    ----------
    contrast : factor of the contrast of the skin's pores, freckles and moles.
    """
    rng = random_source(seed, "complexion", person)
    skin, hair, iris, shirt = (
        np.array(some[int(rng.integers(len(some)))], dtype=float) for some in (SKINS, HAIRS, IRISES, SHIRTS)
    )
    head, neck, shoulders = (np.empty((*size, 3)) for size in SIZES.values())
    height, width = SIZES["head"]
    columns, rows = np.meshgrid(np.linspace(0.0, 1.0, width), np.linspace(1.0, 0.0, height))
    places = mannequin.skull(columns, rows)
    x, y, z = np.moveaxis(places, -1, 0)
    head[:] = _skin(skin, places, SIZES["head"], contrast, rng)
    head[:] = _hair(head, hair, places, rng)
    top, bottom = np.flatnonzero((y[:, width // 2] < 0.024) & (y[:, width // 2] > -0.012))[[0, -1]]
    left, right = np.flatnonzero((np.abs(x[height // 2]) < 0.056) & (z[height // 2] > 0.0))[[0, -1]]
    eyes = np.array(
        [
            _eyes(
                head[top:bottom, left:right], iris, skin, x[top:bottom, left:right], y[top:bottom, left:right], shut
            )
            for shut in np.linspace(0.0, 1.0, BLINKS + 1)
        ]
    )
    neck[:] = _plain_skin(0.92 * skin, SIZES["neck"], contrast, rng)
    shoulders[:] = _shirt(shirt, SIZES["shoulders"], rng)
    neck *= _under_chin(SIZES["neck"])
    whole = np.zeros((sum(size[0] for size in SIZES.values()), max(size[1] for size in SIZES.values()), 3))
    first = 0
    for part in (head, neck, shoulders):
        whole[first : first + part.shape[0], : part.shape[1]] = part
        first += part.shape[0]
    whole[top:bottom, left:right] = eyes[0]
    return Texture(ycbcr(whole), ycbcr(eyes), (int(top), int(left)))


def noise(size: tuple[int, int], texels: float, rng: np.random.Generator) -> Floats:
    """Return smooth random values (H, W) of unit variance that change over about ``texels`` texels."""
    spectrum = np.fft.rfft2(rng.normal(size=size))
    up, along = np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1])[None]
    values = np.fft.irfft2(spectrum * np.exp(-0.5 * (2.0 * np.pi * texels / 2.0) ** 2 * (up**2 + along**2)), s=size)
    return np.asarray(values / values.std())


def _plain_skin(skin: Floats, size: tuple[int, int], contrast: float, rng: np.random.Generator) -> Floats:
    pores = 3.5 * noise(size, 1.6, rng) + 3.0 * noise(size, 4.0, rng) + 3.0 * noise(size, 14.0, rng)
    freckles = np.maximum(noise(size, 2.6, rng) - 1.7, 0.0)
    grey = contrast * (pores - 16.0 * freckles)
    tint = contrast * noise(size, 9.0, rng)
    return np.asarray(skin + grey[..., None] * (1.0, 0.95, 0.85) + tint[..., None] * (1.5, -1.0, -0.5))


def _skin(skin: Floats, places: Floats, size: tuple[int, int], contrast: float, rng: np.random.Generator) -> Floats:
    x, y, z = np.moveaxis(places, -1, 0)
    colour = _plain_skin(skin, size, contrast, rng)
    front = smooth(0.02, 0.03, z)
    for _ in range(6):
        place = rng.uniform((-0.055, -0.095), (0.055, 0.065))
        mole = np.exp(-0.5 * ((x - place[0]) ** 2 + (y - place[1]) ** 2) / rng.uniform(0.0007, 0.0016) ** 2) * front
        colour = colour - contrast * mole[..., None] * (95.0, 85.0, 70.0)
    red = 0.5 * _blob(x, y, (0.042, -0.028), (0.018, 0.014)) + 0.6 * _blob(x, y, (0.0, -0.036), (0.012, 0.008))
    colour = colour + (front * red)[..., None] * (6.0, -14.0, -12.0)
    dark = sum((share * _blob(x, y, at, spread) for share, at, spread in SHADES.values()), np.zeros_like(x))
    light = 0.10 * np.exp(-0.5 * (x / 0.004) ** 2) * smooth(-0.036, 0.02, y) * smooth(-0.02, 0.02, -y)
    light = (
        light + 0.06 * _blob(x, y, (0.0, 0.048), (0.030, 0.014)) + 0.10 * _blob(x, y, (0.0, -0.032), (0.006, 0.005))
    )
    colour = colour * (1.0 - np.clip(front * dark, 0.0, 0.9) + front * light)[..., None]
    colour = _over(colour, LIP, front * _lips(x, y) * (0.85 + 0.05 * noise(size, 2.0, rng)))
    colour = _over(colour, MOUTH, front * _mouth_line(x, y))
    inside = np.hypot((z + 0.010) / 0.009, (y + 0.002) / 0.018)
    ear = smooth(-1.0, 0.4, -inside) * smooth(0.9, 0.1, np.abs(x) / 0.076)
    under = smooth(0.104, 0.02, -y)  # in the shadow of the chin
    return np.asarray(colour * (1.0 - 0.35 * ear - 0.35 * under * smooth(-0.09, 0.05, -z))[..., None])


def _blob(x: Floats, y: Floats, at: tuple[float, float], spread: tuple[float, float]) -> Floats:
    return mannequin.Bump(1.0, at, spread).at(x, y)


def _over(colour: Floats, paint: tuple[float, ...] | Floats, share: Floats) -> Floats:
    """Return a colour (..., 3) covered by paint (3,) to the given share (...)."""
    cover = np.clip(share, 0.0, 1.0)[..., None]
    return np.asarray(colour + cover * (np.asarray(paint) - colour))


def _lips(x: Floats, y: Floats) -> Floats:
    """Return where the lips are, 0 to 1: the upper one with a bow."""
    wide = np.maximum(1.0 - (x / 0.0255) ** 2, 0.0)
    upper = MOUTH_M + 0.0085 * wide**0.8 - 0.0022 * np.exp(-0.5 * (x / 0.004) ** 2)
    lower = MOUTH_M - 0.0100 * wide**0.6
    return smooth(0.0, 0.0016, upper - y) * smooth(0.0, 0.0016, y - lower) * (np.abs(x) < 0.0255)


def _mouth_line(x: Floats, y: Floats) -> Floats:
    """Return where the inside of the mouth is seen, 0 to 1: a line that an open mouth widens."""
    return np.asarray(smooth(-0.0013, 0.0010, -np.abs(y - MOUTH_M)) * smooth(-0.0265, 0.003, -np.abs(x)))


def _hair(colour: Floats, hair: Floats, places: Floats, rng: np.random.Generator) -> Floats:
    """Return the colour of the head with hair and brows."""
    x, y, z = np.moveaxis(places, -1, 0)
    size = colour.shape[:2]
    strands = (
        0.6 * noise(size, 1.5, rng) + 0.8 * np.repeat(noise((size[0] // 6, size[1]), 1.5, rng), 6, axis=0)[: size[0]]
    )
    paint = hair * (1.0 + 0.30 * strands + 0.12 * noise(size, 20.0, rng))[..., None]
    edge = mannequin.hair_depth(x, y, z) + 0.0012 * strands
    colour = _over(colour, np.clip(paint, 4.0, 250.0), smooth(0.0, 0.005, edge))
    along = (np.abs(x) - 0.031) / 0.0195
    arch = 0.0245 + 0.0035 * (1.0 - along**2) - 0.0015 * along
    thick = 0.0036 * (1.0 - 0.35 * along) * np.sqrt(np.maximum(1.0 - along**2, 0.0))
    brow = smooth(0.0012, 0.0020, thick - np.abs(y - arch)) * (z > 0.0) * (0.80 + 0.12 * noise(size, 1.4, rng))
    return _over(colour, 0.8 * hair, brow)


def _eyes(colour: Floats, iris: Floats, skin: Floats, x: Floats, y: Floats, shut: float) -> Floats:
    """Return the region of the eyes (h, w, 3) with the lids shut to a share."""
    side, up = np.abs(x) - EYE_M[0], y - EYE_M[1]
    across = side / EYE_WIDTH_M
    curve = np.sqrt(np.maximum(1.0 - across**2, 0.0))
    lower = -LOWER_LID_M * curve**1.4
    upper = lower + (1.0 - shut) * (UPPER_LID_M * curve**1.1 - lower)
    soft = 0.0011
    inside = smooth(0.0, soft, upper - up) * smooth(0.0, soft, up - lower) * (np.abs(across) < 1.0)
    lid = (
        smooth(0.0, soft, UPPER_LID_M * curve + 0.0016 - up) * smooth(0.0, soft, up - upper) * (np.abs(across) < 1.0)
    )
    colour = _over(colour, 0.86 * skin, 0.8 * lid)
    away = np.hypot(x - np.sign(x) * EYE_M[0], up - 0.0004)
    ball = _over(np.broadcast_to(np.array(WHITE, dtype=float), colour.shape), iris, smooth(-IRIS_M, 0.0012, -away))
    ball = _over(ball, 0.55 * iris, smooth(-IRIS_M, 0.001, -away) * smooth(IRIS_M - 0.0010, 0.001, away))
    ball = _over(ball, (12.0, 10.0, 10.0), smooth(-PUPIL_M, 0.0010, -away))
    glint = np.hypot(x - np.sign(x) * EYE_M[0] - 0.002, up - 0.0026)  # of the lamp
    ball = _over(ball, (250.0, 250.0, 250.0), smooth(-0.0011, 0.0008, -glint))
    shade = 1.0 - 0.25 * smooth(0.0035, 0.004, up)
    colour = _over(colour, ball * shade[..., None], inside)
    near = np.abs(across) < 1.06
    lash = np.exp(-0.5 * ((up - upper) / 0.0010) ** 2) * near * curve**0.3
    crease = np.exp(-0.5 * ((up - (UPPER_LID_M * curve + 0.0030)) / 0.0009) ** 2) * near * curve
    rim = np.exp(-0.5 * ((up - lower) / 0.0007) ** 2) * near
    colour = _over(colour, (26.0, 18.0, 16.0), 0.92 * lash)
    colour = _over(colour, 0.60 * skin, 0.55 * crease)
    return _over(colour, 0.62 * skin, 0.6 * rim)


def _shirt(shirt: Floats, size: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Return a woven shirt (H, W, 3) with folds."""
    row, column = np.mgrid[: size[0], : size[1]].astype(float)
    weave = 0.10 * np.sin(2.0 * np.pi * row / 7.0) + 0.10 * np.sin(2.0 * np.pi * column / 9.0)
    folds = 0.10 * noise(size, 30.0, rng) + 0.05 * noise(size, 2.0, rng)
    return np.asarray(np.clip(shirt * (1.0 + weave + folds)[..., None], 4.0, 250.0))


def _under_chin(size: tuple[int, int]) -> Floats:
    """Return the shade of the neck (H, 1, 1): dark below the chin."""
    down = np.linspace(0.0, 1.0, size[0])
    return np.asarray((1.0 - 0.45 * smooth(-0.55, 0.4, -down))[:, None, None])
