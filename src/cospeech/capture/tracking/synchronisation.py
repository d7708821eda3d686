"""How far the views of a take and the record's sound are out of step, from the sound that all of them carry.

Of each sound the onsets are taken, the rises of its loudness in decibels, which a near microphone and a far one with
much echo hear alike. Two sounds are out of step by the lag at which their onsets correlate best, between two steps by
a parabola. That peak has to stand out from all others, or nothing is concluded.
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

Samples = npt.NDArray[np.float32]

RATE_HZ = 8000
"""Sampling rate at which sounds are compared."""

STEP_S, WINDOW_S, SMOOTH_S = 0.002, 0.01, 0.004
"""Distance of the values of loudness, the time that each is taken over, and the Gaussian that smooths them."""

SILENT = 2 / 32768
"""Peak, full scale 1, up to which a sound is nothing but rounding to 16 bits."""

FLOOR = 1e-4
"""Energy, as a share of the greatest, below which loudness is not told apart: 40 dB."""

OVERLAP = 0.5
"""Least share of the shorter sound that both have to hold."""

APART_S = 0.2
"""A peak nearer than this to the greatest is a part of it."""

STANDS_OUT = 2.0
"""How many times the next greatest correlation the greatest has to be.

Of 60 pairs of stretches of speech that have nothing to do with each other, none came to that in 6 s or 15 s, and two
in 3 s. Of 60 that a near microphone and a far one with echo and noise heard, all came to it in 6 s or 15 s, and 33 in
3 s; they were right to 16 ms, of which 5 are the echo's.
"""

SOUND = "sound"
"""What the table calls the record's own sound."""


class Lag(NamedTuple):
    """How much later one sound began than another, and how many times its correlation is that of any other lag."""

    seconds: float
    prominence: float


def listen(path: str | Path) -> Samples:
    """Return the sound of a film from its first picture on, or of a wav, mono at ``RATE_HZ``; empty where silent."""
    try:
        with av.open(str(path)) as container:
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
        raise UserError(f"{path}: its sound is damaged ({error}); copy or record it again") from error
    samples = np.concatenate([*parts, np.empty(0, dtype=np.float32)])
    if np.abs(samples).max(initial=0.0) <= SILENT:
        return np.empty(0, dtype=np.float32)
    late = round(start_s * RATE_HZ)
    return np.concatenate([np.zeros(max(late, 0), dtype=np.float32), samples[max(-late, 0) :]])


def onsets(samples: Samples) -> Floats:
    """Return the rise of loudness of a sound at every ``STEP_S``, with a mean of 0 and a variance of 1.

    Of no sound it is empty.
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
    """Return how much later the second of two sounds of one scene began than the first, from their ``onsets``."""
    shorter = min(len(a), len(b))
    # Index i of a full correlation holds a shifted by i - len(b) + 1 steps against b.
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


def offsets(films: Sequence[Film], sound: str | Path | None, given_s: Mapping[str, float]) -> pd.DataFrame:
    """Return the table ``offsets`` of a take: when each view, and the record's sound, began, and what each skips.

    Parameters
    ----------
    films : the views, named as their cameras.
    sound : the record's own sound, whose beginning is time 0; else that of the first view that can be heard is.
    given_s : by view, how much later than that it began, where a person says so.

    Raises
    ------
    UserError : where a view cannot be told: its sound fits nothing, or it has none while others have; or where the
        views have no time in common.
    """
    heard = {film.path.stem: onsets(listen(film.path)) for film in films if film.path.stem not in given_s}
    known = {name: rises for name, rises in heard.items() if len(rises)}
    reference = onsets(listen(sound)) if sound else next(iter(known.values()), np.empty(0))
    rows = []
    for film in films:
        name = film.path.stem
        if name in given_s:
            rows.append((name, given_s[name], "given", np.nan))
        elif name in known and len(reference):
            found = lag(reference, known[name])
            if found.prominence < STANDS_OUT:
                raise UserError(
                    f"{film.path}: its sound fits {sound or 'the other views'} nowhere much better than elsewhere "
                    f"({found.prominence:.1f} times, needed {STANDS_OUT}); say in capture.offsets_s how much later "
                    f"view {name} began"
                )
            rows.append((name, found.seconds, "heard", found.prominence))
        elif known:
            raise UserError(
                f"{film.path}: has no sound, while {next(iter(known))} has; say in capture.offsets_s how much later "
                f"view {name} began"
            )
        else:
            rows.append((name, 0.0, "none", np.nan))
    if sound:
        rows.append((SOUND, 0.0, "heard" if len(reference) else "none", np.nan))
    table = pd.DataFrame(rows, columns=["stream", "offset_s", "origin", "prominence"])
    return table.assign(skipped_s=_skipped_s(films, table))


def _skipped_s(films: Sequence[Film], table: pd.DataFrame) -> list[float]:
    """Return what each stream skips so that all begin together: a view whole frames."""
    start_s = table["offset_s"].max()
    skipped = []
    for film, offset_s in zip(films, table["offset_s"], strict=False):
        frames = round((start_s - offset_s) * film.fps)
        if frames >= film.n_frames:
            raise UserError(
                f"{film.path}: is over before the last of the views and the record's sound begins, "
                f"{start_s - offset_s:.2f} s later; are they of one take?"
            )
        skipped.append(frames / film.fps)
    return skipped + [start_s - offset_s for offset_s in table["offset_s"][len(films) :]]
