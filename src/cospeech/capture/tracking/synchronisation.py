"""Synchronisation of the views of a take with each other and with the record's sound, by their audio tracks.

Each sound is reduced to an onset envelope, the rise of its level in decibels, which is similar for a close microphone
and for a distant one with reverberation. The offset between two sounds is the lag with the highest cross-correlation
of their onset envelopes, refined by parabolic interpolation. It is accepted only if this peak stands out from all
others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import av
import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.signal import correlate

from cospeech.capture.tracking.footage import Film
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.films import opened

Samples = npt.NDArray[np.float32]

RATE_HZ = 8000
"""Sampling rate for the comparison."""

STEP_S, WINDOW_S, SMOOTH_S = 0.002, 0.01, 0.004
"""Hop and window of the level, and the standard deviation of the Gaussian that smooths it."""

SILENT = 2 / 32768
"""Peak amplitude (full scale 1) up to which a sound is silent but for 16-bit rounding."""

FLOOR = 1e-4
"""Energy floor relative to the maximum, 40 dB below it."""

OVERLAP = 0.5
"""Minimum overlap of two sounds, as a fraction of the shorter one."""

APART_S = 0.2
"""Half-width of the main peak; only peaks farther away compete with it."""

STANDS_OUT = 2.0
"""Minimum ratio of the highest correlation to the next highest.

Of 60 pairs of unrelated stretches of speech, none reached this ratio with 6 s or 15 s of sound, and two with 3 s. Of
60 pairs from a close microphone and a distant one with reverberation and noise, all reached it with 6 s or 15 s, and
33 with 3 s; their offsets were within 16 ms, 5 ms of which are due to the reverberation.
"""

SOUND = "sound"
"""Name of the record's own sound in the table."""


class Lag(NamedTuple):
    """How much later one sound began than another, and the ratio of its correlation peak to the next highest."""

    seconds: float
    prominence: float


def read_sound(path: str | Path) -> Samples:
    """Return the sound of a film from its first frame, or of an audio file; mono at ``RATE_HZ``, empty if silent."""
    try:
        with opened(path) as container:
            if not container.streams.audio:
                return np.empty(0, dtype=np.float32)
            resampler = av.AudioResampler(format="flt", layout="mono", rate=RATE_HZ)
            start_s = 0.0
            parts: list[npt.NDArray[Any]] = []
            for frame in container.decode(audio=0):
                start_s = start_s if parts else frame.time or 0.0
                parts += [part.to_ndarray().ravel() for part in resampler.resample(frame)]
            parts += [part.to_ndarray().ravel() for part in resampler.resample(None)]
            for picture in container.streams.video:
                start_s -= float((picture.start_time or 0) * (picture.time_base or 0))
    except av.FFmpegError as error:
        raise UserError(f"{path}: the sound cannot be decoded ({error}); convert it with ffmpeg") from error
    samples = np.concatenate([*parts, np.empty(0, dtype=np.float32)])
    if np.abs(samples).max(initial=0.0) <= SILENT:
        return np.empty(0, dtype=np.float32)
    late = round(start_s * RATE_HZ)
    return np.concatenate([np.zeros(max(late, 0), dtype=np.float32), samples[max(-late, 0) :]])


