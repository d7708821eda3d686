"""Whether the hands beat with the syllables: the beat alignment score of the field, corrected for chance.

A *motion beat* of a wrist is a minimum of its speed within ``ORDER_S`` on either side, at which the wrist still moves
at more than ``LEAST_SPEED`` of its mean speed. The score is the mean over the syllables of exp(-dt^2 / 2 sigma^2),
where dt is the distance of the syllable's peak from the nearest beat (BEAT: Liu et al. 2022, with its order of 7
frames at 30 frames/s, its threshold of 0.1 and its sigma of 0.3 s). Two things differ:

- The onsets of the sound are the peaks of voiced syllables, not those of the spectral flux, so that the score also
  exists for a corpus without sound.
- More beats score higher, whether or not they are in time, and so do beats at regular distances. What the same beats
  score on average over all shifts in time is therefore subtracted.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage, special

from cospeech.data.arrays import Floats

ORDER_S = 7 / 30
LEAST_SPEED = 0.1
SIGMA_S = 0.3


def beats(speed: Floats, fps: float) -> Floats:
    """Return the times of the beats of a wrist in seconds, given its speed (T,)."""
    if len(speed) == 0:
        return np.empty(0)
    order = max(1, round(ORDER_S * fps))
    around = np.ones(2 * order + 1, dtype=bool)
    around[order] = False
    lowest = ndimage.minimum_filter(speed, footprint=around, mode="constant", cval=-1.0)  # none at the ends
    found = (speed < lowest) & (speed > LEAST_SPEED * speed.mean())
    return np.asarray((np.flatnonzero(found) + 0.5) / fps, dtype=np.float64)


def alignment(onsets_s: Floats, beats_s: Floats) -> float:
    """Return the mean over onsets of exp(-dt^2 / 2 sigma^2), 0 without a beat, and NaN without an onset."""
    if len(onsets_s) == 0:
        return math.nan
    if len(beats_s) == 0:
        return 0.0
    after = np.searchsorted(beats_s, onsets_s)
    nearby = np.stack([beats_s[np.maximum(after - 1, 0)], beats_s[np.minimum(after, len(beats_s) - 1)]])
    apart = np.abs(nearby - onsets_s).min(axis=0)
    return float(np.exp(-0.5 * (apart / SIGMA_S) ** 2).mean())


def chance(beats_s: Floats, duration_s: float) -> float:
    """Return the mean ``alignment`` of beats, given in ascending order, over all circular shifts within a record.

    A time then lies anywhere between two beats, with the same density everywhere. With the distances g of successive
    beats, of which the last one leads over the end of the record to the first beat, the mean is

        sum over g of sqrt(2 pi) sigma erf(g / (sqrt(8) sigma)) / duration.
    """
    if len(beats_s) == 0:
        return 0.0
    gaps = np.diff(beats_s, append=beats_s[0] + duration_s)
    covered = math.sqrt(2.0 * math.pi) * SIGMA_S * special.erf(gaps / (math.sqrt(8.0) * SIGMA_S))
    return float(covered.sum() / duration_s)


def score(onsets_s: Floats, speed: Floats, fps: float, low: int, high: int) -> float:
    """Return the mean over both wrists of the alignment beyond chance in the frames ``low`` to ``high``.

    Parameters
    ----------
    onsets_s : times of the onsets in seconds.
    speed : (T, 2) speed of each wrist in all frames, as onsets may belong to beats outside.
    """
    inside = onsets_s[(onsets_s >= low / fps) & (onsets_s < high / fps)]
    if high <= low:
        return math.nan
    duration_s = len(speed) / fps
    found = [beats(one, fps) for one in speed.T]
    return float(np.mean([alignment(inside, one) - chance(one, duration_s) for one in found]))
