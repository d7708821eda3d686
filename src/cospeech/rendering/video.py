"""Videos of moving bodies: panels side by side, each showing a body from two sides, with the sound of the record.

The same tables and sound give the same bytes (see ``cospeech.formats.mp4``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.formats import canvas, films, mp4
from cospeech.formats.canvas import Image
from cospeech.motion import skeleton
from cospeech.rendering import figure, picture

FOOTAGE_TEXT = (225, 228, 232)
"""Colour of text on a film."""


@dataclass(frozen=True)
class Panel:
    """One column of a video: its title, a motion table and the gesture phrases of the motion, if they are shown."""

    title: str
    motion: pd.DataFrame
    phrases: pd.DataFrame

    def head(self, n_frames: int) -> Panel:
        """Return the panel with only the first ``n_frames`` frames of the motion."""
        end_s = n_frames / skeleton.frame_rate(self.motion)
        begun = self.phrases[self.phrases["start_s"] < end_s]
        phrases = begun.assign(end_s=begun["end_s"].clip(upper=end_s))
        return replace(self, motion=self.motion.iloc[:n_frames], phrases=phrases)


def panel_size(height_px: int) -> tuple[int, int]:
    """Return height and width of one panel in pixels; both are even, as required for video."""
    return height_px, 4 * round(0.31 * height_px)


def render(panels: Sequence[Panel], fps: float, height_px: int, caption: str) -> Iterator[Image]:
    """Yield the frames (H, W, 3) of a video of ``panels`` side by side; the array is reused.

    The same cameras, one per side, are used for all panels, far enough away that no body leaves the image.

    Parameters
    ----------
    panels : the panels to show; all have the duration of the first one.
    fps : frame rate of the video; each video frame shows the motion frame at its centre.
    height_px : height of the image.
    caption : text below each panel, before the time.
    """
    height, width = panel_size(height_px)
    unit = height / 360
    head, foot = round(38 * unit), round(34 * unit)
    bodies = [figure.pose(panel.motion) for panel in panels]
    painter, floor_m = figure.Painter(), figure.floor_height(bodies)
    views = figure.cameras(painter.extent(bodies), (0, head, width, height - foot))
    figures = [
        [painter.figure(moving, view.shifted(number * width), floor_m) for view in views]
        for number, moving in enumerate(bodies)
    ]

    motion_fps = skeleton.frame_rate(panels[0].motion)
    duration_s = len(panels[0].motion) / motion_fps
    times = segments.frame_times(n_video_frames(panels[0].motion, fps), fps)
    labels = [picture.labels_at(panel.phrases, times) if len(panel.phrases) else [] for panel in panels]
    margin, band = round(14 * unit), round(6 * unit)
    timeline_box = (margin, height - round(30 * unit), width - margin, height - round(30 * unit) + band)
    timelines = [picture.Timeline(panel.phrases, duration_s, timeline_box) for panel in panels]
    static = np.hstack(
        [_static_panel(panel, timeline, caption, unit) for panel, timeline in zip(panels, timelines, strict=True)]
    )
    image = np.empty_like(static)
    for step, time_s in enumerate(times):
        image[:] = static
        for number, timeline in enumerate(timelines):
            part = image[:, number * width : (number + 1) * width]
            frame = min(int(time_s * motion_fps), len(bodies[number]) - 1)
            for drawn in figures[number]:
                drawn.draw(image, frame)
            if labels[number]:
                timeline.draw_cursor(part, time_s)
                colours, shape = picture.tag(labels[number][step], round(11 * unit))
                canvas.lay(part, round(11 * unit), width - margin - shape.shape[1], colours, shape)
            picture.clock(part, time_s, height - round(19 * unit), width - margin, round(10 * unit))
        yield image


def with_footage(
    images: Iterable[Image], footage: str | Path, frames: Iterable[int], height_px: int, caption: str
) -> Iterator[Image]:
    """Yield ``images`` with a panel on the left that shows the original film; the array is reused.

    Parameters
    ----------
    images : the frames of the video.
    footage : the film.
    frames : the index of the film's picture that belongs to each image, in ascending order.
    height_px : height of the images.
    caption : text below the film.
    """
    height, width = panel_size(height_px)
    unit = height / 360
    filmed = enumerate(films.pictures(footage, height))
    number = -1
    both = np.zeros((height, width, 3), dtype=np.uint8)
    for image, frame in zip(images, frames, strict=True):
        if both.shape[1] == width:
            both = np.hstack([both, image])
        while number < frame:
            number, shown = next(filmed)
        panel, spare = both[:, :width], width - shown.shape[1]
        panel[:, max(spare, 0) // 2 :][:, : shown.shape[1]] = shown[:, max(-spare, 0) // 2 :][:, :width]
        canvas.write(panel, "film", round(11 * unit), round(14 * unit), round(14 * unit), FOOTAGE_TEXT, bold=True)
        canvas.write(panel, caption, height - round(19 * unit), round(14 * unit), round(10 * unit), canvas.FAINT)
        both[:, width:] = image
        yield both


def _static_panel(panel: Panel, timeline: picture.Timeline, caption: str, unit: float) -> Image:
    """Return the parts of a panel that are the same in all frames."""
    height, width = panel_size(round(360 * unit))
    image = picture.background(height, width)
    margin = round(14 * unit)
    canvas.write(image, panel.title, round(11 * unit), margin, round(14 * unit), bold=True)
    canvas.write(image, caption, height - round(19 * unit), margin, round(10 * unit), canvas.FAINT)
    timeline.draw(image)
    image[:, -1] = (222, 221, 218)
    return image


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
    """Write the video of ``panels`` to ``path`` as MP4.

    Parameters
    ----------
    path : the output file.
    panels, caption, fps, height_px : see ``render``.
    longest_s : if the motion is longer, only its first ``longest_s`` seconds are shown and the caption says so.
    sound : audio file; None for a silent video.
    footage : film of the first motion, one picture per motion frame, shown to the left of the panels.
    """
    if longest_s is not None and n_video_frames(panels[0].motion, fps) > longest_s * fps:
        n_frames = round(longest_s * skeleton.frame_rate(panels[0].motion))
        panels = [panel.head(n_frames) for panel in panels]
        caption = f"{caption} · first {longest_s:g} s"
    motion = panels[0].motion
    n_images = n_video_frames(motion, fps)
    film = None if footage is None else Film(footage, skeleton.frame_rate(motion), len(motion))
    images = filmed(render(panels, fps, height_px, caption), film, fps, n_images, height_px, caption)
    encode(path, images, fps, n_images, sound)


class Film(NamedTuple):
    """A film that is shown on the left of a video: its file, frame rate and number of pictures."""

    path: str | Path
    fps: float
    n_pictures: int


def filmed(
    images: Iterator[Image], film: Film | None, fps: float, n_images: int, height_px: int, caption: str
) -> Iterator[Image]:
    """Return ``n_images`` images at ``fps`` with a film on the left, if there is one; see ``with_footage``."""
    if film is None:
        return images
    frames = np.minimum((segments.frame_times(n_images, fps) * film.fps).astype(int), film.n_pictures - 1)
    return with_footage(images, film.path, frames, height_px, caption)


def encode(path: str | Path, images: Iterator[Image], fps: float, n_images: int, sound: str | Path | None) -> None:
    """Write ``n_images`` images (H, W, 3) to ``path`` as MP4, with the beginning of an audio file if one is named."""
    mp4.encode(path, images, fps, mp4.read_sound(sound, n_images / fps) if sound else None)


def n_video_frames(motion: pd.DataFrame, fps: float) -> int:
    """Return the number of frames of a video of a motion at ``fps``."""
    return max(1, round(len(motion) / skeleton.frame_rate(motion) * fps))
