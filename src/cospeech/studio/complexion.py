"""The texture of a person who is filmed: skin with pores, freckles and moles, hair, brows, eyes, lips and a shirt.

A texture is an image whose rows and columns lie on the parts of ``mannequin``. Its detail is what optical flow
follows, and it is about as fine as the pixels of a camera in which a face is 140 pixels wide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats, Singles
from cospeech.data.rng import random_source
from cospeech.studio import mannequin
from cospeech.studio.mannequin import EYE_M, MOUTH_M, smooth
from cospeech.studio.stage import ycbcr

SIZES = {"head": (330, 420), "neck": (110, 180), "shoulders": (150, 420), "hand": (180, 200)}
"""Height and width of the texture of each part, texels."""

SKINS = ((224, 178, 150), (205, 150, 120), (188, 134, 104), (150, 104, 80))
HAIRS = ((38, 28, 24), (62, 42, 30), (96, 70, 46), (24, 22, 24))
IRISES = ((74, 50, 34), (88, 100, 62), (92, 116, 132), (52, 36, 28))
SHIRTS = ((70, 92, 130), (92, 112, 88), (128, 74, 72), (110, 108, 112))
"""Red, green and blue in full light, from which each person has some."""

LIP, MOUTH, MOLE = (176, 96, 92), (58, 26, 26), (95.0, 85.0, 70.0)
WHITE, PUPIL, GLINT, LASH = (226, 222, 216), (12, 10, 10), (250, 250, 250), (26, 18, 16)
"""The colours that all have. A mole is darker than the skin around it by its colour."""

N_MOLES = 6

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
IRIS_M, PUPIL_M, SOFT_M = 0.0058, 0.0025, 0.0011
"""Half of the width of an eye, how far its lids are apart from its middle, radii of iris and pupil, and how soft the
edges of lids are."""


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


class Colours(NamedTuple):
    """Red, green and blue of one person in full light, (3,) each."""

    skin: Floats
    hair: Floats
    iris: Floats
    shirt: Floats


def texture(person: str, seed: int, contrast: float = 1.0) -> Texture:
    """Return the texture of a person, which the seed and the name determine.

    Parameters
    ----------
    contrast : factor of the contrast of the skin's pores, freckles and moles.
    """
    rng = random_source(seed, "complexion", person)
    own = Colours(
        *(np.array(some[int(rng.integers(len(some)))], dtype=float) for some in (SKINS, HAIRS, IRISES, SHIRTS))
    )
    height, width = SIZES["head"]
    columns, rows = np.meshgrid(np.linspace(0.0, 1.0, width), np.linspace(1.0, 0.0, height))
    places = mannequin.skull(columns, rows)
    head = _hair(_face(own.skin, places, contrast, rng), own.hair, places, rng)
    region = _eye_region(places)
    eyes = np.array([_eyes(head[region], places[region], own, shut) for shut in np.linspace(0.0, 1.0, BLINKS + 1)])
    head[region] = eyes[0]
    parts = {
        "head": head,
        "neck": _under_chin(_skin(0.92 * own.skin, SIZES["neck"], contrast, rng)),
        "shoulders": _shirt(own.shirt, SIZES["shoulders"], rng),
        "hand": _fingers(_skin(0.95 * own.skin, SIZES["hand"], contrast, rng)),
    }
    return Texture(ycbcr(_stacked(parts)), ycbcr(eyes), (region[0].start, region[1].start))


def _stacked(parts: dict[str, Floats]) -> Floats:
    """Return one image (H, W, 3) with the textures of all parts above one another."""
    width = max(size[1] for size in SIZES.values())
    return np.concatenate([np.pad(parts[name], ((0, 0), (0, width - SIZES[name][1]), (0, 0))) for name in SIZES])


def _eye_region(places: Floats) -> tuple[slice, slice]:
    """Return the rows and columns of the texture of the head that contain both eyes."""
    x, y, z = np.moveaxis(places, -1, 0)
    middle, side = y.shape[1] // 2, y.shape[0] // 2
    rows = np.flatnonzero((y[:, middle] < EYE_M[1] + 0.018) & (y[:, middle] > EYE_M[1] - 0.018))
    columns = np.flatnonzero((np.abs(x[side]) < EYE_M[0] + 0.025) & (z[side] > 0.0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def noise(size: tuple[int, int], texels: float, rng: np.random.Generator) -> Floats:
    """Return smooth random values (H, W) of unit variance that change over about ``texels`` texels."""
    spectrum = np.fft.rfft2(rng.normal(size=size))
    up, along = np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1])[None]
    values = np.fft.irfft2(spectrum * np.exp(-0.5 * (2.0 * np.pi * texels / 2.0) ** 2 * (up**2 + along**2)), s=size)
    return np.asarray(values / values.std())


def _skin(skin: Floats, size: tuple[int, int], contrast: float, rng: np.random.Generator) -> Floats:
    """Return bare skin (H, W, 3) with pores and freckles."""
    pores = 3.5 * noise(size, 1.6, rng) + 3.0 * noise(size, 4.0, rng) + 3.0 * noise(size, 14.0, rng)
    freckles = np.maximum(noise(size, 2.6, rng) - 1.7, 0.0)
    grey = contrast * (pores - 16.0 * freckles)
    tint = contrast * noise(size, 9.0, rng)
    return np.asarray(skin + grey[..., None] * (1.0, 0.95, 0.85) + tint[..., None] * (1.5, -1.0, -0.5))


def _face(skin: Floats, places: Floats, contrast: float, rng: np.random.Generator) -> Floats:
    """Return the skin of the head with moles, lips and ears, and the shades that its relief throws."""
    x, y, z = np.moveaxis(places, -1, 0)
    front = smooth(0.02, 0.03, z)
    colour = _skin(skin, SIZES["head"], contrast, rng) - contrast * (front * _moles(x, y, rng))[..., None] * MOLE
    red = 0.5 * _blob(x, y, (0.042, -0.028), (0.018, 0.014)) + 0.6 * _blob(x, y, (0.0, -0.036), (0.012, 0.008))
    colour = colour + (front * red)[..., None] * (6.0, -14.0, -12.0)
    dark = sum((share * _blob(x, y, at, spread) for share, at, spread in SHADES.values()), np.zeros_like(x))
    light = 0.10 * np.exp(-0.5 * (x / 0.004) ** 2) * smooth(-0.036, 0.02, y) * smooth(-0.02, 0.02, -y)  # nose
    light = light + 0.06 * _blob(x, y, (0.0, 0.048), (0.030, 0.014))  # forehead
    light = light + 0.10 * _blob(x, y, (0.0, -0.032), (0.006, 0.005))  # tip of the nose
    colour = colour * (1.0 - np.clip(front * dark, 0.0, 0.9) + front * light)[..., None]
    colour = _over(colour, LIP, front * _lips(x, y) * (0.85 + 0.05 * noise(SIZES["head"], 2.0, rng)))
    colour = _over(colour, MOUTH, front * _mouth_line(x, y))
    inside = np.hypot((z + 0.010) / 0.009, (y + 0.002) / 0.018)
    ear = smooth(-1.0, 0.4, -inside) * smooth(0.9, 0.1, np.abs(x) / mannequin.WIDTH_M)
    below = smooth(0.104, 0.02, -y) * smooth(-0.09, 0.05, -z)  # in the shadow of the chin
    return np.asarray(colour * (1.0 - 0.35 * ear - 0.35 * below)[..., None])


def _moles(x: Floats, y: Floats, rng: np.random.Generator) -> Floats:
    """Return where moles are, 0 to 1."""
    moles = np.zeros_like(x)
    for _ in range(N_MOLES):
        at = rng.uniform((-0.055, -0.095), (0.055, 0.065))
        size_m = rng.uniform(0.0007, 0.0016)
        moles += np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / size_m**2)
    return moles


def _blob(x: Floats, y: Floats, at: tuple[float, float], spread: tuple[float, float]) -> Floats:
    return mannequin.Bump(1.0, at, spread).at(x, y)


def _over(colour: Floats, paint: npt.ArrayLike, share: Floats) -> Floats:
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


def _eyes(colour: Floats, places: Floats, own: Colours, shut: float) -> Floats:
    """Return the region of the eyes (h, w, 3) with the lids shut to a share."""
    across, up = (np.abs(places[..., 0]) - EYE_M[0]) / EYE_WIDTH_M, places[..., 1] - EYE_M[1]
    curve = np.sqrt(np.maximum(1.0 - across**2, 0.0))
    fold, lower = UPPER_LID_M * curve, -LOWER_LID_M * curve**1.4
    upper = lower + (1.0 - shut) * (UPPER_LID_M * curve**1.1 - lower)
    within = np.abs(across) < 1.0
    inside = within * smooth(0.0, SOFT_M, upper - up) * smooth(0.0, SOFT_M, up - lower)
    lid = within * smooth(0.0, SOFT_M, fold + 0.0016 - up) * smooth(0.0, SOFT_M, up - upper)
    colour = _over(colour, 0.86 * own.skin, 0.8 * lid)
    colour = _over(colour, _eyeballs(places, own.iris), inside)
    near = np.abs(across) < 1.06
    colour = _over(colour, LASH, 0.92 * near * curve**0.3 * _line(up - upper, 0.0010))
    colour = _over(colour, 0.60 * own.skin, 0.55 * near * curve * _line(up - fold - 0.0030, 0.0009))
    return _over(colour, 0.62 * own.skin, 0.6 * near * _line(up - lower, 0.0007))


def _eyeballs(places: Floats, iris: Floats) -> Floats:
    """Return the colour of both eyeballs (h, w, 3), in the shade of the upper lids."""
    x = places[..., 0] - np.sign(places[..., 0]) * EYE_M[0]
    up = places[..., 1] - EYE_M[1]
    away = np.hypot(x, up - 0.0004)
    ball = _over(np.broadcast_to(np.array(WHITE, dtype=float), places.shape), iris, smooth(-IRIS_M, 0.0012, -away))
    ball = _over(ball, 0.55 * iris, smooth(-IRIS_M, 0.001, -away) * smooth(IRIS_M - 0.0010, 0.001, away))
    ball = _over(ball, PUPIL, smooth(-PUPIL_M, 0.0010, -away))
    ball = _over(ball, GLINT, smooth(-0.0011, 0.0008, -np.hypot(x - 0.002, up - 0.0026)))
    return ball * (1.0 - 0.25 * smooth(0.0035, 0.004, up))[..., None]


def _line(away: Floats, width_m: float) -> Floats:
    """Return how much of a thin line is at a distance from it, 0 to 1."""
    return np.asarray(np.exp(-0.5 * (away / width_m) ** 2))


def _shirt(shirt: Floats, size: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Return a woven shirt (H, W, 3) with folds."""
    row, column = np.mgrid[: size[0], : size[1]].astype(float)
    weave = 0.10 * np.sin(2.0 * np.pi * row / 7.0) + 0.10 * np.sin(2.0 * np.pi * column / 9.0)
    folds = 0.10 * noise(size, 30.0, rng) + 0.05 * noise(size, 2.0, rng)
    return np.asarray(np.clip(shirt * (1.0 + weave + folds)[..., None], 4.0, 250.0))


def _fingers(colour: Floats) -> Floats:
    """Return the skin of the hand (H, W, 3) with dark gaps between the fingers."""
    columns, rows = np.meshgrid(np.linspace(0.0, 1.0, colour.shape[1]), np.linspace(1.0, 0.0, colour.shape[0]))
    across = 2.0 * np.sin(2.0 * np.pi * columns - np.pi)
    gap = np.exp(-0.5 * ((across - np.round(across)) / 0.07) ** 2) * (np.abs(across) < 1.5)
    return np.asarray(colour * (1.0 - 0.6 * gap * smooth(0.52, 0.06, rows))[..., None])


def _under_chin(colour: Floats) -> Floats:
    """Return the skin of the neck (H, W, 3), which is dark below the chin."""
    down = np.linspace(0.0, 1.0, len(colour))
    return np.asarray(colour * (1.0 - 0.45 * smooth(-0.55, 0.4, -down))[:, None, None])
