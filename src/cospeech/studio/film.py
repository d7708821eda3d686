"""Rendering of one take in one camera as planes Y, Cb, Cr, and video encoding.

The same motion and seed give the same bytes: the encoder uses one thread and writes no date or version to the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera, project
from cospeech.motion.markers import RADIUS_M
from cospeech.studio import paint, stage

Planes = npt.NDArray[np.uint8]

NOISE = 1.5
"""Standard deviation of the sensor noise on a scale of 255."""
PIXELS = "yuvj444p"
"""Full-range Y, Cb, Cr without chroma subsampling."""
QUALITY = 3
"""Quantiser of the encoder; 2 is the finest."""
BATCH = 64
"""Number of frames whose outlines are computed at once, to bound memory."""


def outlines(camera: Camera, ends_m: Floats, radii_m: Floats) -> tuple[Floats, Floats]:
    """Return the outlines of capsules for ``paint.draw``: pixels of their ends (..., n, 2, 2) and reach (..., n)."""
    depth = ends_m @ camera.rotation[2] + camera.shift_m[2]
    # The margin of 5 % and two pixels allows for lens distortion and partly covered pixels.
    reach = 1.05 * max(camera.focal_px) * radii_m / (depth.min(axis=-1) - radii_m) + 2.0
    return project(camera, ends_m), reach


def grain(noise: float, rng: np.random.Generator) -> npt.NDArray[np.int8]:
    """Return a table of sensor noise in steps of 1 / ``paint.STEPS``; ``noise`` is its standard deviation, of 255."""
    steps = np.rint(paint.STEPS * noise * rng.standard_normal(1 << 20, dtype=np.float32))
    return np.clip(steps, -127, 127).astype(np.int8)


def frames(
    camera: Camera, limbs_m: Floats, markers_m: Floats, seed: int, noise: float = NOISE
) -> Iterator[tuple[Planes, npt.NDArray[np.float64]]]:
    """Yield full-range planes Y, Cb, Cr (3, H, W), and the number of visible pixels of each marker (15,).

    The planes are one array that is overwritten in every frame.

    Parameters
    ----------
    limbs_m, markers_m : (T, n, 2, 3) from ``stage.limbs`` and (T, 15, 3) from ``dress.wear``, metres.
    noise : standard deviation of the sensor noise on a scale of 255.
    """
    rng = np.random.default_rng([seed, *camera.name.encode()])
    speckle = grain(noise, rng)
    slopes = stage.ray_slopes(camera)
    room = stage.room(camera, slopes)
    empty = np.rint(paint.STEPS * room).astype(np.int16)
    picture, depth = np.empty_like(room), np.empty_like(room[0])
    planes = np.empty(room.shape, dtype=np.uint8)
    radii = np.concatenate([stage.RADII_M, np.full(markers_m.shape[1], RADIUS_M)])
    for start in range(0, len(limbs_m), BATCH):
        limbs, markers = limbs_m[start : start + BATCH], markers_m[start : start + BATCH]
        ends_m = np.concatenate([limbs, np.repeat(markers[:, :, None], 2, axis=2)], axis=1)
        solids = paint.solids(ends_m @ camera.rotation.T + np.array(camera.shift_m), radii)
        pixels, reach = outlines(camera, ends_m, radii)
        boxes = _boxes(camera, pixels, reach)
        for solid, ends, far, box in zip(solids, pixels, reach, boxes, strict=True):
            at = int(rng.integers(len(speckle)))
            seen = paint.draw(picture, depth, room, slopes, solid, ends, far, stage.PAINT, limbs.shape[1], box)
            paint.add_grain(empty, speckle, at, planes)
            paint.expose(picture, speckle, at, box, planes)
            yield planes, seen


def _boxes(camera: Camera, pixels: Floats, reach: Floats) -> npt.NDArray[np.int64]:
    """Return the box (T, 4) that solids may cover in each frame: left, top, right, bottom, the last two exclusive."""
    far = reach[:, :, None, None]
    low, high = (pixels - far).min(axis=(1, 2)), (pixels + far).max(axis=(1, 2)) + 2.0
    return np.clip(np.concatenate([low, high], axis=1), 0, [*camera.size_px] * 2).astype(np.int64)


def record_visibility(shots: Iterable[tuple[Planes, Floats]], seen: Floats) -> Iterator[Planes]:
    """Yield the planes of ``frames``, and write the numbers of visible pixels of the markers to ``seen`` (T, 15)."""
    for frame, (planes, shown) in enumerate(shots):
        seen[frame] = shown
        yield planes


class Reel:
    """A film that is written frame by frame, as MJPEG 4:4:4 in Matroska, and completed at the end of its context."""

    def __init__(self, path: Path, fps: float) -> None:
        self._rate = Fraction(fps).limit_denominator(1000)
        self._container = av.open(str(path), "w", format="matroska", container_options={"fflags": "+bitexact"})
        self._stream = self._container.add_stream("mjpeg", rate=self._rate)
        self._stream.codec_context.thread_count = 1
        self._stream.pix_fmt = PIXELS
        self._stream.options = {"qmin": str(QUALITY), "qmax": str(QUALITY), "flags": "+bitexact"}
        self._shown: av.VideoFrame | None = None
        self._number = 0

    def __enter__(self) -> Reel:
        return self

    def __exit__(self, *error: object) -> None:
        if error[0] is None:
            self._container.mux(self._stream.encode())
        self._container.close()

    def add(self, planes: Planes) -> None:
        """Append one frame, (3, H, W)."""
        if self._shown is None:  # reused, because allocating each frame costs a third as much as encoding it
            self._stream.height, self._stream.width = planes.shape[1:]
            self._shown = av.VideoFrame(self._stream.width, self._stream.height, PIXELS)
        for plane, values in zip(self._shown.planes, planes, strict=True):
            rows = np.frombuffer(memoryview(plane), dtype=np.uint8).reshape(-1, plane.line_size)
            rows[:, : plane.width] = values
        self._shown.pts, self._shown.time_base = self._number, 1 / self._rate
        self._number += 1
        self._container.mux(self._stream.encode(self._shown))


def encode(path: Path, planes: Iterable[Planes], fps: float) -> None:
    """Write ``planes``, each (3, H, W) and possibly one array that is overwritten, as the film ``path``."""
    with Reel(path, fps) as reel:
        for frame in planes:
            reel.add(frame)


def decode(path: Path) -> Iterator[Planes]:
    """Yield the planes (3, H, W) of a film."""
    with av.open(str(path)) as container:
        for frame in container.decode(video=0):
            yield frame.to_ndarray().astype(np.uint8, copy=False)
