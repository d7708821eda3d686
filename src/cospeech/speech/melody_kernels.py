"""Compiled analysis of the melody of a stream; ``melody_stream`` is its interface and describes the method.

Pitch is that of the syllables (see ``syllables_kernels``), at half their rate. Every number is computed from the same
operands in the same order, whatever the chunks in which samples arrive.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit
from cospeech.speech import melody, pitch, syllables_kernels
from cospeech.speech.syllables_kernels import AHEAD, HOP, LASTING, RATE_HZ, take

PER_FRAME = round(melody.STEP_S / syllables_kernels.HOP_S)
"""Number of hops of a frame: 2."""

STEP, WIDTH = PER_FRAME * HOP, round(melody.WINDOW_S * RATE_HZ)
"""Number of samples of a frame, and of the window of the intensity."""

KAISER = np.kaiser(WIDTH, melody.KAISER_BETA) / np.kaiser(WIDTH, melody.KAISER_BETA).sum()
LEAST_POWER = 10.0 ** (melody.FLOOR_DB / 10.0)

KEPT = (AHEAD + LASTING + 1) * HOP - STEP // 2 + WIDTH // 2
"""Number of samples from the start of the window of a frame until the pitch of the frame is known."""

LONGEST_GAP, SHORTEST = round(melody.LONGEST_GAP_S / melody.STEP_S), round(melody.SHORTEST_S / melody.STEP_S)

DECIDED = LONGEST_GAP + SHORTEST - 1
"""Number of later frames that can decide whether a frame belongs to an utterance."""

HANN = np.hanning(round(melody.SMOOTHED_S / melody.STEP_S) + 2)[1:-1]
HALF, REGRESSION = len(HANN) // 2, 2

LATER = DECIDED + HALF + REGRESSION
"""Number of later frames that the melody of a frame depends on."""

RING = 64
"""Number of frames that are remembered, more than ``LATER`` and those before a frame that it depends on."""

FORGETTING_S = 60.0
FORGET = float(np.exp(-melody.STEP_S / FORGETTING_S))
"""Weight that an utterance loses in each frame of later utterances."""

TYPICAL_PITCH, TYPICAL_DB, TYPICAL_FRAMES = 0.18, 7.0, 100.0
"""Standard deviations in utterances, of the pitch as a share of its mean and of the intensity, that count like so
many frames: the medians of six recordings of people. Without them, the first words would be divided by nearly 0."""

LOWEST, HIGHEST = pitch.QUARTILE_FACTORS
"""Limits of the pitch relative to its mean."""

OPEN = np.iinfo(np.int64).max

MEMORY = np.dtype(
    [
        ("heard", "f8", (KEPT,)),
        ("voiced_before", "f8"),
        ("n", "i8"),
        ("end", "i8"),
        ("f0_hz", "f8", (RING,)),
        ("db", "f8", (RING,)),
        ("noise", "f8", (RING, 2)),
        ("voiced", "f8"),
        ("voice_hz", "f8"),
        ("first", "i8"),
        ("last", "i8"),
        ("active", "i8", (RING,)),
        ("filled_hz", "f8", (RING,)),
        ("pitch", "f8", (RING,)),
        ("loudness", "f8", (RING,)),
        ("weight", "f8"),
        ("mean", "f8", (2,)),
        ("squares", "f8", (2,)),
    ]
)
"""What a stream remembers, besides that of the syllables.

- ``heard``: the latest samples; ``voiced_before``: the pitch of the latest hop
- ``n``: the number of frames measured; ``end``: the number of frames of the stream, once it is known
- of the latest frames, in rings: ``f0_hz`` (0: unvoiced), ``db`` and ``noise``; whether they are ``active``, and the
  pitch with its gaps filled; ``pitch`` and ``loudness`` as systems hear them
- ``voiced`` and ``voice_hz``: the weight of all voiced frames so far, and the weighted mean of their pitch
- ``first`` and ``last``: the first and the latest voiced frame of the latest stretch, or -1
- ``weight``, ``mean`` and ``squares``: the weight of all active frames so far, and the weighted means and sums of
  squared deviations of their pitch and intensity
