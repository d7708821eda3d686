"""Compiled analysis of a stream of samples; ``syllables`` is its interface and describes the method.

Whatever the chunks in which samples arrive, they are analysed in hops of ``HOP`` samples, and every number is
computed from the same operands in the same order. The result therefore does not depend on the chunks, to the last
bit. Frame f covers hop f. Its windows reach into the ``AHEAD`` hops after it, so it is measured when these are
complete. All that a stream remembers is in one record of fixed size.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

RATE_HZ = 16000
HOP = 80
HOP_S = HOP / RATE_HZ

HIGH_PASS_HZ = 50.0
"""Cutoff frequency of the high-pass filter (second order) that removes offset and rumble."""

GAUSSIAN_S = 0.012
"""Standard deviation of the Gaussian window of the intensity."""

BIN = 16
"""Number of samples whose power is added before it is weighted by the Gaussian."""

N_BINS = 55
"""Length of the Gaussian window in bins; centred on a frame, it ends where a hop does."""

AHEAD = (N_BINS * BIN // HOP - 1) // 2
"""Number of hops after a frame that its windows reach into."""

SMALLEST_POWER = 1.0 / (12 * 32768**2)
"""Power of 16-bit quantisation noise at full scale 1."""

DECIMATION = 4
"""Pitch is found at a quarter of the sampling rate."""

LOW_PASS_HZ, HALF_FILTER = 1500.0, 32
"""Cutoff frequency of the filter before decimation, and half its length in samples."""

PITCH_HZ = (60.0, 500.0)
"""Range of the pitch in hertz."""

WINDOW = 200
"""Length of the window of the autocorrelation at the lower rate: three periods of the lowest pitch."""

TOGETHER = 4
"""Number of samples whose products are added at once."""

LOW_RATE_HZ, LOW_HOP = RATE_HZ // DECIMATION, HOP // DECIMATION
"""The lower rate, and the number of samples of a hop at this rate."""

BETWEEN = 6
"""Number of lags on each side from which a value of the autocorrelation between two lags is interpolated."""

FIRST_LAG, LAST_LAG = int(LOW_RATE_HZ / PITCH_HZ[1]) - BETWEEN, int(LOW_RATE_HZ / PITCH_HZ[0]) + 1 + BETWEEN
"""The lags of the pitch range, and those at each end that interpolation needs."""

NEWER = (HOP * AHEAD + HOP // 2 - HALF_FILTER) // DECIMATION - WINDOW // 2
"""Number of samples at the lower rate that are newer than the window of the frame being measured."""

VOICING_THRESHOLD, OCTAVE_COST = 0.45, 0.01
VOICING_COST, JUMP_COST = 0.14 * 0.01 / HOP_S, 0.35 * 0.01 / HOP_S
"""Praat's defaults; the costs of a change refer to frames of 10 ms."""

CANDIDATES = 5
"""Number of candidates per frame; the first one is unvoiced."""

SILENT_DB = -70.0
ABOVE_NOISE_DB, NOISE_RISE_DB, NOISE_START_DB = 8.0, 2.0 * HOP_S, -50.0
BELOW_LOUD_DB, LOUD_FALL_DB = 30.0, 3.0 * HOP_S
"""A frame is silent below any of three levels: a fixed one, one above the noise, and one below loud speech. The level
that is tracked for noise falls at once and rises by 2 dB per second; that for loud speech rises at once and falls by
3 dB per second."""

LASTING = 3
"""Number of frames after which a voiced, unvoiced or silent stretch has ended, if none of them is of its kind."""

SHORTEST = 8
"""Length of the shortest syllable in frames."""

LONGEST = 200
"""Length at which a syllable is cut, in frames."""

JUMP = 1.2
"""Ratio of the pitch of two successive frames above which the pitch jumps, for example by an octave error."""

DIP_DB = 0.5
"""Least depth of the trough between two syllables, below the peaks on both sides of it."""

APART = 15
"""Least distance of the peaks of two syllables in frames."""

SILENT, UNVOICED, VOICED = 0, 1, 2

