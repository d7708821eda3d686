"""The faces of a population: skin, eyes, nose, hair and the measures of the mouth.

A face is drawn once, without its mouth, in the plane of the face: pixels of the film with the origin between eyes and
nose, u to the right and v downward. The mouth and all motion are drawn frame by frame (see ``drawing``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from cospeech.data.arrays import Floats, Singles
from cospeech.data.rng import random_source
from cospeech.studio.population.speakers import Speaker

HALF_WIDTH, HALF_HEIGHT = 68.0, 92.0
"""Half the width and height of the head without hair."""
REACH_U, REACH_V = 110, 130
"""Half the width and height of the layer that is drawn."""
FINENESS = 2
"""Pixels of the layer per pixel of the film."""
MOUTH_V = 48.0
"""Usual height of the mouth."""

SKINS = np.array([[224, 172, 140], [208, 156, 124], [190, 138, 106], [160, 112, 84], [236, 188, 162]], dtype=float)
HAIRS = np.array([[38, 28, 22], [64, 44, 30], [96, 66, 40], [24, 22, 24], [120, 92, 60]], dtype=float)
IRISES = np.array([[78, 52, 34], [60, 74, 52], [74, 92, 112], [50, 36, 26]], dtype=float)
LIP = np.array([178.0, 98.0, 92.0])

RGB_TO_YCC = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])
"""Rows give Y, Cb and Cr of full range from red, green and blue; 128 is added to Cb and Cr."""


@dataclass(frozen=True)
class Mouth:
    """The measures of a mouth in pixels of the film, and its colours as Y, Cb, Cr.

    Attributes
    ----------
    height : v of its middle.
    half_width : half its width at rest.
    upper, lower : thickness of the lips.
    bow : depth of the dip in the middle of the upper lip, as a share of its thickness.
    teeth : length of the upper teeth that may be seen.
    tooth : width of a tooth.
    gap : largest opening.
    lean : by how much the mouth opens wider on the right than in the middle, as a share; less than 1.
    lip, enamel, tongue : (3,) colours.
    """

    height: float
    half_width: float
    upper: float
    lower: float
    bow: float
    teeth: float
    tooth: float
    gap: float
    lean: float
    lip: Floats
    enamel: Floats
    tongue: Floats


@dataclass(frozen=True)
class Face:
    """A face.

    Attributes
    ----------
    mouth : its mouth.
    layer : (4, V, U) the head without it: Y, Cb, Cr, and how much of a pixel it covers, 0 to 1.
    skin : (3,) red, green and blue of the skin.
    """

    mouth: Mouth
    layer: Singles
    skin: Floats


def to_ycc(rgb: Floats) -> Floats:
    """Return Y, Cb, Cr (..., 3) of full range of red, green and blue, 0 to 255."""
    return np.asarray(rgb @ RGB_TO_YCC.T + np.array([0.0, 128.0, 128.0]))


def face(speaker: Speaker, own_lips: float, seed: int) -> Face:
    """Return the face of a speaker; ``own_lips`` scales what distinguishes the mouth and the skin around it."""
    rng = random_source(seed, "population", "face", speaker.name)
    own = random_source(seed, "population", "mouth", speaker.name)
    skin = SKINS[0] * 0.85 + own_lips * 0.6 * (SKINS[own.integers(len(SKINS))] - SKINS[0])
    return Face(_mouth(skin, own_lips, own), _layer(skin, own_lips, rng, own), skin)


def _mouth(skin: Floats, own_lips: float, rng: np.random.Generator) -> Mouth:
    def about(usual: float, spread: float) -> float:
        return usual * float(np.exp(own_lips * spread * np.clip(rng.standard_normal(), -2.0, 2.0)))

    red = np.clip(0.55 * LIP + 0.45 * skin * [0.86, 0.6, 0.6] + own_lips * 9.0 * rng.standard_normal(3), 0.0, 255.0)
    return Mouth(
        height=about(MOUTH_V, 0.05),
        half_width=about(27.0, 0.09),
        upper=about(6.5, 0.22),
        lower=about(8.5, 0.20),
        bow=about(0.3, 0.4),
        teeth=about(6.0, 0.25),
        tooth=about(6.5, 0.15),
        gap=about(24.0, 0.12),
        lean=own_lips * 0.25 * float(np.clip(rng.standard_normal(), -2.0, 2.0)),
        lip=to_ycc(red),
        enamel=to_ycc(np.array([226.0, 218.0, 200.0]) * about(0.95, 0.06)),
        tongue=to_ycc(np.array([168.0, 84.0, 84.0]) * about(0.95, 0.10)),
    )


def _layer(skin: Floats, own_lips: float, rng: np.random.Generator, own: np.random.Generator) -> Singles:
    """Draw the head without its mouth; returns (4, V, U)."""
    u = (np.arange(2 * REACH_U * FINENESS) + 0.5) / FINENESS - REACH_U
    v = (np.arange(2 * REACH_V * FINENESS) + 0.5) / FINENESS - REACH_V
    canvas = Canvas(u, v[:, None])
    hair = HAIRS[rng.integers(len(HAIRS))] * rng.uniform(0.8, 1.2)
    long_hair = rng.random() < 0.5
    canvas.paint(hair, _egg(canvas, 0.0, -18.0, HALF_WIDTH + 10, 84.0))
    if long_hair:
        canvas.paint(hair * 0.9, _curtain(canvas))
    ears = rng.uniform(-2.0, 4.0)
    for side in (-1.0, 1.0):
        canvas.paint(skin * 0.88, _egg(canvas, side * (HALF_WIDTH + 1), 2.0 + ears, 9.0, 18.0))
    canvas.paint(skin, _head(canvas))
    _shade(canvas, rng)
    _mark_skin(canvas, own_lips, own)
    _draw_eyes(canvas, hair, rng)
    _draw_nose(canvas, skin, rng)
    hairline = rng.uniform(-64.0, -54.0)
    fringe = canvas.v - hairline - 10.0 * (canvas.u / HALF_WIDTH) ** 2 * rng.uniform(0.2, 1.6)
    inside = np.minimum(-fringe, _egg(canvas, 0.0, -18.0, HALF_WIDTH + 10, 84.0))
    strands = np.sin(canvas.u * 1.3 + 0.04 * canvas.v + 1.2 * _noise(canvas, 3.0, rng))
    canvas.paint(hair * (1.05 + 0.10 * strands + 0.25 * _spot(canvas, -18.0, -84.0, 26.0, 12.0))[..., None], inside)
    layer = np.concatenate([to_ycc(canvas.rgb), canvas.alpha[..., None]], axis=2)
    return np.ascontiguousarray(np.moveaxis(gaussian_filter(layer, (0.9, 0.9, 0)), 2, 0), dtype=np.float32)


class Canvas:
    """What is drawn: colours (V, U, 3), coverage (V, U), and the coordinates u (U,) and v (V, 1) of the pixels."""

    def __init__(self, u: Floats, v: Floats) -> None:
        self.u, self.v = u, v
        self.alpha = np.zeros((len(v), len(u)))
        self.rgb = np.zeros((*self.alpha.shape, 3))

    def paint(self, colour: Floats, distance: Floats, softness: float = 1.0, strength: float = 1.0) -> None:
        """Cover the pixels whose signed ``distance`` (V, U) to an outline, positive inside, is positive."""
        cover = strength * np.clip(0.5 + distance / softness, 0.0, 1.0)
        self.rgb += cover[..., None] * (colour - self.rgb)
        self.alpha = np.maximum(self.alpha, cover)

    def tint(self, factor: Floats | list[float] | float, weight: Floats) -> None:
        """Multiply the colours by ``factor``, as far as ``weight`` (V, U) says."""
        self.rgb *= 1.0 + weight[..., None] * (np.asarray(factor) - 1.0)


def _egg(canvas: Canvas, u: float, v: float, half_width: float, half_height: float) -> Floats:
    """Return the approximate signed distance (V, U) to an ellipse, positive inside."""
    radius = np.hypot((canvas.u - u) / half_width, (canvas.v - v) / half_height)
    return np.asarray((1.0 - radius) * min(half_width, half_height))


def _curtain(canvas: Canvas) -> Floats:
    """Return the signed distance (V, U) to long hair, which falls to the shoulders and is round at its ends."""
    radius = (np.abs(canvas.u / (HALF_WIDTH + 13)) ** 4 + np.abs((canvas.v - 14.0) / 96.0) ** 4) ** 0.25
    return np.asarray((1.0 - radius) * HALF_WIDTH)


def _head(canvas: Canvas) -> Floats:
    """Return the signed distance (V, U) to the outline of the head, which narrows towards the chin."""
    narrow = 1.0 - 0.24 * np.clip(canvas.v / HALF_HEIGHT, 0.0, 1.0) ** 2
    radius = (np.abs(canvas.u / (HALF_WIDTH * narrow)) ** 2.3 + np.abs(canvas.v / HALF_HEIGHT) ** 2.3) ** (1 / 2.3)
    return np.asarray((1.0 - radius) * HALF_WIDTH)


def _spot(canvas: Canvas, u: float, v: float, wide: float, high: float) -> Floats:
    """Return a soft spot (V, U), 1 in its middle."""
    return np.asarray(np.exp(-(((canvas.u - u) / wide) ** 2)) * np.exp(-(((canvas.v - v) / high) ** 2)))


def _noise(canvas: Canvas, size: float, rng: np.random.Generator) -> Floats:
    """Return smooth noise (V, U) of standard deviation 1 with grains of a size in pixels of the film."""
    noise = gaussian_filter(rng.standard_normal(canvas.alpha.shape, dtype=np.float32), size * FINENESS)
    return np.asarray(noise / noise.std())


def _shade(canvas: Canvas, rng: np.random.Generator) -> None:
    """Shade the round head, the sockets of the eyes, cheeks and chin."""
    edge = np.clip((canvas.u / HALF_WIDTH) ** 2 + (canvas.v / HALF_HEIGHT) ** 2, 0.0, 1.0)
    canvas.tint(0.62, edge**2)
    for side in (-1.0, 1.0):
        canvas.tint([0.86, 0.82, 0.82], _spot(canvas, side * 27.0, -20.0, 18.0, 12.0))
        canvas.tint([1.08, 0.97, 0.95], _spot(canvas, side * 34.0, 20.0, 18.0, 16.0))
        fold = np.exp(-(((canvas.u - side * (14.0 + 0.35 * (canvas.v - 14.0))) / 2.6) ** 2))
        canvas.tint(0.90, fold * _spot(canvas, side * 22.0, 32.0, 14.0, 14.0) * rng.uniform(0.4, 1.0))
    canvas.tint(1.07, _spot(canvas, 0.0, 78.0, 16.0, 9.0))
    canvas.tint(0.88, _spot(canvas, 0.0, 66.0, 17.0, 4.0))
    canvas.tint(1.06, _spot(canvas, 0.0, -42.0, 34.0, 16.0))


def _mark_skin(canvas: Canvas, own_lips: float, rng: np.random.Generator) -> None:
    """Give the skin its grain, moles and, to some, a stubble."""
    skin = canvas.alpha
    canvas.tint(1.0 + (0.018 * _noise(canvas, 0.8, rng) + 0.02 * _noise(canvas, 4.0, rng))[..., None], skin)
    stubble = own_lips * max(0.0, rng.uniform(-0.3, 0.3))
    low = np.clip((canvas.v - 22.0) / 16.0, 0.0, 1.0) * np.clip(1.4 - _spot(canvas, 0.0, 40.0, 60.0, 60.0), 0.0, 1.0)
    canvas.tint(1.0 + (0.25 * _noise(canvas, 0.6, rng) - 1.0)[..., None] * stubble, low * skin)
    for _ in range(5):
        place_u, place_v, size = rng.uniform(-48.0, 48.0), rng.uniform(-40.0, 84.0), rng.uniform(0.7, 1.4)
        canvas.tint([0.66, 0.56, 0.50], min(own_lips, 1.0) * _spot(canvas, place_u, place_v, size, size))


def _draw_eyes(canvas: Canvas, hair: Floats, rng: np.random.Generator) -> None:
    apart, size, brow = rng.uniform(26.0, 30.0), rng.uniform(0.9, 1.1), rng.uniform(2.0, 3.6)
    iris = IRISES[rng.integers(len(IRISES))]
    for side in (-1.0, 1.0):
        u, v = side * apart, -18.0
        eye = _egg(canvas, u, v, 13.0 * size, 6.2 * size)
        canvas.paint(np.array([236.0, 230.0, 224.0]), eye)
        canvas.paint(iris, np.minimum(_egg(canvas, u, v, 6.0, 6.0), eye))
        canvas.paint(np.array([16.0, 12.0, 12.0]), np.minimum(_egg(canvas, u, v, 2.7, 2.7), eye))
        canvas.paint(np.array([250.0, 250.0, 250.0]), _egg(canvas, u - 2.0, v - 2.2, 1.3, 1.3))
        lid = 1.3 - np.abs(eye)
        canvas.paint(hair * 0.5 + 14.0, np.where(canvas.v < v + 1.0, lid, lid - 1.0), strength=0.85)
        arch = v - 14.0 + 0.018 * (canvas.u - u) ** 2 + 0.06 * side * (canvas.u - u)
        brows = np.minimum(brow - np.abs(canvas.v - arch), 16.0 - np.abs(canvas.u - u))
        canvas.paint(hair * 0.8, brows, softness=2.0, strength=0.85)


def _draw_nose(canvas: Canvas, skin: Floats, rng: np.random.Generator) -> None:
    width, tip = rng.uniform(9.0, 12.0), rng.uniform(14.0, 19.0)
    canvas.tint(1.10, _spot(canvas, 0.0, -4.0, 4.0, 22.0))
    canvas.tint(1.10, _spot(canvas, 0.0, tip - 2.0, 6.0, 5.0))
    for side in (-1.0, 1.0):
        canvas.tint(0.86, _spot(canvas, side * 8.0, -4.0, 3.5, 18.0))
        canvas.tint(0.84, _spot(canvas, side * (width + 1.5), tip + 1.0, 3.0, 5.0))
        canvas.paint(skin * 0.32, _egg(canvas, side * width * 0.52, tip + 5.5, 3.4, 1.9), softness=2.0, strength=0.9)
    canvas.tint(0.82, _spot(canvas, 0.0, tip + 8.0, width, 2.2))
    canvas.tint(0.93, _spot(canvas, 0.0, tip + 15.0, 2.2, 5.0))
