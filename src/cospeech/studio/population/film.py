"""Film a face that says something: the motion of the head, the light of the session, and the moving mouth."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter

from cospeech.data.arrays import Floats, Singles
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.studio import film, paint
from cospeech.studio.population import drawing, speakers
from cospeech.studio.population.face import Face, Mouth, to_ycc
from cospeech.studio.population.speakers import Articulation, Speaker, Utterance

WIDTH, HEIGHT = 320, 240
MIDDLE = (160.0, 122.0)
"""Usual place of the origin of the face in the picture."""
NOISE = 1.5
"""Standard deviation of the sensor noise, of 255."""
SWAYS = 4
"""Number of sinusoids that move the head."""
SLOWEST_HZ, FASTEST_HZ = 0.15, 0.9
TURN_DEG = np.array([2.5, 2.0, 1.5])
"""Standard deviations of the head's pitch, yaw and roll during a clip."""
SHIFT_PX, NEARER = 2.0, 0.008
"""Standard deviations of its shift, and of the logarithm of its size."""
SEAT_PX, SEAT_DEG = 5.0, 2.0
"""Standard deviations of its place and angles between clips."""


def motion(utterance: Utterance, times_s: Floats, seed: int) -> Floats:
    """Return pitch, yaw and roll of the head in radians, shifts x, y in pixels, and the size, (T, 6)."""
    rng = speakers.utterance_rng(utterance, "head", seed)
    scale = np.concatenate([np.deg2rad(TURN_DEG), [SHIFT_PX, SHIFT_PX, NEARER]])
    seat = rng.standard_normal(6) * np.concatenate([np.full(3, np.deg2rad(SEAT_DEG)), [SEAT_PX, SEAT_PX, 0.02]])
    hz = rng.uniform(SLOWEST_HZ, FASTEST_HZ, (SWAYS, 6))
    phase = rng.uniform(0.0, 2 * np.pi, (SWAYS, 6))
    sway = np.sin(2 * np.pi * hz * times_s[:, None, None] + phase).sum(axis=1) * np.sqrt(2.0 / SWAYS)
    moved = seat + scale * sway
    moved[:, 5] = np.exp(moved[:, 5])
    return np.asarray(moved)


def pose(head: Floats) -> Singles:
    """Return a row of ``motion`` as ``drawing.draw`` wants it."""
    pitch, yaw, roll, shift_x, shift_y, size = head
    cx, sx, cy, sy, cz, sz = (f(angle) for angle in (pitch, yaw, roll) for f in (np.cos, np.sin))
    turn = (
        np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
        @ np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
        @ np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    )
    flat = np.linalg.inv(size * turn[:2, :2])
    middle = (MIDDLE[0] + shift_x, MIDDLE[1] + shift_y)
    return np.array([*flat.ravel(), *(size * turn[:2, 2]), *middle], dtype=np.float32)


def light(utterance: Utterance, seed: int) -> Singles:
    """Return the light of a session, and how it differs from clip to clip, as ``drawing.draw`` wants it."""
    own = random_source(seed, "population", "lamp", f"{utterance.session}", utterance.speaker.name)
    now = speakers.utterance_rng(utterance, "lamp", seed)
    gain = float(np.exp(0.03 * own.standard_normal() + 0.005 * now.standard_normal()))
    slopes = 0.03 * own.standard_normal(2) + 0.003 * now.standard_normal(2)
    return np.array([gain, *slopes, 1.0 * own.standard_normal(), *(3.0 * own.standard_normal(2))], dtype=np.float32)


def shape(mouth: Mouth, position: Floats) -> Singles:
    """Return the outlines of a mouth at a position (4,) of the articulators, see ``drawing.mouth``."""
    opening, wide, press, tongue = position
    closed = 1.0 - press
    gap = mouth.gap * opening * closed**1.5
    rounded = max(0.0, -wide)
    half_width = mouth.half_width * (1.0 + 0.14 * wide - 0.10 * rounded - 0.05 * opening)
    thicker = (1.0 - 0.10 * max(0.0, wide) + 0.25 * rounded) * (1.0 - 0.45 * press)
    numbers = [
        min(1.0, gap / 1.5),
        half_width,
        mouth.upper * thicker,
        mouth.lower * thicker,
        mouth.bow * (1.0 - 0.5 * rounded),
        0.18 * gap,
        mouth.teeth,
        mouth.tooth,
        gap * (0.22 + 0.55 * tongue),
        0.82 * gap,
    ]
    return np.array([*numbers, *mouth.lip, *mouth.enamel, *mouth.tongue, mouth.lean], dtype=np.float32)


def room(speaker: Speaker, skin: Floats, session: int, seed: int) -> Singles:
    """Return what is behind the head of a speaker: a wall, a neck of the colour ``skin``, and a shirt, (3, H, W)."""
    rng = random_source(seed, "population", "room", speaker.name, f"{session}")
    x, y = np.meshgrid(np.arange(WIDTH) - MIDDLE[0], np.arange(HEIGHT) - MIDDLE[1])
    wall = np.array([150.0, 156.0, 160.0]) * rng.uniform(0.75, 1.1) + 10.0 * rng.standard_normal(3)
    rgb = wall * (1.0 - 0.12 * (y[..., None] / HEIGHT) + 0.06 * x[..., None] / WIDTH)
    shoulders = 96.0 + 0.0026 * x**2 - y
    shirt = rng.uniform(40.0, 170.0, 3)
    neck = np.minimum(38.0 - np.abs(x), y - 40.0)
    for colour, outline in ((0.72 * skin, neck), (shirt, -shoulders)):
        rgb += np.clip(0.5 + outline, 0.0, 1.0)[..., None] * (colour - rgb)
    return np.ascontiguousarray(np.moveaxis(to_ycc(gaussian_filter(rgb, (1.0, 1.0, 0))), 2, 0), dtype=np.float32)


def frames(
    own: Face, utterance: Utterance, how: Articulation, fps: float, seed: int
) -> Iterator[npt.NDArray[np.uint8]]:
    """Yield the planes Y, Cb, Cr (3, H, W) of a clip, one array that is overwritten in every frame."""
    rng = speakers.utterance_rng(utterance, "grain", seed)
    speckle = film.grain(NOISE, random_source(seed, "population", "grain"))
    times_s = frame_times(int(how.heard.duration_s * fps), fps)
    behind = room(utterance.speaker, own.skin, utterance.session, seed)
    lamp = light(utterance, seed)
    planes = np.empty((3, HEIGHT, WIDTH), dtype=np.uint8)
    for head, position in zip(motion(utterance, times_s, seed), how.lips(times_s), strict=True):
        drawing.draw(
            planes, behind, own.layer, pose(head), shape(own.mouth, position), np.float32(own.mouth.height), lamp,
            speckle, int(rng.integers(len(speckle) - planes.size)), np.float32(paint.STEPS),
        )  # fmt: skip
        yield planes
