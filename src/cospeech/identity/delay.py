"""The delay between voice and lips by canonical correlation analysis (Sargin 2006, 2.2).

Pieces of half a second are cut from the clips so far from their ends that every shift sees the same number of frames:
otherwise short overlaps would win. The mean of each piece is removed, because what is constant in an utterance tells
who speaks and where the lamp stands, but not when the lips move. The covariances are regularised.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.linalg import solve_triangular
from threadpoolctl import threadpool_limits

from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.identity.features import RATE_HZ, Features

PIECE = 50
"""Frames of a piece."""

FEWEST_PIECES = 4
"""With fewer pieces, no delay is reported."""

FEWEST_PHRASES = 5
"""With so many different phrases or more, the bootstrap draws whole phrases: what agrees by chance in one does so
whenever it is said."""

GROUPS = 20
"""With fewer, it draws so many groups of consecutive pieces, or single pieces if there are fewer."""

WIDEST_S = 0.1
"""Widest interval of a delay that is reported, in seconds."""

SIGNIFICANT = 0.05
"""Greatest p-value at which a delay is reported."""


class Settings(NamedTuple):
    """How the delay is looked for.

    Attributes
    ----------
    longest_s : longest delay that is tried, in seconds.
    regularisation : share of the variances of voice and lips that is added to them.
    samples : number of bootstrap samples.
    mismatches : number of wrong pairings of voice and lips.
    level : level of the interval.
    """

    longest_s: float = 0.2
    regularisation: float = 0.1
    samples: int = 200
    mismatches: int = 39
    level: float = 0.95


class Delay(NamedTuple):
    """A delay, and how far it can be trusted.

    Attributes
    ----------
    delay_s : by how much the voice lags behind the lips.
    low_s, high_s : its bootstrap interval over phrases, or over pieces of a few phrases.
    p_value : share of wrong pairings whose greatest correlation measure is as large, the right one included.
    shifts_s, measure : (S,) the shifts that were tried, and gamma_AL of each (2.5).
    chance : the greatest measure of the wrong pairings, on average; NaN without any.
    n_pieces : number of pieces.
    """

    delay_s: float
    low_s: float
    high_s: float
    p_value: float
    shifts_s: Floats
    measure: Floats
    chance: float
    n_pieces: int

    @property
    def doubt(self) -> str | None:
        """Why the delay cannot be told, or None if it can."""
        if self.n_pieces < FEWEST_PIECES:
            return f"there are only {self.n_pieces} pieces of {PIECE / RATE_HZ:g} s with voice and lips"
        if not self.measure.max() > 0.0:
            return "voice or lips do not change"
        if self.p_value > SIGNIFICANT:
            return f"wrong pairings of voice and lips agree as well (p = {self.p_value:.2f})"
        if np.argmax(self.measure) in (0, len(self.measure) - 1):
            return f"it is at least {abs(self.delay_s):.2f} s, the longest that was tried"
        if self.high_s - self.low_s > WIDEST_S:
            low, high = 1000.0 * self.low_s, 1000.0 * self.high_s
            return f"it is too uncertain, {low:+.0f} to {high:+.0f} ms; more speech is needed"
        return None


class _Pieces(NamedTuple):
    """Pieces of lips (P, PIECE, N_L), and for each shift of the voice those of the voice (S, P, PIECE, N_A)."""

    lips: Floats
    audio: Floats


class _Sums(NamedTuple):
    """Covariances of groups of pieces.

    Attributes
    ----------
    lips : (G, N_L, N_L).
    audio, both : (G, S, N_A, N_A) and (G, S, N_A, N_L), of the voice, and of voice and lips, at each shift.
    """

    lips: Floats
    audio: Floats
    both: Floats


def find(features: Features, settings: Settings, seed: int) -> Delay:
    """Return the delay between the voice and the lips of some clips.

    Parameters
    ----------
    features : of the clips, not synchronised.
    settings : how it is looked for.
    seed : of the bootstrap and the wrong pairings.
    """
    with threadpool_limits(1, "blas"):  # sums must not depend on the number of cores
        return _find(features, settings, seed)


def _find(features: Features, settings: Settings, seed: int) -> Delay:
    longest = round(settings.longest_s * RATE_HZ)
    shifts = np.arange(-longest, longest + 1)
    starts = _starts(features, longest)
    if len(starts) < FEWEST_PIECES:
        zeros = np.zeros(len(shifts))
        return Delay(0.0, math.nan, math.nan, 1.0, shifts / RATE_HZ, zeros, math.nan, len(starts))
    pieces = _cut(features, starts, shifts)
    group = _groups(features, starts)
    n_groups = int(group.max()) + 1
    sums = _sums(pieces, group, n_groups)
    measure = _measures(sums, np.ones(n_groups), settings.regularisation)
    counts = _drawn(n_groups, settings.samples, seed)
    resampled = [_peak(_measures(sums, drawn, settings.regularisation)) for drawn in counts]
    tail = 0.5 * (1.0 - settings.level)
    low, high = (np.quantile(resampled, [tail, 1.0 - tail]) - longest) / RATE_HZ
    wrong = _mismatched(pieces, settings, seed)
    return Delay(
        (_peak(measure) - longest) / RATE_HZ,
        float(low),
        float(high),
        float(1 + (wrong >= measure.max()).sum()) / (1 + len(wrong)),
        shifts / RATE_HZ,
        measure,
        float(wrong.mean()),
        len(starts),
    )


def _starts(features: Features, longest: int) -> Integers:
    """Return the first rows of the lips of all pieces: as many as fit into the middle of each clip."""
    found = []
    for begin, length in zip(features.begin, features.length, strict=True):
        free = length - 2 * longest
        n = max(0, int(free) // PIECE)
        found += [begin + longest + (free - n * PIECE) // 2 + PIECE * k for k in range(n)]
    return np.array(found, dtype=np.int64)


def _groups(features: Features, starts: Integers) -> Integers:
    """Return the group of each piece (P,), by its first row: what the bootstrap draws together."""
    clip = np.searchsorted(features.begin, starts, side="right") - 1
    phrase, phrases = pd.factorize(features.clips["phrase"].to_numpy(dtype=object)[clip])
    if len(phrases) >= FEWEST_PHRASES:
        return np.asarray(phrase, dtype=np.int64)
    n_groups = min(GROUPS, len(starts))
    return np.arange(len(starts)) * n_groups // len(starts)


def _cut(features: Features, starts: Integers, shifts: Integers) -> _Pieces:
    """Return the pieces without their means, the features divided by their standard deviations."""
    rows = starts[:, None] + np.arange(PIECE)
    lips = _scaled(features.lips[rows])
    return _Pieces(lips, np.stack([_scaled(features.audio[rows + shift]) for shift in shifts]))


def _scaled(pieces: Floats) -> Floats:
    """Return pieces (P, n, D) without their means; features that do not vary are 0, others have variance 1."""
    centred = pieces - pieces.mean(axis=1, keepdims=True)
    deviation = np.sqrt((centred**2).mean(axis=(0, 1)))
    typical = np.abs(pieces).max(axis=(0, 1))
    varies = deviation > 1e-9 * typical
    scaled: Floats = np.where(varies, centred / np.where(varies, deviation, 1.0), 0.0)
    return scaled


def _sums(pieces: _Pieces, group: Integers, n_groups: int) -> _Sums:
    """Return the covariances of each group of pieces, divided by the number of all frames."""
    lips, audio, both = [], [], []
    for one in range(n_groups):
        seen = _flat(pieces.lips[group == one])
        heard = [_flat(shifted[group == one]) for shifted in pieces.audio]
        lips.append(seen.T @ seen)
        audio.append([own.T @ own for own in heard])
        both.append([own.T @ seen for own in heard])
    n = len(pieces.lips) * PIECE
    return _Sums(np.array(lips) / n, np.array(audio) / n, np.array(both) / n)


def _flat(pieces: Floats) -> Floats:
    return pieces.reshape(-1, pieces.shape[-1])


def _measures(sums: _Sums, counts: Floats, regularisation: float) -> Floats:
    """Return gamma_AL (2.5) of each shift, (S,), with each group of pieces counted so often.

    The sum of the squared canonical correlations is the trace of C_xx^-1 C_xy C_yy^-1 C_yx, see A.5.
    """
    lips = _invertible(np.tensordot(counts, sums.lips, 1), regularisation)
    audio = _invertible(np.tensordot(counts, sums.audio, 1), regularisation)
    both = np.tensordot(counts, sums.both, 1)
    found: Floats = (np.linalg.solve(audio, both) * (both @ np.linalg.inv(lips))).sum(axis=(1, 2))
    return found


def _invertible(covariance: Floats, regularisation: float) -> Floats:
    """Return regularised covariances (..., D, D); a feature that does not vary counts for nothing."""
    own = np.diagonal(covariance, axis1=-2, axis2=-1)
    added = regularisation * own + (own <= 0.0)
    regularised: Floats = covariance + added[..., None] * np.eye(own.shape[-1])
    return regularised


def _mismatched(pieces: _Pieces, settings: Settings, seed: int) -> Floats:
    """Return the greatest gamma_AL over all shifts, of each wrong pairing of the pieces of voice and lips."""
    lips = _white(_flat(pieces.lips), settings.regularisation).reshape(*pieces.lips.shape)
    rng = random_source(seed, "mismatched")
    wrong = [_flat(lips[_deranged(len(lips), rng)]) for _ in range(settings.mismatches)]
    found = np.zeros(settings.mismatches)
    for audio in pieces.audio:
        voice = _white(_flat(audio), settings.regularisation)
        for place, other in enumerate(wrong):
            found[place] = max(found[place], ((voice.T @ other / len(voice)) ** 2).sum())
    return found


def _drawn(n_groups: int, samples: int, seed: int) -> Floats:
    """Return how often each group of pieces is drawn in each bootstrap sample, (samples, G)."""
    equal = np.full(n_groups, 1 / n_groups)
    return random_source(seed, "delay").multinomial(n_groups, equal, samples).astype(np.float64)


def _deranged(n: int, rng: np.random.Generator) -> Integers:
    """Return a random cyclic order of n pieces, in which none keeps its place."""
    order = rng.permutation(n)
    found = np.empty(n, dtype=np.int64)
    found[order] = np.roll(order, 1)
    return found


def _white(frames: Floats, regularisation: float) -> Floats:
    """Return frames (T, D) that are uncorrelated, as far as the regularised covariance says so."""
    factor = np.linalg.cholesky(_invertible(frames.T @ frames / len(frames), regularisation))
    white: Floats = solve_triangular(factor, frames.T, lower=True).T
    return white


def _peak(measure: Floats) -> float:
    """Return the place of the maximum, between samples by a parabola through three of them."""
    top = int(measure.argmax())
    if top in (0, len(measure) - 1):
        return float(top)
    before, at, after = measure[top - 1 : top + 2]
    bend = before - 2.0 * at + after
    return float(top + (0.5 * (before - after) / bend if bend < 0.0 else 0.0))


def table(found: Delay, clips: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``delay``, one row.

    Parameters
    ----------
    found : the delay.
    clips : the table ``clips``, which knows a planted delay.
    """
    planted = clips["delay_planted_s"].dropna()
    return pd.DataFrame(
        {
            "delay_ms": [1000.0 * found.delay_s],
            "low_ms": [1000.0 * found.low_s],
            "high_ms": [1000.0 * found.high_s],
            "p_value": [found.p_value],
            "chance": [found.chance],
            "pieces": [found.n_pieces],
            "doubt": [found.doubt],
            "shift": [0 if found.doubt else round(found.delay_s * RATE_HZ)],
            "planted_ms": [1000.0 * planted.iloc[0] if len(planted) else np.nan],
        }
    )


def curve_table(found: Delay) -> pd.DataFrame:
    """Return the table ``delay_curve``."""
    return pd.DataFrame({"shift_ms": 1000.0 * found.shifts_s, "measure": found.measure})
