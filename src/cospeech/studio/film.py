"""The film of one take in one camera: frames as planes Y, Cb, Cr, and their encoding.

The same motion and seed give the same bytes: one encoder thread, and no date or version in the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt

from cospeech.capture.camera import Camera, project
from cospeech.markers import RADIUS_M
from cospeech.studio import paint, stage

Planes = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]

NOISE = 1.5
"""Standard deviation of the sensor's noise, of 255."""
QUALITY = 3
"""Quantiser of the encoder, 2 the finest."""


def outlines(camera: Camera, ends_m: Floats, radii_m: Floats) -> tuple[Floats, Floats]:
    """Return where capsules are seen, as in ``paint.draw``: the pixels of their ends (n, 2, 2) and a reach (n,)."""
    depth = ends_m @ camera.rotation[2] + camera.shift_m[2]
    # A third more than the radius, and three pixels, leave room for the bend of the lens.
    reach = 1.3 * max(camera.focal_px) * radii_m / (depth.min(axis=1) - radii_m) + 3.0
    return project(camera, ends_m), reach


def frames(
    camera: Camera, limbs_m: Floats, markers_m: Floats, seed: int, noise: float = NOISE
) -> Iterator[tuple[Planes, npt.NDArray[np.float64]]]:
    """Yield planes (3, H, W), Y, Cb, Cr in full range, and how many pixels of each marker are seen (15,).

    Parameters
    ----------
    limbs_m, markers_m : (T, n, 2, 3) from ``stage.limbs`` and (T, 15, 3) from ``dress.wear``, metres.
    noise : standard deviation of the sensor's noise, of 255.
    """
    draw = np.random.default_rng([seed, *camera.name.encode()])
    grain = (noise * draw.standard_normal(1 << 20)).astype(np.float32)
    sight, empty = stage.sight(camera), stage.room(camera)
    picture, depth = empty.copy(), np.empty(empty.shape[1:], dtype=np.float32)
    radii = np.concatenate([stage.RADII_M, np.full(markers_m.shape[1], RADIUS_M)])
    for limbs, markers in zip(limbs_m, markers_m, strict=True):
        ends_m = np.concatenate([limbs, np.repeat(markers[:, None], 2, axis=1)])
        solids = paint.solids(ends_m @ camera.rotation.T + np.array(camera.shift_m), radii)
        pixels, reach = outlines(camera, ends_m, radii)
        low, high = pixels.min(axis=1) - reach[:, None], pixels.max(axis=1) + reach[:, None] + 2
        whole = np.concatenate([low.min(axis=0), high.max(axis=0)]).astype(np.int64)
        left, top, right, bottom = whole = np.clip(whole, 0, [*camera.size_px] * 2)
        seen = paint.draw(picture, depth, sight, solids, pixels, reach, stage.PAINT, len(limbs), whole)
        planes = np.empty(picture.shape, dtype=np.uint8)
        paint.expose(picture, planes, grain, whole, int(draw.integers(len(grain))))
        picture[:, top:bottom, left:right] = empty[:, top:bottom, left:right]
        yield planes, seen


def noted(shots: Iterable[tuple[Planes, Floats]], seen: Floats) -> Iterator[Planes]:
    """Yield the planes of ``frames``, and put the pixels of markers that are seen into ``seen`` (T, 15)."""
    for frame, (planes, shown) in enumerate(shots):
        seen[frame] = shown
        yield planes


def encode(path: Path, planes: Iterable[Planes], fps: float) -> None:
    """Write ``planes``, each (3, H, W), as MJPEG 4:4:4 in Matroska."""
    with av.open(str(path), "w", format="matroska", container_options={"fflags": "+bitexact"}) as container:
        stream = container.add_stream("mjpeg", rate=Fraction(fps).limit_denominator(1000))
        stream.codec_context.thread_count = 1
        stream.pix_fmt = "yuvj444p"
        stream.options = {"qmin": str(QUALITY), "qmax": str(QUALITY), "flags": "+bitexact"}
        for frame in planes:
            if not stream.codec_context.is_open:
                stream.height, stream.width = frame.shape[1:]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="yuvj444p")))
        container.mux(stream.encode())


def decode(path: Path) -> Iterator[Planes]:
    """Yield the planes (3, H, W) of a film."""
    with av.open(str(path)) as container:
        for frame in container.decode(video=0):
            yield frame.to_ndarray().astype(np.uint8, copy=False)