FRAME = np.dtype(
    [
        ("db", "f8"),
        ("power", "f8"),
        ("silent", "bool"),
        ("f0_hz", "f8"),
        ("hertz", "f8", (CANDIDATES,)),
        ("origin", "i8", (CANDIDATES,)),
    ]
)
"""A frame: its level and power, whether it is silent, and its pitch on the best path (0: unvoiced); of each
candidate, the pitch, and the candidate of the previous frame from which the best path to it comes."""

ROW = np.dtype(
    [
        ("first", "i8"),
        ("peak", "i8"),
        ("after", "i8"),
        ("known", "i8"),
        ("f0", "f8"),
        ("rise", "f8"),
        ("fall", "f8"),
        ("power", "f8"),
    ]
)
"""A syllable: its first frame, the frame of its peak, the frame after its last one, and the number of complete hops
when it became known; its mean pitch, and the largest rise and fall of the pitch (NaN if unvoiced); its mean power."""

MEMORY = np.dtype(
    [
        ("waiting", "f8", (HOP,)),
        ("n_waiting", "i8"),
        ("hops", "i8"),
        ("filter", "f8", (4,)),
        ("heard", "f8", (2 * HALF_FILTER + HOP,)),
        ("bins", "f8", (N_BINS,)),
        ("low", "f8", (WINDOW + NEWER,)),
        ("score", "f8", (CANDIDATES,)),
        ("noise_db", "f8"),
        ("loud_db", "f8"),
        ("recent", FRAME, (LASTING,)),
        ("kind", "i8"),
        ("first", "i8"),
        ("peak", "i8"),
        ("peak_db", "f8"),
        ("trough", "i8"),
        ("trough_db", "f8"),
        ("risen_db", "f8"),
        ("power", "f8", (LONGEST,)),
        ("f0_hz", "f8", (LONGEST,)),
    ]
)
"""What a stream remembers.

- ``waiting``: the ``n_waiting`` samples that wait for the rest of their hop; ``hops``: the number of complete hops
- ``filter``: the last two samples before and after the high-pass filter; ``heard``: the latest samples after it;
  ``bins``: the power of the latest bins; ``low``: the latest samples at the lower rate
- ``score``: of each candidate of the latest frame, the score of the best path that ends in it
- ``noise_db``, ``loud_db``: levels of noise and of loud speech
- ``recent``: the latest frames
- of the open stretch: ``kind``; ``first`` frame; ``peak`` and the ``trough`` after it, with their levels; the highest
  level since the trough; and ``power`` and ``f0_hz`` of its frames
"""


def memory() -> npt.NDArray[Any]:
    """Return the memory (1,) of a stream of which nothing has been heard."""
    new = np.zeros(1, MEMORY)
    new["noise_db"] = new["loud_db"] = NOISE_START_DB
    new["score"][0, 1:] = -np.inf
    new["recent"]["silent"], new["recent"]["hertz"] = True, 1.0
    return new


def _high_pass() -> tuple[float, float]:
    """Return the two feedback coefficients of a second-order Butterworth filter (bilinear transform)."""
    angle = 2 * np.pi * HIGH_PASS_HZ / RATE_HZ
    alpha = np.sin(angle) / np.sqrt(2.0)
    return float(-2 * np.cos(angle) / (1 + alpha)), float((1 - alpha) / (1 + alpha))


def _gaussian() -> Floats:
    place_s = (np.arange(N_BINS) - N_BINS // 2) * BIN / RATE_HZ
    weights = np.exp(-0.5 * (place_s / GAUSSIAN_S) ** 2)
    return np.asarray(weights / weights.sum() / BIN)


def _low_pass() -> Floats:
    place = np.arange(-HALF_FILTER, HALF_FILTER + 1)
    taps = np.sinc(2.0 * LOW_PASS_HZ / RATE_HZ * place) * np.hamming(len(place))
    return np.asarray(taps / taps.sum())


def _taper() -> tuple[Floats, Floats]:
    """Return the window of the autocorrelation, and its own autocorrelation at the lags (Boersma 1993)."""
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(WINDOW) + 0.5) / WINDOW)
    r = np.correlate(window, window, "full")[WINDOW - 1 :]
    return window, np.asarray(r[FIRST_LAG : LAST_LAG + 1] / r[0])


