"""Prosody features and syllables simulated without sound, so that hours of speech take seconds.

The planted contours of pitch and intensity are used directly. The effects of the voice and the analysis window were
measured on the sound of the studio (eight records of 60 s, two voices, frames of 25 ms in windows of 50 ms) and are
sampled here:

- 87 % of the speech frames are voiced, in runs of 19 frames on average separated by runs of 2.5 frames;
- log energy is 0.21 below the plan in voiced frames and 1.0 in unvoiced ones, with standard deviations of 0.42 and
  0.81 and a frame-to-frame correlation of 0.47; a frame next to a pause shares a quarter of its window with it;
- the best lag is the planted one with a standard deviation of 0.17 semitones, but arbitrary in 1.5 % of the voiced
  frames, in 57 % of the unvoiced ones, and in pauses;
- the gain of a voiced frame is at most 1 minus the ratio of lag to window, that of an unvoiced frame about 0.3 and
  that of a pause about 0.09; a correlation of 0.8 reproduces the measured frame-to-frame differences.

The syllables are those that a listener would find. Measured in the same way with ``cospeech.speech.syllables``
(records of 90 s in the world ``all``):

- 98 % of the planted syllables are found; the peak is 4 ms early with a standard deviation of 9 ms, and the start is
  5 ms late with one of 31 ms; one syllable in twelve is found in two parts, which is left out here;
- 80 % of those that follow one another without a pause share a boundary; the others end 47 ms early with a standard
  deviation of 38 ms, and a gap follows (four voices, records of 90 s in the worlds ``syllables`` and ``all``);
- the end of every tenth one is an unvoiced syllable of 55 ms, softer by 6 dB;
- they are known 129 ms after their peak, with a standard deviation of 39 ms;
- the pitch has an error of 0.35 semitones, and a rise or fall within a syllable is 0.6 times that of the plan; the
  level is 2.5 dB below that of the peak, with a standard deviation of 1.1 dB.

Pitch and intensity at 100 Hz were measured with ``cospeech.speech.melody`` (three records of 240 s in the world
``patterns``, one voice):

- 94 % of the speech frames are voiced, in runs of 88 frames on average separated by runs of 5.8 frames;
- the pitch is the planted one with a standard deviation of 0.12 semitones, but 2 semitones in 2 % of the frames;
- the level is 1.25 dB below the plan in voiced frames and 9 dB in unvoiced ones, with standard deviations of 2.6 and
  8.2 dB and a frame-to-frame correlation of 0.73.

Clusters of these features share up to 0.05 more mutual information with the planted patterns than clusters of
features from the sound, because real noise is not independent from frame to frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import ndtr

from cospeech.data.arrays import Flags, Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.studio.melody import ROOM_DB, Contours, phrase_contours
from cospeech.studio.scenes import Scene
from cospeech.studio.syllables import sample

WINDOW_S = 0.05
"""The analysis window used for the measurements."""

VOICED_RUN, UNVOICED_RUN = 19.0, 2.5
ENERGY_BELOW = {"voiced": (0.21, 0.42), "unvoiced": (1.00, 0.81), "pause": (0.0, 0.06)}
ENERGY_MEMORY, GAIN_MEMORY = 0.47, 0.8
LAG_SPREAD_ST = 0.17
STRAY_LAGS = {"voiced": 0.015, "unvoiced": 0.57}

SHARES = np.array([0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0])
ANY_LAG_S = np.array([0.0025, 0.0029, 0.0047, 0.0074, 0.0111, 0.0154, 0.0166])
VOICED_GAIN = np.array([0.25, 0.53, 0.79, 0.89, 0.945, 0.994, 1.0])
UNVOICED_GAIN = np.array([0.06, 0.11, 0.16, 0.26, 0.39, 0.62, 0.80])
PAUSE_GAIN = np.array([0.05, 0.07, 0.08, 0.09, 0.10, 0.12, 0.20])
"""Measured quantiles at ``SHARES``."""

FOUND, JOINED = 0.98, 0.8
"""Share of the syllables that are found, and of those without a pause between them that share a boundary."""

PEAK_S, START_S, END_S = (-0.004, 0.009), (0.005, 0.031), (-0.047, 0.038)
"""Mean and standard deviation of the errors of their times; of the ends, where no boundary is shared."""

NEAREST_S = 0.02
"""Smallest distance of the peak of a syllable from its start and end."""

SHORTEST_S = 0.06
"""Shortest syllable that is found."""

KNOWN_S, KNOWN_LIMITS_S = (0.129, 0.039), (0.05, 0.25)
"""Mean and standard deviation of the delay after the peak until a syllable is known, and its limits."""

PITCH_SPREAD_ST, SEEN_INFLECTION, STRAY_INFLECTION_ST = 0.35, 0.6, 0.15
BELOW_PEAK_DB, LEVEL_SPREAD_DB = 2.5, 1.1
ENDS_UNVOICED, UNVOICED_S, UNVOICED_DB = 0.1, 0.055, -6.0
"""Pitch, level and unvoiced ends of syllables as listed above."""

MELODY_S, MELODY_RUNS, MELODY_MEMORY = 0.01, (88.0, 5.8), 0.73
MELODY_PITCH_ST, MELODY_STRAY_ST, MELODY_STRAY = 0.12, 2.0, 0.02
MELODY_BELOW_DB = {"voiced": (1.25, 2.6), "unvoiced": (9.0, 8.2), "pause": (0.0, 0.5)}
SMOOTHED = np.hanning(9)[1:-1]
"""Frame period of a melody; what was measured of it, as listed above; weights of the mean that smooths its pitch."""


class Speech(NamedTuple):
    """The speech of a record without sound: tables of the schemas ``prosody`` and ``syllables``."""

    prosody: pd.DataFrame
    syllables: pd.DataFrame


def speech(record: str, scene: Scene, base_hz: float, frame_s: float, voiced_gain: float, seed: int) -> Speech:
    """Return the simulated speech of one record; see ``features`` and ``syllables``.

    In the world ``phrases``, where no syllables are planted, they are sampled here, with an even tempo.
    """
    delivery = scene.delivery()
    if delivery is None:
        contours: Contours = phrase_contours
        spoken = sample(scene.prosody, None, random_source(seed, "syllables", record))
    else:
        contours, spoken = delivery.contours, delivery.syllables
    return Speech(
        features(record, scene.prosody, base_hz, frame_s, voiced_gain, seed, contours),
        syllables(record, scene.prosody, spoken, base_hz, seed, contours),
    )


def features(
    record: str,
    prosody: pd.DataFrame,
    base_hz: float,
    frame_s: float,
    voiced_gain: float,
    seed: int,
    contours: Contours = phrase_contours,
) -> pd.DataFrame:
    """Return the simulated prosody features (schema ``prosody``) of one record.

    Parameters
    ----------
    prosody : the intonation phrases of the record in the script.
    base_hz : base pitch of the speaker.
    voiced_gain : minimum gain of the frames that the mean lag is computed from (Özkul 2012, 4.2).
    contours : pitch and intensity of the speech.
    """
    rng = random_source(seed, "features", record)
    n_frames = round(float(prosody["end_s"].iloc[-1]) / frame_s)
    times_s = frame_times(n_frames, 1.0 / frame_s)
    pitch_st, intensity_db = contours(prosody, times_s)
    speaks = ~np.isnan(pitch_st)
    voiced = speaks & _voicing(n_frames, rng)
    planted_lag_s = 2.0 ** (-np.where(speaks, pitch_st, 0.0) / 12.0) / base_hz
    intensity_log = _energy(intensity_db, speaks, voiced, rng)
    lag_s = _lag(planted_lag_s, speaks, voiced, rng)
    gain = _gain(lag_s, speaks, voiced, rng)
    named = {
        "intensity": (intensity_log - intensity_log.mean()) / intensity_log.std(),
        "pitch_lag": lag_s - lag_s[gain > voiced_gain].mean(),
        "pitch_gain": gain,
    }
    derivatives = {f"d_{name}": np.diff(values, prepend=values[0]) for name, values in named.items()}
    columns = {"frame": np.arange(n_frames), "time_s": times_s, **named, **derivatives}
    return pd.DataFrame(columns | {"intensity_log": intensity_log, "lag_s": lag_s})


def _voicing(
    n_frames: int, rng: np.random.Generator, runs_of: tuple[float, float] = (VOICED_RUN, UNVOICED_RUN)
) -> Flags:
    """Return which frames (T,) would be voiced while speaking: alternating runs of geometric length.

    Parameters
    ----------
    runs_of : mean lengths of voiced and unvoiced runs, in frames.
    """
    pairs = int(1.5 * n_frames / sum(runs_of)) + 50
    runs = np.column_stack([rng.geometric(1.0 / mean, pairs) for mean in runs_of])
    flags = np.repeat(np.tile([True, False], pairs), runs.ravel())
    return np.resize(flags, n_frames)


def _energy(intensity_db: Floats, speaks: Flags, voiced: Flags, rng: np.random.Generator) -> Floats:
    room = 10.0 ** (ROOM_DB / 10.0)
    power = np.where(speaks, 10.0 ** (np.where(speaks, intensity_db, 0.0) / 10.0), 0.0) + room
    seen = np.convolve(np.pad(power, 1, mode="edge"), (0.25, 0.5, 0.25), mode="valid")
    below, spread = _by_voicing(ENERGY_BELOW, speaks, voiced)
    return np.log(seen) - below + spread * _lasting_noise(len(power), ENERGY_MEMORY, rng)


def _by_voicing(measured: Mapping[str, tuple[float, float]], speaks: Flags, voiced: Flags) -> tuple[Floats, Floats]:
    """Return a mean and a standard deviation per frame, (T,) each, by whether it is voiced, unvoiced, or a pause."""
    means, deviations = (
        np.select([voiced, speaks], [measured["voiced"][k], measured["unvoiced"][k]], measured["pause"][k])
        for k in (0, 1)
    )
    return means, deviations


def _lasting_noise(n_frames: int, memory: float, rng: np.random.Generator) -> Floats:
    """Return first-order autoregressive normal noise (T,) of unit variance with coefficient ``memory``."""
    left = memory ** np.arange(40)
    return np.convolve(rng.normal(size=n_frames + 39), left, mode="valid") / np.sqrt((left**2).sum())


def _lag(planted_lag_s: Floats, speaks: Flags, voiced: Flags, rng: np.random.Generator) -> Floats:
    astray = np.select([voiced, speaks], [STRAY_LAGS["voiced"], STRAY_LAGS["unvoiced"]], 1.0)
    anywhere = rng.random(len(voiced)) < astray
    near = planted_lag_s * 2.0 ** (rng.normal(0.0, LAG_SPREAD_ST, len(voiced)) / 12.0)
    return np.where(anywhere, np.interp(rng.random(len(voiced)), SHARES, ANY_LAG_S), near)


def _gain(lag_s: Floats, speaks: Flags, voiced: Flags, rng: np.random.Generator) -> Floats:
    share = ndtr(_lasting_noise(len(lag_s), GAIN_MEMORY, rng))
    voice = np.interp(share, SHARES, VOICED_GAIN) * (1.0 - lag_s / WINDOW_S)
    return np.select(
        [voiced, speaks],
        [voice, np.interp(share, SHARES, UNVOICED_GAIN)],
        np.interp(share, SHARES, PAUSE_GAIN),
    )


def syllables(
    record: str, prosody: pd.DataFrame, planted: pd.DataFrame, base_hz: float, seed: int, contours: Contours
) -> pd.DataFrame:
    """Return the syllables that a listener would find in the speech of one record (schema ``syllables``).

    Parameters
    ----------
    prosody : the intonation phrases of the record in the script.
    planted : its syllables: start_s, peak_s and end_s.
    base_hz : base pitch of the speaker.
    contours : pitch and intensity of the speech.
    """
    rng = random_source(seed, "found syllables", record)
    long_enough = (planted["end_s"] - planted["start_s"]).to_numpy() >= SHORTEST_S
    rows = planted[long_enough & (rng.random(len(planted)) < FOUND)]
    start_s, peak_s, end_s = (rows[name].to_numpy(dtype=float) for name in ("start_s", "peak_s", "end_s"))
    inside = 1e-3 * (end_s - start_s)
    courses = [contours(prosody, times_s) for times_s in (start_s + inside, peak_s, end_s - inside)]
    begin_st, peak_st, last_st = (pitch_st for pitch_st, _ in courses)
    rise_st, fall_st = (
        SEEN_INFLECTION * np.max([np.zeros(len(rows)), *(sign * step for step in steps)], axis=0)
        + np.abs(rng.normal(0.0, STRAY_INFLECTION_ST, len(rows)))
        for steps in [(peak_st - begin_st, last_st - peak_st, last_st - begin_st)]
        for sign in (1.0, -1.0)
    )
    f0_hz = base_hz * 2.0 ** ((peak_st + rng.normal(0.0, PITCH_SPREAD_ST, len(rows))) / 12.0)
    found_peak_s = np.clip(peak_s + rng.normal(*PEAK_S, len(rows)), start_s + NEAREST_S, end_s - NEAREST_S)
    earliest_s = np.append(0.0, found_peak_s + NEAREST_S)[:-1]
    found_start_s = np.clip(start_s + rng.normal(*START_S, len(rows)), earliest_s, found_peak_s - NEAREST_S)
    latest_s = np.append(found_start_s, prosody["end_s"].iloc[-1])[1:]
    found_end_s = np.clip(end_s + rng.normal(*END_S, len(rows)), found_peak_s + NEAREST_S, latest_s)
    shared = random_source(seed, "shared boundaries", record).random(len(rows)) < JOINED
    joined = np.append(start_s[1:] <= end_s[:-1] + 1e-6, False) & shared
    found_end_s = np.where(joined, latest_s, found_end_s)
    voiced = pd.DataFrame(
        {
            "start_s": found_start_s,
            "peak_s": found_peak_s,
            "end_s": found_end_s,
            "known_s": found_peak_s + np.clip(rng.normal(*KNOWN_S, len(rows)), *KNOWN_LIMITS_S),
            "f0_hz": f0_hz,
            "f0_rise_hz": f0_hz * (2.0 ** (rise_st / 12.0) - 1.0),
            "f0_fall_hz": f0_hz * (1.0 - 2.0 ** (-fall_st / 12.0)),
            "intensity_db": courses[1][1] - BELOW_PEAK_DB + rng.normal(0.0, LEVEL_SPREAD_DB, len(rows)),
        }
    )
    table = pd.concat([voiced, _unvoiced_ends(voiced, rng)]).sort_values("peak_s", ignore_index=True)
    table["known_s"] = np.minimum(np.maximum.accumulate(table["known_s"]), float(prosody["end_s"].iloc[-1]))
    return table.assign(record=record, syllable=np.arange(len(table)))[["record", "syllable", *voiced.columns]]


def melody(record: str, scene: Scene, base_hz: float, seed: int) -> pd.DataFrame:
    """Return the simulated pitch and intensity of one record at 100 Hz (schema ``melody``; Sargin 2006, 4.1.2).

    Parameters
    ----------
    scene : the scene of the record.
    base_hz : base pitch of the speaker.
    """
    delivery = scene.delivery()
    contours = phrase_contours if delivery is None else delivery.contours
    rng = random_source(seed, "simulated melody", record)
    n_frames = round(float(scene.prosody["end_s"].iloc[-1]) / MELODY_S)
    times_s = frame_times(n_frames, 1.0 / MELODY_S)
    pitch_st, planted_db = contours(scene.prosody, times_s)
    active = ~np.isnan(pitch_st)
    voiced = active & _voicing(n_frames, rng, MELODY_RUNS)
    error_st = np.where(rng.random(n_frames) < MELODY_STRAY, MELODY_STRAY_ST, MELODY_PITCH_ST)
    f0_hz = base_hz * 2.0 ** ((pitch_st + rng.normal(0.0, error_st)) / 12.0)
    below_db, spread_db = _by_voicing(MELODY_BELOW_DB, active, voiced)
    noise_db = spread_db * _lasting_noise(n_frames, MELODY_MEMORY, rng)
    intensity_db = np.where(active, planted_db, ROOM_DB) - below_db + noise_db
    smooth_hz = np.convolve(np.where(active, f0_hz, 0.0), SMOOTHED, mode="same")
    smooth_hz /= np.maximum(np.convolve(active, SMOOTHED, mode="same"), SMOOTHED[0])
    pitch, intensity = (
        np.where(active, (values - values[active].mean()) / values[active].std(), rng.normal(size=n_frames))
        for values in (smooth_hz, intensity_db)
    )
    return pd.DataFrame(
        {
            "frame": np.arange(n_frames),
            "time_s": times_s,
            "f0_hz": np.where(voiced, f0_hz, np.nan),
            "intensity_db": intensity_db,
            "active": active,
            "pitch": pitch,
            "d_pitch": np.convolve(np.pad(pitch, 2, mode="edge"), (0.2, 0.1, 0.0, -0.1, -0.2), mode="valid"),
            "intensity": intensity,
        }
    )


def _unvoiced_ends(voiced: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Return the unvoiced syllables at the ends of some voiced ones, which are shortened by them."""
    long = (voiced["end_s"] - voiced["peak_s"]).to_numpy() > UNVOICED_S + NEAREST_S
    chosen = long & (rng.random(len(voiced)) < ENDS_UNVOICED * len(long) / max(1, long.sum()))
    ends = voiced[chosen].copy()
    ends["start_s"] = ends["end_s"] - UNVOICED_S
    ends["peak_s"] = ends["start_s"] + UNVOICED_S / 2
    ends["known_s"] = ends["peak_s"] + np.clip(rng.normal(*KNOWN_S, len(ends)), *KNOWN_LIMITS_S)
    ends[["f0_hz", "f0_rise_hz", "f0_fall_hz"]] = np.nan
    ends["intensity_db"] += UNVOICED_DB
    voiced.loc[chosen, "end_s"] = ends["start_s"]
    return ends
