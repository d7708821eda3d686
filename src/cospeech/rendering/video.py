"""Videos of moving bodies: panels side by side, each a body from two sides, with the record's sound.

The same tables and sound give the same bytes (see ``mp4``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.formats import canvas, films, mp4
from cospeech.formats.canvas import Image
from cospeech.motion import skeleton
from cospeech.rendering import figure, picture

PALE = (225, 228, 232)
"""Letters on a film."""


@dataclass(frozen=True)
class Panel:
    """One column of a video: whose motion it is, the motion table and the gesture phrases that it shows."""

    title: str
    motion: pd.DataFrame
    phrases: pd.DataFrame

    def opening(self, n_frames: int) -> Panel:
        """Return the panel of the first ``n_frames`` of the motion."""
        end_s = n_frames / skeleton.frame_rate(self.motion)
        begun = self.phrases[self.phrases["start_s"] < end_s]
        phrases = begun.assign(end_s=begun["end_s"].clip(upper=end_s))
        return replace(self, motion=self.motion.iloc[:n_frames], phrases=phrases)


def panel_size(height_px: int) -> tuple[int, int]:
    """Return height and width of one panel in pixels, both even as video needs them."""
    return height_px, 4 * round(0.31 * height_px)


def pictures(panels: Sequence[Panel], fps: float, height_px: int, caption: str) -> Iterator[Image]:
    """Yield the frames (H, W, 3) of a video of ``panels`` side by side.

    One camera a side sees all panels alike, from so far away that nobody leaves the picture.

    Parameters
    ----------
    panels : what to show; all run for the length of the first.
    fps : frames a second of the video; each shows the motion frame that holds its centre.
    height_px : height of the picture.
    caption : what is written under each panel, before the time.
    """
    height, width = panel_size(height_px)
    unit = height / 360
    head, foot = round(38 * unit), round(34 * unit)
    bodies = [figure.pose(panel.motion) for panel in panels]
    painter, floor_m = figure.Painter(), figure.floor_height(bodies)
    views = figure.cameras(painter.extent(bodies), (0, head, width, height - foot))
    figures = [
        [painter.figure(moving, view.moved(number * width), floor_m) for view in views]
        for number, moving in enumerate(bodies)
    ]

    motion_fps = skeleton.frame_rate(panels[0].motion)
    duration_s = len(panels[0].motion) / motion_fps
    times = segments.frame_times(n_pictures(panels[0].motion, fps), fps)
    labels = [picture.labels_at(panel.phrases, times) for panel in panels]
    margin, band = round(14 * unit), round(6 * unit)
    strip_box = (margin, height - round(30 * unit), width - margin, height - round(30 * unit) + band)
    strips = [picture.Strip(panel.phrases, duration_s, strip_box) for panel in panels]
    still = np.hstack([_sheet(panel, strip, caption, unit) for panel, strip in zip(panels, strips, strict=True)])
    image = np.empty_like(still)
    for step, time_s in enumerate(times):
        image[:] = still
        for number, strip in enumerate(strips):
            part = image[:, number * width : (number + 1) * width]
            frame = min(int(time_s * motion_fps), len(bodies[number]) - 1)
            for drawn in figures[number]:
                drawn.draw(image, frame)
            strip.mark(part, time_s)
            colours, shape = picture.tag(labels[number][step], round(11 * unit))
            canvas.lay(part, round(11 * unit), width - margin - shape.shape[1], colours, shape)
            _clock(part, time_s, height - round(19 * unit), width - margin, round(10 * unit))
        yield image


def beside_film(
    images: Iterable[Image], shot: str | Path, frames: Iterable[int], height_px: int, caption: str
) -> Iterator[Image]:
    """Yield ``images`` with a panel left of each that shows the film it was found in; one array that changes.

    Parameters
    ----------
    shot : the film.
    frames : which of its pictures belongs to each image, rising.
    """
    height, width = panel_size(height_px)
    unit = height / 360
    filmed = enumerate(films.pictures(shot, height))
    number = -1
    both = np.zeros((height, width, 3), dtype=np.uint8)
    for image, frame in zip(images, frames, strict=True):
        if both.shape[1] == width:
            both = np.hstack([both, image])
        while number < frame:
            number, shown = next(filmed)
        wall, spare = both[:, :width], width - shown.shape[1]
        wall[:, max(spare, 0) // 2 :][:, : shown.shape[1]] = shown[:, max(-spare, 0) // 2 :][:, :width]
        canvas.write(wall, "film", round(11 * unit), round(14 * unit), round(14 * unit), PALE, bold=True)
        canvas.write(wall, caption, height - round(19 * unit), round(14 * unit), round(10 * unit), canvas.FAINT)
        both[:, width:] = image
        yield both


def _sheet(panel: Panel, strip: picture.Strip, caption: str, unit: float) -> Image:
    """Return what stands still in a panel."""
    height, width = panel_size(round(360 * unit))
    sheet = picture.background(height, width)
    margin = round(14 * unit)
    canvas.write(sheet, panel.title, round(11 * unit), margin, round(14 * unit), bold=True)
    canvas.write(sheet, caption, height - round(19 * unit), margin, round(10 * unit), canvas.FAINT)
    strip.draw(sheet)
    sheet[:, -1] = (222, 221, 218)
    return sheet


def _clock(image: Image, time_s: float, top: int, right: int, size: int) -> None:
    """Write the time, ending at column ``right``; every digit takes the same room, so that nothing jitters."""
    left = right - canvas.lettering(" s", size).shape[1]
    canvas.write(image, " s", top, left, size, canvas.FAINT)
    room = canvas.lettering("0", size).shape[1]
    for letter in reversed(f"{time_s:.1f}"):
        left -= room if letter.isdigit() else room // 2
        canvas.write(image, letter, top, left, size, canvas.FAINT)


def film(
    path: str | Path,
    panels: Sequence[Panel],
    caption: str,
    fps: float,
    height_px: int,
    longest_s: float | None,
    sound: str | Path | None,
    shot: str | Path | None = None,
) -> None:
    """Write the video of ``panels`` (see ``pictures``) as MP4 to ``path``, silent where ``sound`` names no file.

    Of what is longer than ``longest_s`` it shows the beginning, and says so. ``shot`` names the film that the first
    motion was found in, a picture a motion frame; it is shown beside.
    """
    if longest_s is not None and n_pictures(panels[0].motion, fps) > longest_s * fps:
        n_frames = round(longest_s * skeleton.frame_rate(panels[0].motion))
        panels = [panel.opening(n_frames) for panel in panels]
        caption = f"{caption} · first {longest_s:g} s"
    images = pictures(panels, fps, height_px, caption)
    motion = panels[0].motion
    if shot is not None:
        times_s = segments.frame_times(n_pictures(motion, fps), fps)
        frames = np.minimum((times_s * skeleton.frame_rate(motion)).astype(int), len(motion) - 1)
        images = beside_film(images, shot, frames, height_px, caption)
    shown_s = n_pictures(motion, fps) / fps
    mp4.encode(path, images, fps, mp4.read_sound(sound, shown_s) if sound else None)


def n_pictures(motion: pd.DataFrame, fps: float) -> int:
    """Return how many pictures a video of ``fps`` needs to show a motion."""
    return max(1, round(len(motion) / skeleton.frame_rate(motion) * fps))
