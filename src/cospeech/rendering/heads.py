"""Portraits of moving heads: videos with one panel per head, and strips of pictures.

Below each head, its angles are drawn over time: nod, turn and tilt.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from PIL import Image as Pillow
from PIL import ImageDraw

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.formats import canvas
from cospeech.formats.canvas import Image
from cospeech.motion import head, skeleton
from cospeech.rendering import figure, picture, video

ANGLES = (("nod", (34, 120, 181)), ("turn", (213, 94, 0)), ("tilt", (0, 158, 115)))
"""What the angles about x, y and z are called, and the colours of their curves."""

LARGEST_DEG = 30.0
"""Angle at the upper and lower edge of the curves; larger ones leave the plot."""

FAINT = (205, 204, 200)

LONGEST_ROW = 3
"""Largest number of panels next to each other in a video."""

PICTURE_PX = (230, 190)
"""Height and width of one picture of a strip."""

STRIP_PICTURES, STRIP_STEP_S = 8, 0.5
"""Number of pictures of a strip, and the time between two of them."""


class Panel(NamedTuple):
    """One column of a video, or one row of a strip: its title and the angles of its head (schema ``head``)."""

    title: str
    angles: pd.DataFrame


def body(angles_deg: Floats, fps: float) -> pd.DataFrame:
    """Return the motion table of a standing body whose head has angles (T, 3) in degrees."""
    return head.moved(skeleton.standing(len(angles_deg), fps), head.table(angles_deg, fps))


def render(panels: Sequence[Panel], fps: float, height_px: int, duration_s: float, caption: str) -> Iterator[Image]:
    """Yield the frames (H, W, 3) of a video of heads side by side; the array is reused.

    Parameters
    ----------
    panels : the heads to show.
    fps : frame rate of the video.
    height_px : height of the image.
    duration_s : duration of the video in seconds.
    caption : text below each head, before the time.
    """
    height, width = video.panel_size(height_px)
    unit = height / 360
    margin, plot = round(14 * unit), (round(262 * unit), round(334 * unit))
    times_s = segments.frame_times(max(1, round(duration_s * fps)), fps)
    curves = [head.at_times(panel.angles, times_s) for panel in panels]
    bodies = [figure.pose(body(angles, fps)) for angles in curves]
    view = figure.portrait((0, round(30 * unit), width, plot[0] - round(6 * unit)))
    painter = figure.Painter()
    figures = [painter.figure(moving, view.shifted(place * width), 0.0) for place, moving in enumerate(bodies)]
    static = np.hstack(
        [_background(panel.title, angles, caption, unit, plot) for panel, angles in zip(panels, curves, strict=True)]
    )
    image = np.empty_like(static)
    for step, time_s in enumerate(times_s):
        image[:] = static
        for place, drawn in enumerate(figures):
            drawn.draw(image, step)
            part = image[:, place * width : (place + 1) * width]
            column = margin + round((width - 2 * margin) * float(time_s) / duration_s)
            part[plot[0] : plot[1], column - 1 : column + 1] = canvas.INK
            picture.clock(part, time_s, height - round(19 * unit), width - margin, round(10 * unit))
        yield image


def write_video(
    path: str | Path,
    panels: Sequence[Panel],
    caption: str,
    fps: float,
    height_px: int,
    longest_s: float | None,
    sound: str | Path | None,
    footage: str | Path | None = None,
) -> None:
    """Write the video of heads to ``path`` as MP4.

    Parameters
    ----------
    path : the output file.
    panels, caption, fps, height_px : see ``render``.
    longest_s : if the heads move longer, only their first ``longest_s`` seconds are shown and the caption says so.
    sound : audio file; None for a silent video.
    footage : film of the first head, one picture per frame of its angles, shown before the panels.
    """
    first = panels[0].angles
    rate = head.frame_rate(first)
    shown_s = len(first) / rate
    if longest_s is not None and shown_s > longest_s:
        shown_s, caption = longest_s, f"{caption} · first {longest_s:g} s"
    n_images = max(1, round(shown_s * fps))
    film = None if footage is None else video.Film(footage, rate, len(first))
    images = video.filmed(render(panels, fps, height_px, shown_s, caption), film, fps, n_images, height_px, caption)
    video.encode(path, in_rows(images, video.panel_size(height_px)[1]), fps, n_images, sound)


def in_rows(images: Iterable[Image], width: int) -> Iterator[Image]:
    """Yield images of panels side by side with the panels in rows, so that many remain large; the array is reused.

    Up to ``LONGEST_ROW`` panels stand in one row, four in two rows of two.

    Parameters
    ----------
    images : (H, n * width, 3) each.
    width : width of a panel.
    """
    laid: Image | None = None
    for image in images:
        height, n_panels = image.shape[0], image.shape[1] // width
        if n_panels <= LONGEST_ROW:
            yield image
            continue
        columns = 2 if n_panels == 4 else LONGEST_ROW
        if laid is None:
            laid = picture.background(height * -(-n_panels // columns), width * columns)
        for place in range(n_panels):
            top, left = height * (place // columns), width * (place % columns)
            laid[top : top + height, left : left + width] = image[:, place * width : (place + 1) * width]
        yield laid


def liveliest(angles: pd.DataFrame) -> Floats:
    """Return the times (``STRIP_PICTURES``,) in seconds of a strip in which a head moves most.

    Parameters
    ----------
    angles : angles of the head (schema ``head``).
    """
    fps = head.frame_rate(angles)
    times_s = segments.frame_times(len(angles), fps)
    curves = head.at_times(angles, times_s)
    span = min(round((STRIP_PICTURES - 1) * STRIP_STEP_S * fps), len(curves) - 1)
    turned = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curves, axis=0), axis=1)))
    start = int(np.argmax(turned[span:] - turned[: len(turned) - span]))
    return np.linspace(times_s[start], times_s[start + span], STRIP_PICTURES)


def strip(panels: Sequence[Panel], times_s: Floats) -> Image:
    """Return an image (H, W, 3) with a row of pictures of each head at some times (n,) in seconds."""
    height, width = PICTURE_PX
    painter, view = figure.Painter(detail=3), figure.portrait((0, 0, width, height))
    rows = []
    for panel in panels:
        angles = head.at_times(panel.angles, times_s)
        drawn = painter.figure(figure.pose(body(angles, 1.0)), view, 0.0)
        cells = []
        for place, time_s in enumerate(times_s):
            cell = picture.background(height, width)
            drawn.draw(cell, place)
            canvas.write(cell, f"{time_s:.1f} s", 4, 10, 11, canvas.FAINT)
            cell[:, -1] = FAINT
            cells.append(cell)
        header = picture.background(1, 1) * np.ones((28, width * len(cells), 1), dtype=np.uint8)
        canvas.write(header, panel.title, 9, 10, 13, bold=True)
        rows += [header, np.hstack(cells)]
    return np.vstack(rows)


def farthest(patterns: pd.DataFrame) -> tuple[list[str], Floats]:
    """Return the name of each pattern of a head, and its mean angles (n, 3) in degrees where they are largest.

    Parameters
    ----------
    patterns : a parallel HMM of the head (schema ``hmm_model``).
    """
    means = patterns.pivot_table(index=["branch", "state"], columns="feature", values="mean", sort=False)
    angles = means[head.COLUMNS]
    largest = np.sqrt((angles**2).sum(axis=1)).groupby("branch", sort=False).idxmax()
    return [str(name) for name in largest.index], angles.loc[largest].to_numpy(dtype=float)


def poses(titles: Sequence[str], angles_deg: Floats) -> Image:
    """Return an image (H, W, 3) of one head per title, side by side, with angles (n, 3) in degrees."""
    height, width = PICTURE_PX
    drawn = figure.Painter(detail=3).figure(
        figure.pose(body(angles_deg, 1.0)), figure.portrait((0, 24, width, height)), 0.0
    )
    cells = []
    for place, title in enumerate(titles):
        cell = picture.background(height, width)
        drawn.draw(cell, place)
        canvas.write(cell, title, 9, 10, 13, bold=True)
        cell[:, -1] = FAINT
        cells.append(cell)
    return np.hstack(cells)


def _background(title: str, angles_deg: Floats, caption: str, unit: float, plot: tuple[int, int]) -> Image:
    """Return the parts of a panel that are the same in all frames."""
    height, width = video.panel_size(round(360 * unit))
    image = picture.background(height, width)
    margin = round(14 * unit)
    canvas.write(image, title, round(11 * unit), margin, round(14 * unit), bold=True)
    canvas.write(image, caption, height - round(19 * unit), margin, round(10 * unit), canvas.FAINT)
    _draw_curves(image, angles_deg, (margin, plot[0], width - margin, plot[1]), unit)
    image[:, -1] = (222, 221, 218)
    return image


def _draw_curves(image: Image, angles_deg: Floats, box: tuple[int, int, int, int], unit: float) -> None:
    """Draw angles (T, 3) in degrees over time into a box (left, top, right, bottom) of an image."""
    left, top, right, bottom = box
    fine = Pillow.fromarray(image).resize((2 * image.shape[1], 2 * image.shape[0]), Pillow.Resampling.NEAREST)
    pen = ImageDraw.Draw(fine)
    columns = left + (right - left) * (np.arange(len(angles_deg)) + 0.5) / len(angles_deg)
    middle, half = (top + bottom) / 2, (bottom - top) / 2
    pen.line([(2 * left, 2 * middle), (2 * right, 2 * middle)], fill=FAINT, width=2)
    for place, (_, colour) in enumerate(ANGLES):
        rows = middle - half * np.clip(angles_deg[:, place] / LARGEST_DEG, -1.0, 1.0)
        pen.line(list(zip(2 * columns, 2 * rows, strict=True)), fill=colour, width=max(2, round(2.6 * unit)))
    image[:] = np.asarray(fine.resize((image.shape[1], image.shape[0]), Pillow.Resampling.BOX))
    for place, (name, colour) in enumerate(ANGLES):
        canvas.write(image, name, top - round(9 * unit), left + round(38 * unit) * place, round(9 * unit), colour)
