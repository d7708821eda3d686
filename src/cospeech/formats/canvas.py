"""Text and colours on images that are arrays, and PNG files."""

from __future__ import annotations

import functools
import importlib.util
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from cospeech.data import tables
from cospeech.data.arrays import Image

Opacity = npt.NDArray[np.float32]
Colour = tuple[int, int, int]

INK: Colour = (52, 56, 64)
FAINT: Colour = (128, 133, 142)


@functools.cache
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans at ``size`` pixels, from the files of matplotlib, which is not imported for it."""
    found = importlib.util.find_spec("matplotlib")
    assert found is not None
    assert found.origin is not None
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(found.origin).parent / "mpl-data" / "fonts" / "ttf" / name), size)


@functools.cache
def lettering(text: str, size: int, bold: bool = False) -> Opacity:
    """Return the opacity of ``text`` in each pixel, (h, w) in [0, 1]; h depends on the font size alone."""
    face = font(size, bold)
    ascent, descent = face.getmetrics()
    plate = Pillow.new("L", (max(1, round(face.getlength(text)) + 1), ascent + descent))
    ImageDraw.Draw(plate).text((0, 0), text, font=face, fill=255)
    return np.asarray(plate, dtype=np.float32) / np.float32(255)


def lay(image: Image, top: int, left: int, colours: Image | Colour, opacity: Opacity) -> None:
    """Blend colours (h, w, 3), or one colour, with an opacity (h, w) into ``image``; what is outside is clipped."""
    height, width = opacity.shape
    part = image[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)]
    rows, columns = (slice(max(-at, 0), max(-at, 0) + n) for at, n in zip((top, left), part.shape, strict=False))
    cover = opacity[rows, columns, None]
    ink = np.asarray(colours, dtype=np.float32)
    if ink.ndim == 3:
        ink = ink[rows, columns]
    part[:] = np.round(part + cover * (ink - part))


def write(image: Image, text: str, top: int, left: int, size: int, colour: Colour = INK, bold: bool = False) -> int:
    """Write ``text`` with its upper left corner at (top, left), and return its width."""
    ink = lettering(text, size, bold)
    lay(image, top, left, colour, ink)
    return ink.shape[1]


def save(image: Image, path: str | Path) -> None:
    """Write an image as a PNG file, atomically."""
    with tables.replacing(path) as temporary:
        Pillow.fromarray(image).save(temporary, format="png", optimize=True)
