"""The sound of a take, and the curves of the voice below it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.formats import mp4, sound
from cospeech.speech import pitch

CURVE_S = 2 * pitch.STEP_S
"""Distance of the values of the curves in seconds."""

QUIET_DB = -70.0
"""Intensities below this level, relative to full scale, are drawn as silence."""


class Voice(NamedTuple):
    """What ``takes.Take`` needs of a sound: the encoded sound, its duration in seconds, and the curves by title."""

    encoded: bytes
    duration_s: float
    curves: dict[str, Floats]


def voice(samples: Floats, f0_hz: Floats | None = None) -> Voice:
    """Return the voice of mono samples (n,) at ``sound.RATE_HZ``.

    ``f0_hz`` is its pitch, one value per ``pitch.STEP_S``, NaN where it is unvoiced; None tracks it.
    """
    tracked = pitch.track(samples, sound.RATE_HZ).f0_hz if f0_hz is None else f0_hz
    curves = {"Pitch (Hz)": tracked[::2], "Intensity (dB)": _intensity_db(samples)}
    return Voice(mp4.encode_sound(samples.astype(np.float32), sound.RATE_HZ), len(samples) / sound.RATE_HZ, curves)


def _intensity_db(samples: Floats) -> Floats:
    """Return the mean power of each ``CURVE_S`` relative to full scale in dB; NaN where it is silent."""
    width = round(CURVE_S * sound.RATE_HZ)
    frames = samples[: len(samples) // width * width].reshape(-1, width)
    level = 10 * np.log10(np.maximum(np.mean(frames**2, axis=1), 1e-12))
    return np.where(level < QUIET_DB, np.nan, level)
