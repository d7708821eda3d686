"""Pitch and voicing of speech, tracked by Praat's autocorrelation method (Boersma 1993) in two passes.

The pitch lag and gain of ``prosody`` are those of Özkul 2012, found frame by frame. Here, Praat chooses among the
candidates of all frames the path with the fewest octave jumps and changes of voicing. This is the estimate for
anything that needs pitch in hertz or to know what is voiced: a speaker's mean pitch, and the pitch of syllables.

Details:

- The first pass searches a wide range. The second searches from 0.65 times the first quartile of the pitch found to
  twice its third quartile, which excludes most octave errors. The limits of Hirst 2011, 0.75 and 1.5, are too narrow
  for lively speech: with 0.75, 7 % of the frames of one studio record, its low phrases, became unvoiced.
- A frame is silent, and therefore unvoiced, below a fraction of the level of loud speech. Praat relates it to the
  highest peak of the sound, so that one slap on the microphone silences soft speech; here, it is related to the peak
  that 1 % of the frames exceed.
- Hours of sound are processed in blocks, each with a second of context at either side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
import parselmouth

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.errors import UserError

STEP_S = 0.01
"""Frame period in seconds."""

WIDEST_HZ = (50.0, 600.0)
"""Pitch range of the first pass."""

QUARTILE_FACTORS = (0.65, 2.0)
"""Limits of the second pass, relative to the first and third quartile of the pitch."""

FEWEST_VOICED = 20
"""Number of voiced frames below which quartiles mean nothing, and the range of the first pass is kept."""

SILENCE_THRESHOLD = 0.015
"""Peak below which a frame is silent, relative to the peak of loud speech."""

VOICING_THRESHOLD = 0.45
"""Praat's default for the strength of the unvoiced candidate."""

PERIODS = 3.0
"""Length of Praat's analysis window, in periods of the lowest pitch."""

BLOCK_FRAMES, CONTEXT_FRAMES = 6000, 100
"""Number of frames processed at once, and added at either side of them and discarded."""


class Range(NamedTuple):
    """The lowest and the highest pitch of a speaker, in hertz."""

    floor_hz: float
    ceiling_hz: float


class Track(NamedTuple):
    """The pitch of T frames, (T,) in hertz, NaN where unvoiced; the range in which it was searched."""

    f0_hz: Floats
    searched: Range


def track(samples: Floats, rate_hz: float, searched: Range | None = None) -> Track:
    """Track the pitch of one speaker.

    Parameters
    ----------
    samples : (n,) audio samples, full scale 1.
    rate_hz : sampling rate in Hz.
    searched : pitch range of the speaker, as from ``speaker_range``; by default that of this recording.

    Returns
    -------
    The pitch in frames of ``STEP_S``. Frame k covers the time from k to k + 1 times ``STEP_S``, and its analysis
    window, three periods of the lowest pitch, is centred on the centre of the frame.

    Raises
    ------
    UserError : if the sound is shorter than a frame.
    """
    if len(samples) < STEP_S * rate_hz:
        raise UserError(f"the sound lasts {len(samples) / rate_hz:.3f} s, less than one frame of {STEP_S} s")
    if searched is None:
        searched = speaker_range(_pass(samples, rate_hz, Range(*WIDEST_HZ)))
    return Track(_pass(samples, rate_hz, searched), searched)


def speaker_range(f0_hz: Floats) -> Range:
    """Return the pitch range of a speaker.

    Parameters
    ----------
    f0_hz : pitch of frames in hertz, NaN where unvoiced, from any number of recordings of the speaker.
    """
    voiced = f0_hz[~np.isnan(f0_hz)]
    if len(voiced) < FEWEST_VOICED:
        return Range(*WIDEST_HZ)
    low, high = np.quantile(voiced, [0.25, 0.75]) * QUARTILE_FACTORS
    return Range(max(WIDEST_HZ[0], float(low)), min(WIDEST_HZ[1], float(high)))


def table(found: Track) -> pd.DataFrame:
    """Return a track as a table (schema ``pitch``)."""
    n_frames = len(found.f0_hz)
    return pd.DataFrame(
        {
            "frame": np.arange(n_frames),
            "time_s": segments.frame_times(n_frames, 1 / STEP_S),
            "f0_hz": found.f0_hz,
        }
    )


def statistics(record: str, found: Track) -> pd.DataFrame:
    """Return the mean pitch and the pitch range of a record as a table of one row (schema ``pitch_statistics``)."""
    voiced = found.f0_hz[~np.isnan(found.f0_hz)]
    return pd.DataFrame(
        {
            "record": [record],
            "n_frames": [len(found.f0_hz)],
            "n_voiced": [len(voiced)],
            "f0_mean_hz": [float(voiced.mean()) if len(voiced) else np.nan],
            "floor_hz": [found.searched.floor_hz],
            "ceiling_hz": [found.searched.ceiling_hz],
        }
    )


def _pass(samples: Floats, rate_hz: float, searched: Range) -> Floats:
    """Return the pitch of all frames (T,), searched in one range."""
    n_frames = int(len(samples) / (STEP_S * rate_hz) + 1e-6)
    offset = float(samples.mean())
    loud = _loud_peak(samples, rate_hz, offset)
    parts = []
    for first in range(0, n_frames, BLOCK_FRAMES):
        after = min(first + BLOCK_FRAMES, n_frames)
        begin, end = max(first - CONTEXT_FRAMES, 0), min(after + CONTEXT_FRAMES, n_frames)
        parts.append(_block(samples, rate_hz, searched, offset, loud, begin, end)[first - begin : after - begin])
    return np.concatenate(parts)


def _loud_peak(samples: Floats, rate_hz: float, offset: float) -> float:
    """Return the peak that 1 % of the frames exceed, after the constant ``offset`` is removed."""
    hop = round(STEP_S * rate_hz)
    starts = range(0, len(samples), hop * BLOCK_FRAMES)
    peaks = [
        np.maximum.reduceat(np.abs(piece - offset), range(0, len(piece), hop))
        for piece in (samples[start : start + hop * BLOCK_FRAMES] for start in starts)
    ]
    return float(np.quantile(np.concatenate(peaks), 0.99))


def _block(
    samples: Floats, rate_hz: float, searched: Range, offset: float, loud: float, begin: int, end: int
) -> Floats:
    """Return the pitch of frames [begin, end), which Praat centres in a sound longer by a window."""
    # Praat takes as many frames as fit: a window longer, less a quarter of a frame at either side for rounding.
    margin_s = (PERIODS / searched.floor_hz - STEP_S / 2) / 2
    first, last = round((begin * STEP_S - margin_s) * rate_hz), round((end * STEP_S + margin_s) * rate_hz)
    inside = np.asarray(samples[max(first, 0) : last], dtype=float) - offset
    sound = np.pad(inside, (max(-first, 0), max(last - len(samples), 0)))
    peak = float(np.abs(sound - sound.mean()).max())
    if peak == 0 or loud == 0:
        return np.full(end - begin, np.nan)
    found = parselmouth.Sound(sound, rate_hz).to_pitch_ac(
        time_step=STEP_S,
        pitch_floor=searched.floor_hz,
        pitch_ceiling=searched.ceiling_hz,
        silence_threshold=SILENCE_THRESHOLD * loud / peak,
        voicing_threshold=VOICING_THRESHOLD,
    )
    f0_hz = found.selected_array["frequency"]
    assert len(f0_hz) == end - begin
    return np.where(f0_hz > 0, f0_hz, np.nan)
