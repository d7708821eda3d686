"""MP4 videos from images and sound, with H.264 and AAC.

The same images and sound give the same bytes: there is one encoder thread, and no date or version in the file.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt
import soundfile

from cospeech.data.arrays import Image
from cospeech.errors import UserError
from cospeech.kernels.jit import njit

Samples = npt.NDArray[np.float32]

AAC_RATES_HZ = (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000)
"""Sampling rates that all players support; sound with any other rate is resampled to the highest of them."""

X264 = {
    "preset": "veryfast",  # faster presets leave flecks where a figure has been
    "crf": "31",
    # One thread, so that the bytes do not depend on the number of cores. No AVX-512, with which x264 gave five
    # different files in 200 encodings of the same noise (with AVX2 one). The rest makes the edges of drawings sharp
    # at a low cost: a look-ahead that keeps what does not move, large transforms, few bits for uniform areas, more
    # for colour, and smoothing of what is left around the edges.
    "x264-params": "threads=1:asm=avx2:lookahead-threads=1:keyint=250:scenecut=0:b-adapt=0:mbtree=1:rc-lookahead=20"
    ":bframes=5:8x8dct=1:partitions=i4x4,i8x8,p8x8:aq-strength=0.6:chroma-qp-offset=-6:deblock=2,1",
}
SOUND_BIT_RATE = 48_000
BT709 = 1


def read_sound(path: str | Path, duration_s: float) -> tuple[Samples, int]:
    """Return the sound of a wav file as mono samples (n,) of exactly ``duration_s``, and its rate in Hz.

    Raises
    ------
    UserError : if the file cannot be read.
    """
    try:
        samples, rate = soundfile.read(path, dtype="float32", always_2d=True)
    except (soundfile.LibsndfileError, OSError) as error:
        raise UserError(f"{path}: cannot be read as sound ({error}); delete it and run again") from error
    mono = samples.mean(axis=1)
    if rate not in AAC_RATES_HZ:
        import soxr  # needed for unusual rates only

        mono, rate = soxr.resample(mono, rate, AAC_RATES_HZ[-1]), AAC_RATES_HZ[-1]
    length = round(duration_s * rate)
    return np.pad(mono, (0, max(0, length - len(mono))))[:length], rate


def encode(path: str | Path, images: Iterator[Image], fps: float, sound: tuple[Samples, int] | None = None) -> None:
    """Write an MP4 file (H.264 and AAC) of ``images`` (H, W, 3); they may share one array that changes."""
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
            to_yuv(image, *planes)
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


def encode_sound(samples: Samples, rate: int) -> bytes:
    """Return an MP4 file with sound alone (AAC), of mono samples (n,) at ``rate`` Hz, one of ``AAC_RATES_HZ``."""
    target = io.BytesIO()
    with av.open(target, "w", format="mp4", options={"fflags": "+bitexact"}) as file:
        stream = file.add_stream("aac", rate=rate, bit_rate=SOUND_BIT_RATE, layout="mono")
        file.mux(stream.encode(_sound_frame(np.ascontiguousarray(samples, dtype=np.float32), rate, 0)))
        file.mux(stream.encode(None))
    return target.getvalue()


def _planes(height: int, width: int) -> tuple[Image, tuple[Image, Image, Image]]:
    """Return an array for an image in yuv420p, laid out as the encoder expects it, and views of its three planes."""
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


@njit
def to_yuv(image: Image, light: Image, blueness: Image, redness: Image) -> None:
    """Convert an RGB image (H, W, 3) with even sides to the planes of yuv420p, BT.709 in video range.

    ``light`` (H, W) is luma; ``blueness`` and ``redness`` (H / 2, W / 2) are chroma, means over 2 x 2 pixels.
    """
    height, width = blueness.shape
    every, out = image.reshape(-1), light.reshape(-1)
    for x in range(len(out)):  # 32 bits and flat arrays, so that the loop is vectorised
        red, green, blue = np.int32(every[3 * x]), np.int32(every[3 * x + 1]), np.int32(every[3 * x + 2])
        sum_ = np.int32(11966) * red + np.int32(40254) * green + np.int32(4064) * blue
        out[x] = np.uint8((sum_ + np.int32(1081344)) >> np.int32(16))
    for y in range(height):
        above, below = every[12 * y * width :], every[(12 * y + 6) * width :]
        for x in range(width):
            red = np.int32(above[6 * x]) + np.int32(above[6 * x + 3])
            red += np.int32(below[6 * x]) + np.int32(below[6 * x + 3])
            green = np.int32(above[6 * x + 1]) + np.int32(above[6 * x + 4])
            green += np.int32(below[6 * x + 1]) + np.int32(below[6 * x + 4])
            blue = np.int32(above[6 * x + 2]) + np.int32(above[6 * x + 5])
            blue += np.int32(below[6 * x + 2]) + np.int32(below[6 * x + 5])
            bluer = np.int32(28784) * blue - np.int32(22189) * green - np.int32(6595) * red
            redder = np.int32(28784) * red - np.int32(26145) * green - np.int32(2639) * blue
            blueness[y, x] = np.uint8((bluer + np.int32(33685504)) >> np.int32(18))
            redness[y, x] = np.uint8((redder + np.int32(33685504)) >> np.int32(18))