def _between() -> Floats:
    """Return the weights of lags for the value in their middle: a sinc with a Hann window."""
    place = np.arange(BETWEEN) + 0.5
    weights = np.sinc(place) * (0.5 + 0.5 * np.cos(np.pi * place / (BETWEEN + 0.5)))
    return np.asarray(weights / (2 * weights.sum()))


A1, A2 = _high_pass()
GAIN = (1.0 - A1 + A2) / 4.0
GAUSSIAN, LOW_PASS = _gaussian(), _low_pass()
TAPER, TAPER_R = _taper()
MIDDLE = _between()


@njit
def _shift(values: Any, n: int) -> None:
    """Discard the first ``n`` values and move the others to the front."""
    for i in range(len(values) - n):
        values[i] = values[i + n]


@njit
def _hear(memory: Any) -> None:
    """Filter a hop, and add the power of its bins. Samples that are not finite count as zero."""
    heard, bins = memory.heard, memory.bins
    _shift(heard, HOP)
    _shift(bins, HOP // BIN)
    x1, x2, y1, y2 = memory.filter
    for b in range(HOP // BIN):
        power = 0.0
        for i in range(b * BIN, (b + 1) * BIN):
            x = memory.waiting[i]
            x = min(max(x, -1.0), 1.0) if np.isfinite(x) else 0.0
            y = GAIN * (x - 2.0 * x1 + x2) - A2 * y2 - A1 * y1  # y1 last: it is known last
            if abs(y) < 1e-12:  # the filter would otherwise decay to denormal numbers, which are slow
                y = 0.0
            x2, x1, y2, y1 = x1, x, y1, y
            heard[2 * HALF_FILTER + i] = y
            power += y * y
        bins[N_BINS - HOP // BIN + b] = power
    memory.filter[0], memory.filter[1], memory.filter[2], memory.filter[3] = x1, x2, y1, y2


@njit
def _decimate(memory: Any) -> None:
    """Add a hop to the samples at the lower rate."""
    low, heard = memory.low, memory.heard
    _shift(low, LOW_HOP)
    for i in range(LOW_HOP):
        first, last = DECIMATION * i, DECIMATION * i + 2 * HALF_FILTER
        total = LOW_PASS[HALF_FILTER] * heard[first + HALF_FILTER]
        for k in range(HALF_FILTER):
            total += LOW_PASS[k] * (heard[first + k] + heard[last - k])
        low[len(low) - LOW_HOP + i] = total


@njit
def _autocorrelation(low: Any, r: Any) -> None:
    """Compute the autocorrelation of the oldest window, divided by that of its taper (Boersma 1993, eq. 9)."""
    mean, energy = 0.0, 0.0
    for i in range(WINDOW):
        mean += low[i]
    mean /= WINDOW
    tapered = np.zeros(WINDOW + TOGETHER)
    for i in range(WINDOW):
        tapered[i] = TAPER[i] * (low[i] - mean)
        energy += tapered[i] * tapered[i]
    r[:] = 0.0
    if energy > SMALLEST_POWER * WINDOW:
        # The loop over the lags is inside and adds the products of several samples, so that it can be vectorised.
        for i in range(0, WINDOW, TOGETHER):
            a, b, c, d = tapered[i], tapered[i + 1], tapered[i + 2], tapered[i + 3]
            later = tapered[i + FIRST_LAG :]
            for k in range(min(len(r), len(later) - TOGETHER)):  # beyond the window, all products are zero
                r[k] += a * later[k] + b * later[k + 1] + c * later[k + 2] + d * later[k + 3]
        for k in range(len(r)):
            r[k] /= energy * TAPER_R[k]


@njit
def _candidates(low: Any, strength: Any, hertz: Any) -> None:
    """Find the strongest peaks of the autocorrelation; unused candidates have a strength of minus infinity."""
    r = np.empty(LAST_LAG - FIRST_LAG + 1)
    _autocorrelation(low, r)
    hertz[:] = 1.0
    strength[0], strength[1:] = VOICING_THRESHOLD, -np.inf
    # At lags and in the middle between them: parabolas through lags alone are too low by more than an octave costs.
    fine = np.empty(2 * (len(r) - 2 * BETWEEN))
    for k in range(len(fine) // 2):
        fine[2 * k], fine[2 * k + 1] = r[k + BETWEEN], 0.0
    for j in range(BETWEEN):
        for k in range(len(fine) // 2):
            fine[2 * k + 1] += MIDDLE[j] * (r[k + BETWEEN - j] + r[k + BETWEEN + 1 + j])
    for k in range(1, len(fine) - 1):
        before, top, after = fine[k - 1], fine[k], fine[k + 1]
        if top > 0.5 * VOICING_THRESHOLD and top > before and top >= after:
            shift = 0.5 * (before - after) / (before - 2.0 * top + after)
            pitch = LOW_RATE_HZ / (FIRST_LAG + BETWEEN + 0.5 * (k + shift))
            height = min(top - 0.25 * (before - after) * shift, 1.0) + OCTAVE_COST * np.log2(pitch / PITCH_HZ[0])
            weakest = 1 + np.argmin(strength[1:])
            if height > strength[weakest]:
                strength[weakest], hertz[weakest] = height, pitch


@njit
def _track(memory: Any) -> None:
    """Extend the paths of the pitch by a frame, and set the pitch of the recent frames to that of the best path.

    This is the search of Praat, which looks ahead only as far as the recent frames do.
    """
    frame, before = memory.recent[LASTING - 1], memory.recent[LASTING - 2]
    strength, score = np.empty(CANDIDATES), np.full(CANDIDATES, -np.inf)
    _candidates(memory.low, strength, frame.hertz)
    for k in range(CANDIDATES):
        for j in range(CANDIDATES):
            cost = VOICING_COST if (j == 0) != (k == 0) else 0.0
            if j > 0 and k > 0:
                cost = JUMP_COST * abs(np.log2(frame.hertz[k] / before.hertz[j]))
            reached = memory.score[j] - cost + strength[k]
            if reached > score[k]:
                score[k], frame.origin[k] = reached, j
    best = np.argmax(score)
    for k in range(CANDIDATES):
        memory.score[k] = score[k] - score[best]
    for i in range(LASTING - 1, -1, -1):
        memory.recent[i].f0_hz = memory.recent[i].hertz[best] if best > 0 else 0.0
        best = memory.recent[i].origin[best]


@njit
def _measure(memory: Any) -> None:
    """Measure the frame that is now covered by the windows, and append it to the recent ones."""
    recent = memory.recent
    for i in range(LASTING - 1):
        recent[i] = recent[i + 1]
    frame = recent[LASTING - 1]
    power = 0.0
    for b in range(N_BINS):
        power += GAUSSIAN[b] * memory.bins[b]
    frame.power = max(power, SMALLEST_POWER)
    frame.db = 10.0 * np.log10(frame.power)
    memory.noise_db = min(memory.noise_db + NOISE_RISE_DB, frame.db)
    memory.loud_db = max(memory.loud_db - LOUD_FALL_DB, frame.db)
    frame.silent = frame.db < max(SILENT_DB, memory.noise_db + ABOVE_NOISE_DB, memory.loud_db - BELOW_LOUD_DB)
    _track(memory)


@njit
def _kind(frame: Any) -> int:
    if frame.silent:
        return SILENT
    return VOICED if frame.f0_hz > 0.0 else UNVOICED


@njit
def _write(row: Any, memory: Any, after: int) -> None:
    """Write the open stretch up to the frame ``after`` as a syllable."""
    row.first, row.peak, row.after, row.known = memory.first, memory.peak, after, memory.hops
    n = after - memory.first
    total = 0.0
    for i in range(n):
        total += memory.power[i]
    row.power = total / n
    row.f0 = row.rise = row.fall = np.nan
    if memory.kind == VOICED:
        _summarise(memory.f0_hz[:n], row)


@njit
def _summarise(f0_hz: Any, row: Any) -> None:
    """Write the mean, the largest rise and the largest fall of the longest stretch of pitch without a jump."""
    longest = n = 0
    total = low = high = rise = fall = before = 0.0
    for hertz in f0_hz:
        if hertz == 0.0 or before == 0.0 or max(hertz, before) > JUMP * min(hertz, before):
            n, total, low, high, rise, fall = 0, 0.0, hertz, hertz, 0.0, 0.0
        before = hertz
        if hertz > 0.0:
            n += 1
            total += hertz
            low, high = min(low, hertz), max(high, hertz)
            rise, fall = max(rise, hertz - low), max(fall, high - hertz)
            if n > longest:
                longest, row.f0, row.rise, row.fall = n, total / n, rise, fall


@njit
def _begin(memory: Any, first: int, number: int) -> None:
    """Make ``first`` the first frame of the open stretch, of which the frames before ``number`` are known."""
    gone = first - memory.first
    for i in range(number - first):
        memory.power[i], memory.f0_hz[i] = memory.power[i + gone], memory.f0_hz[i + gone]
    memory.first = first


@njit
def _set_peak(memory: Any, number: int, db: float) -> None:
    memory.peak = memory.trough = number
    memory.peak_db = memory.trough_db = memory.risen_db = db


@njit
def _change(memory: Any, number: int, kind: int, db: float, rows: Any, n: int) -> int:
    """End the open stretch before a frame, and open one of another kind, which one that is too short joins."""
    whole = number - memory.first >= SHORTEST
    if memory.kind != SILENT and whole:
        _write(rows[n], memory, number)
        n += 1
    if memory.kind == SILENT or kind == SILENT or whole:
        memory.first = number
    memory.kind = kind
    _set_peak(memory, number, db)
    return n


@njit
def _segment(memory: Any, number: int, rows: Any, n: int) -> int:
    """Assign the oldest of the recent frames to a syllable, and return the number of rows written."""
    frame = memory.recent[0]
    db, end = frame.db, memory.trough + 1
    changes = True
    for recent in memory.recent:
        changes &= _kind(recent) != memory.kind
    if changes:
        n = _change(memory, number, _kind(frame), db, rows, n)
    elif memory.kind == SILENT:
        return n
    elif (
        min(memory.peak_db, db) >= memory.trough_db + DIP_DB
        and db >= memory.risen_db
        and number >= memory.peak + APART
        and end >= memory.first + SHORTEST
    ):
        _write(rows[n], memory, end)
        n += 1
        _begin(memory, end, number)
        _set_peak(memory, number, db)
    elif number == memory.first + LONGEST:
        n = _change(memory, number, memory.kind, db, rows, n)
    elif db > memory.peak_db:
        _set_peak(memory, number, db)
    elif db < memory.trough_db:
        memory.trough = number
        memory.trough_db = memory.risen_db = db
    memory.risen_db = max(memory.risen_db, db)
    memory.power[number - memory.first], memory.f0_hz[number - memory.first] = frame.power, frame.f0_hz
    return n


@njit
def take(sample: float, memory: Any) -> bool:
    """Add a sample, and return whether it completes a hop, which is then analysed."""
    memory.waiting[memory.n_waiting] = sample
    memory.n_waiting += 1
    if memory.n_waiting < HOP:
        return False
    memory.n_waiting = 0
    memory.hops += 1
    _hear(memory)
    _decimate(memory)
    if memory.hops > AHEAD:
        _measure(memory)
    return True


@njit
def push(samples: Any, memories: Any, rows: Any) -> int:
    """Analyse samples (n,), and return how many syllables became known, which are in ``rows`` (>= 1 + n // HOP,)."""
    memory = memories[0]
    n = 0
    for sample in samples:
        if take(sample, memory) and memory.hops >= AHEAD + LASTING:
            n = _segment(memory, memory.hops - AHEAD - LASTING, rows, n)
    return n


@njit
def close(memories: Any, number: int, rows: Any) -> int:
    """End the stream before a frame, and return the number of rows written, 0 or 1."""
    return _change(memories[0], number, SILENT, 0.0, rows, 0)