"""


def memory() -> npt.NDArray[Any]:
    """Return the memory (1,) of a stream of which nothing has been heard."""
    new = np.zeros(1, MEMORY)
    new["end"], new["first"], new["last"] = OPEN, -1, -1
    return new


@njit
def _decibels(heard: Floats) -> float:
    """Return the intensity in the oldest window (see ``melody.intensity``)."""
    power = 0.0
    for i in range(WIDTH):
        power += KAISER[i] * (heard[i] * heard[i])
    return 10.0 * np.log10(max(power, LEAST_POWER))


@njit
def _following(memory: Any, t: int) -> int:
    """Return the first voiced frame after a frame that belongs to its stretch, or -1."""
    for later in range(t + 1, min(t + LONGEST_GAP + 1, memory.n - 1) + 1):
        if memory.f0_hz[later % RING] > 0.0:
            return later
    return -1


@njit
def _decide(memory: Any, t: int) -> None:
    """Decide whether a frame belongs to an utterance (see ``melody.utterances``), and fill its pitch."""
    here, f0_hz = t % RING, memory.f0_hz
    memory.active[here], memory.filled_hz[here] = 0, 0.0
    if f0_hz[here] > 0.0:
        if memory.last < 0 or t - memory.last - 1 > LONGEST_GAP:
            memory.first = t
        memory.last = t
        memory.filled_hz[here] = f0_hz[here]
    elif memory.last < 0:
        return
    else:
        after = _following(memory, memory.last)
        if after < t:  # the stretch has ended
            return
        share = (t - memory.last) / (after - memory.last)
        before_hz = f0_hz[memory.last % RING]
        memory.filled_hz[here] = before_hz + share * (f0_hz[after % RING] - before_hz)
    end = memory.last
    while end >= 0 and end + 1 - memory.first < SHORTEST:
        end = _following(memory, end)
    memory.active[here] = int(end >= 0)


@njit
def _learn(memory: Any, hertz: float, db: float) -> None:
    """Add an active frame to the means and deviations."""
    memory.weight = FORGET * memory.weight + 1.0
    for d, value in enumerate((hertz, db)):
        apart = value - memory.mean[d]
        memory.mean[d] += apart / memory.weight
        memory.squares[d] = FORGET * memory.squares[d] + apart * (value - memory.mean[d])


@njit
def _deviation(memory: Any, d: int, typical: float) -> float:
    squares = memory.squares[d] + TYPICAL_FRAMES * typical * typical
    return float(np.sqrt(squares / (memory.weight + TYPICAL_FRAMES)))


@njit
def _normalise(memory: Any, t: int) -> None:
    """Smooth and normalise an active frame, or fill another one with noise. After the end, the last is repeated."""
    here = t % RING
    if t >= memory.end:
        memory.pitch[here] = memory.pitch[(t - 1) % RING]
        return
    memory.pitch[here], memory.loudness[here] = memory.noise[here]
    if not memory.active[here]:
        return
    total = weight = 0.0
    for i in range(max(-HALF, -t), HALF + 1):
        near = (t + i) % RING
        if memory.active[near]:
            total += HANN[HALF + i] * memory.filled_hz[near]
            weight += HANN[HALF + i]
    hertz, db = total / weight, memory.db[here]
    _learn(memory, hertz, db)
    memory.pitch[here] = (hertz - memory.mean[0]) / _deviation(memory, 0, TYPICAL_PITCH * memory.mean[0])
    memory.loudness[here] = (db - memory.mean[1]) / _deviation(memory, 1, TYPICAL_DB)


@njit
def _write(memory: Any, t: int, row: Floats) -> None:
    """Write pitch, its slope by regression (see ``melody.slope``) and intensity of a frame."""
    before2, before = memory.pitch[max(t - 2, 0) % RING], memory.pitch[max(t - 1, 0) % RING]
    after, after2 = memory.pitch[(t + 1) % RING], memory.pitch[(t + 2) % RING]
    row[0], row[2] = memory.pitch[t % RING], memory.loudness[t % RING]
    row[1] = ((after - before) + 2.0 * (after2 - before2)) / 10.0


@njit
def _in_range(memory: Any, f0_hz: float) -> float:
    """Return the pitch of a frame; 0 if it is unvoiced, or too far from the mean of all voiced frames so far."""
    if f0_hz == 0.0:
        return 0.0
    memory.voiced = FORGET * memory.voiced + 1.0
    memory.voice_hz += (f0_hz - memory.voice_hz) / memory.voiced
    if memory.voiced < TYPICAL_FRAMES or LOWEST * memory.voice_hz <= f0_hz <= HIGHEST * memory.voice_hz:
        return f0_hz
    return 0.0


@njit
def enter(memory: Any, f0_hz: float, db: float, noise: Floats, row: Floats) -> bool:
    """Continue the melody by a frame, and fill ``row`` (3,) of the one that becomes known, if there is one.

    Parameters
    ----------
    f0_hz : pitch, 0 if unvoiced. db : intensity. noise : (2,) normal deviates.
    """
    t = memory.n
    here = t % RING
    memory.f0_hz[here], memory.db[here] = _in_range(memory, f0_hz), db
    memory.noise[here] = noise
    memory.n += 1
    if t >= DECIDED:
        _decide(memory, t - DECIDED)
    if t >= DECIDED + HALF:
        _normalise(memory, t - DECIDED - HALF)
    if t < LATER:
        return False
    _write(memory, t - LATER, row)
    return True


@njit
def push(samples: Floats, tracks: Any, memories: Any, noise: Floats, rows: Floats) -> int:
    """Analyse samples (n,), and return how many frames became known, which are in ``rows`` (>= 1 + n // STEP, 3).

    Parameters
    ----------
    tracks, memories : memories (1,) of pitch, as of ``syllables_kernels.memory``, and of everything else.
    noise : (>= 1 + n // STEP, 2) normal deviates for frames between utterances.
    """
    track, memory = tracks[0], memories[0]
    begun, n = memory.n, 0
    for sample in samples:
        completed = take(sample, track)
        if not completed:
            continue
        for i in range(KEPT - HOP):
            memory.heard[i] = memory.heard[i + HOP]
        memory.heard[KEPT - HOP :] = track.waiting
        hop = track.hops - AHEAD - LASTING
        if hop < 0:
            continue
        frame = track.recent[0]
        hertz = 0.0 if frame.silent else frame.f0_hz
        if hop % PER_FRAME == PER_FRAME - 1:
            both = hertz > 0.0 and memory.voiced_before > 0.0
            f0_hz = 0.5 * (hertz + memory.voiced_before) if both else 0.0
            if enter(memory, f0_hz, _decibels(memory.heard), noise[memory.n - begun], rows[n]):
                n += 1
        memory.voiced_before = hertz
    return n


@njit
def close(memories: Any, rows: Floats) -> None:
    """Fill ``rows`` (n, 3) with the last frames; the ``end`` of the stream is known."""
    memory, spare, n = memories[0], np.empty(3), 0
    for _ in range(LATER):
        if enter(memory, 0.0, 0.0, np.zeros(2), spare):
            rows[n] = spare
            n += 1
