"""Elements around a figure: background, coloured gesture label, and timeline of the phrases."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd
from PIL import Image as Pillow
from PIL import ImageDraw

from cospeech.data import segments, vocabulary
from cospeech.formats import canvas
from cospeech.formats.canvas import Colour, Image


def gesture_colour(label: str) -> Colour:
    """Return the colour of a gesture class as red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(vocabulary.gesture_colour(label).removeprefix("#"))
    return red, green, blue


def background(height: int, width: int) -> Image:
    """Return an empty light image (height, width, 3), slightly darker toward the bottom."""
    down = np.linspace(0, 1, height)[:, None, None] ** 2
    shade = (1 - down) * np.array([248.0, 247.0, 245.0]) + down * np.array([233.0, 232.0, 229.0])
    return np.broadcast_to(np.round(shade), (height, width, 3)).astype(np.uint8, order="C")


@functools.cache
def tag(label: str, size: int) -> tuple[Image, npt.NDArray[np.float32]]:
    """Return a rounded box with the name of a gesture: colours (h, w, 3) and opacity (h, w)."""
    ink = canvas.lettering(label.replace("_", " "), size, True)
    across, up = round(0.75 * size), round(0.12 * size)
    height, width = ink.shape[0] + 2 * up, ink.shape[1] + 2 * across
    fine = Pillow.new("L", (4 * width, 4 * height))
    ImageDraw.Draw(fine).rounded_rectangle((0, 0, 4 * width - 1, 4 * height - 1), 2 * height, fill=255)
    shape = np.asarray(fine.resize((width, height), Pillow.Resampling.BOX), dtype=np.float32) / np.float32(255)
    colour = gesture_colour(label)
    colours = np.full((height, width, 3), colour, dtype=np.uint8)
    light = float(np.dot(colour, (0.299, 0.587, 0.114)))
    canvas.lay(colours, up, across, canvas.INK if light > 145 else (255, 255, 255), ink)
    return colours, shape


def clock(image: Image, time_s: float, top: int, right: int, size: int) -> None:
    """Write the time, right-aligned at column ``right``; all digits have equal width to avoid jitter."""
    left = right - canvas.lettering(" s", size).shape[1]
    canvas.write(image, " s", top, left, size, canvas.FAINT)
    digit_width = canvas.lettering("0", size).shape[1]
    for letter in reversed(f"{time_s:.1f}"):
        left -= digit_width if letter.isdigit() else digit_width // 2
        canvas.write(image, letter, top, left, size, canvas.FAINT)


class Timeline:
    """The phrases of a record as a coloured band, with a cursor at the current time."""

    def __init__(self, phrases: pd.DataFrame, duration_s: float, box: tuple[int, int, int, int]) -> None:
        self.left, self.top, self.right, self.bottom = box
        self.duration_s = duration_s
        self.phrases = phrases

    def draw(self, image: Image) -> None:
        """Draw the band into ``image``."""
        for label, start, end in zip(
            self.phrases["label"], self.phrases["start_s"], self.phrases["end_s"], strict=True
        ):
            first, last = self._column(start), self._column(end)
            image[self.top : self.bottom, first : max(last - 1, first + 1)] = gesture_colour(label)

    def draw_cursor(self, image: Image, time_s: float) -> None:
        """Draw the cursor at ``time_s`` into ``image``."""
        column = self._column(time_s)
        image[self.top - 3 : self.bottom + 3, column - 1 : column + 1] = canvas.INK

    def _column(self, time_s: float) -> int:
        share = min(max(time_s / self.duration_s, 0.0), 1.0)
        return round(self.left + share * (self.right - self.left))


def labels_at(phrases: pd.DataFrame, times_s: Sequence[float] | npt.NDArray[np.float64]) -> list[str]:
    """Return the gesture class at each time."""
    return list(phrases["label"].to_numpy(dtype=object)[segments.at_times(phrases, times_s)])
