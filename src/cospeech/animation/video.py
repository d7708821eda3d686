"""Videos of moving bodies: panels side by side, each a body from two sides, with the record's sound.

The same tables and sound give the same bytes: one encoder thread, and no date or version in the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt
import pandas as pd
import soundfile

from cospeech import segments, skeleton
from cospeech.animation import figure, picture, raster
from cospeech.errors import UserError

Image = npt.NDArray[np.uint8]
Samples = npt.NDArray[np.float32]

AAC_RATES_HZ = (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000)
"""The sampling rates that every player takes; other sound is brought to the highest."""

X264 = {
    "preset": "superfast",
    "crf": "32.5",
    # One thread, so that bytes do not depend on cores. No AVX-512: x264's code for it gives other bytes from one run
    # to the next (five kinds in two hundred films of one noise; with AVX2 one). The rest buys sharp edges cheaply for
    # what is drawn: a short look-ahead that keeps what stands still, large transforms, few bits moved to flat paper,
    # more for colour.
    "x264-params": "threads=1:asm=avx2:lookahead-threads=1:keyint=250:scenecut=0:b-adapt=0:mbtree=1:rc-lookahead=10"
    ":8x8dct=1:partitions=i4x4,i8x8,p8x8:aq-strength=0.6:chroma-qp-offset=-6",
}
SOUND_BIT_RATE = 48_000
BT709 = 1


@dataclass(frozen=True)
class Panel:
    """One column of a video: whose motion it is, the motion table and the gesture phrases that it shows."""

    title: str
    motion: pd.DataFrame
    phrases: pd.DataFrame


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
            picture.lay(part, round(11 * unit), width - margin - shape.shape[1], colours, shape)
            _clock(part, time_s, height - round(19 * unit), width - margin, round(10 * unit))
        yield image


def _sheet(panel: Panel, strip: picture.Strip, caption: str, unit: float) -> Image:
    """Return what stands still in a panel."""
    height, width = panel_size(round(360 * unit))
    sheet = picture.background(height, width)
    margin = round(14 * unit)
    picture.write(sheet, panel.title, round(11 * unit), margin, round(14 * unit), bold=True)
    picture.write(sheet, caption, height - round(19 * unit), margin, round(10 * unit), picture.FAINT)
    strip.draw(sheet)
    sheet[:, -1] = (222, 221, 218)
    return sheet


def _clock(image: Image, time_s: float, top: int, right: int, size: int) -> None:
    """Write the time, ending at column ``right``; every digit takes the same room, so that nothing jitters."""
    left = right - picture.lettering(" s", size).shape[1]
    picture.write(image, " s", top, left, size, picture.FAINT)
    room = picture.lettering("0", size).shape[1]
    for letter in reversed(f"{time_s:.1f}"):
        left -= room if letter.isdigit() else room // 2
        picture.write(image, letter, top, left, size, picture.FAINT)


def film(
    path: str | Path, panels: Sequence[Panel], caption: str, fps: float, height_px: int, sound: str | Path | None
) -> None:
    """Write the video of ``panels`` (see ``pictures``) as MP4 to ``path``, silent where ``sound`` names no file."""
    images = pictures(panels, fps, height_px, caption)
    shown_s = n_pictures(panels[0].motion, fps) / fps
    encode(path, images, fps, read_sound(sound, shown_s) if sound else None)


def n_pictures(motion: pd.DataFrame, fps: float) -> int:
    """Return how many pictures a video of ``fps`` needs to show a motion."""
    return max(1, round(len(motion) / skeleton.frame_rate(motion) * fps))


def read_sound(path: str | Path, duration_s: float) -> tuple[Samples, int]:
    """Return the sound of a wav as mono samples (n,) of exactly ``duration_s``, and its rate in Hz.

    Raises
    ------
    UserError : where the file cannot be read.
    """
    try:
        samples, rate = soundfile.read(path, dtype="float32", always_2d=True)
    except (soundfile.LibsndfileError, OSError) as error:
        raise UserError(f"{path}: cannot be read as sound ({error}); make it anew") from error
    mono = samples.mean(axis=1)
    if rate not in AAC_RATES_HZ:
        import soxr  # needed for unusual rates only

        mono, rate = soxr.resample(mono, rate, AAC_RATES_HZ[-1]), AAC_RATES_HZ[-1]
    length = round(duration_s * rate)
    return np.pad(mono, (0, max(0, length - len(mono))))[:length], rate


def encode(path: str | Path, images: Iterator[Image], fps: float, sound: tuple[Samples, int] | None = None) -> None:
    """Write an MP4 (H.264 and AAC) of ``images`` (H, W, 3), which may be one array that changes, to ``path``."""
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart", "fflags": "+bitexact"}) as film:
        first = next(images)
        rate = Fraction(fps).limit_denominator(1001)
        picture_stream = film.add_stream("libx264", rate=rate, options=X264)
        context = picture_stream.codec_context
        context.height, context.width = first.shape[:2]
        context.pix_fmt = "yuv420p"
        context.thread_count = 1
        context.colorspace = context.color_primaries = context.color_trc = BT709
        sound_stream = (
            film.add_stream("aac", rate=sound[1], bit_rate=SOUND_BIT_RATE, layout="mono") if sound else None
        )
        whole, planes = _planes(*first.shape[:2])
        heard = 0
        for number, image in enumerate(_chain(first, images)):
            raster.to_yuv(image, *planes)
            shown = av.VideoFrame.from_ndarray(whole, format="yuv420p")
            shown.pts = number
            shown.time_base = 1 / rate
            film.mux(picture_stream.encode(shown))
            if sound and sound_stream:
                until = min(len(sound[0]), round((number + 1) / rate * sound[1]))
                film.mux(sound_stream.encode(_sound_frame(sound[0][heard:until], sound[1], heard)))
                heard = until
        film.mux(picture_stream.encode(None))
        if sound_stream:
            film.mux(sound_stream.encode(None))


def _planes(height: int, width: int) -> tuple[Image, tuple[Image, Image, Image]]:
    """Return one array that holds a picture in yuv420p as the encoder takes it, and its three planes."""
    whole = np.empty(height * width * 3 // 2, dtype=np.uint8)
    light, blueness, redness = np.split(whole, [height * width, height * width * 5 // 4])
    small = (height // 2, width // 2)
    planes = light.reshape(height, width), blueness.reshape(small), redness.reshape(small)
    return whole.reshape(height * 3 // 2, width), planes


def _chain(first: Image, rest: Iterator[Image]) -> Iterator[Image]:
    yield first
    yield from rest


def _sound_frame(samples: Samples, rate: int, start: int) -> av.AudioFrame:
    frame = av.AudioFrame.from_ndarray(samples[None, :], format="fltp", layout="mono")
    frame.sample_rate = rate
    frame.pts = start
    frame.time_base = Fraction(1, rate)
    return frame