def onsets(samples: Samples) -> Floats:
    """Return the onset envelope of a sound with hop ``STEP_S``, normalised to mean 0 and variance 1.

    It is empty if there is no sound.
    """
    step = round(STEP_S * RATE_HZ)
    energy = np.square(samples[: len(samples) // step * step]).reshape(-1, step).mean(axis=1, dtype=float)
    if not len(energy):
        return energy
    energy = uniform_filter1d(energy, round(WINDOW_S / STEP_S), mode="nearest")
    level = gaussian_filter1d(np.log(energy + FLOOR * energy.max()), SMOOTH_S / STEP_S)
    rise = np.maximum(np.diff(level, prepend=level[0]), 0.0)
    return np.asarray((rise - rise.mean()) / max(rise.std(), 1e-12))


def lag(a: Floats, b: Floats) -> Lag:
    """Return how much later sound ``b`` began than sound ``a`` of the same scene, given their onset envelopes."""
    shorter = min(len(a), len(b))
    # Index i of the full correlation corresponds to a lag of i - len(b) + 1 steps.
    energies = correlate(a**2, np.ones(len(b))) * correlate(np.ones(len(a)), b**2)
    n_shared = np.round(correlate(np.ones(len(a)), np.ones(len(b))))
    likeness = correlate(a, b) / np.sqrt(np.maximum(energies, 1e-12))
    likeness[n_shared < OVERLAP * shorter] = 0.0
    best = int(np.argmax(likeness))
    elsewhere = np.abs(np.arange(len(likeness)) - best) > APART_S / STEP_S
    before, peak, after = likeness[[max(best - 1, 0), best, min(best + 1, len(likeness) - 1)]]
    bend = before - 2.0 * peak + after
    between = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return Lag((best + between - len(b) + 1) * STEP_S, peak / max(likeness[elsewhere].max(initial=0.0), 1e-12))


def offsets(films: Sequence[Film], sound: str | Path | None, manual_s: Mapping[str, float]) -> pd.DataFrame:
    """Return the table ``offsets`` of a take: when each view and the record's sound began, and how much each skips.

    Parameters
    ----------
    films : the views, named after their cameras.
    sound : the record's own sound, whose start is time 0; without it, time 0 is the start of the first view with
        sound.
    manual_s : offsets set by a person: how much later than time 0 a view began, by view.

    Raises
    ------
    UserError : if the offset of a view cannot be determined, because its sound matches nothing or it has no sound
        while others do; or if the views do not overlap in time.
    """
    envelopes = {film.path.stem: onsets(read_sound(film.path)) for film in films if film.path.stem not in manual_s}
    audible = {name: rises for name, rises in envelopes.items() if len(rises)}
    reference = onsets(read_sound(sound)) if sound else next(iter(audible.values()), np.empty(0))
    rows = []
    for film in films:
        name = film.path.stem
        if name in manual_s:
            rows.append((name, manual_s[name], "given", np.nan))
        elif name in audible and len(reference):
            found = lag(reference, audible[name])
            if found.prominence < STANDS_OUT:
                raise UserError(
                    f"{film.path}: the sound matches {sound or 'the other views'} at no clear offset (peak ratio "
                    f"{found.prominence:.1f}, at least {STANDS_OUT} is needed); set in capture.offsets_s how much "
                    f"later view {name} began"
                )
            rows.append((name, found.seconds, "heard", found.prominence))
        elif audible:
            raise UserError(
                f"{film.path}: the film has no sound, but {next(iter(audible))} has; set in capture.offsets_s how "
                f"much later view {name} began"
            )
        else:
            rows.append((name, 0.0, "none", np.nan))
    if sound:
        rows.append((SOUND, 0.0, "heard" if len(reference) else "none", np.nan))
    table = pd.DataFrame(rows, columns=["stream", "offset_s", "origin", "prominence"])
    return table.assign(skipped_s=_skipped_s(films, table))


def _skipped_s(films: Sequence[Film], table: pd.DataFrame) -> list[float]:
    """Return how much each stream must skip so that all start together; views skip whole frames."""
    start_s = table["offset_s"].max()
    skipped = []
    for film, offset_s in zip(films, table["offset_s"], strict=False):
        frames = round((start_s - offset_s) * film.fps)
        if frames >= film.n_frames:
            raise UserError(
                f"{film.path}: the film ends before the last stream of the take starts, {start_s - offset_s:.2f} s "
                "later; check that all views and the sound belong to the same take"
            )
        skipped.append(frames / film.fps)
    return skipped + [start_s - offset_s for offset_s in table["offset_s"][len(films) :]]
