"""The voices of a population: names from Praat's synthesiser, in the voice and the articulation of a speaker.

What the voice has of its own is the synthesiser's voice, the shift of its formants, and its pitch and tempo. What it
shares with the lips is how each phone is articulated: where the jaw is lower than usual, the resonances below 1 kHz
move up and the sound becomes louder; where the lips are rounder, those above it move down. The synthesiser only knows
usual phones, so the spectral envelope of its sound is warped by the deviations from them.

The synthesiser keeps state: the sound of a speaker is reproducible only for the same sequence of calls from the start
of a process, so that the workflow lets every speaker speak in a process of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import parselmouth
from parselmouth.praat import call, run

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.studio.population import phones, speakers
from cospeech.studio.population.phones import Spoken
from cospeech.studio.population.speakers import Articulation, Speaker, Utterance

LANGUAGE = "Turkish"
RATE_HZ = 16000
WORDS_PER_MINUTE = 230.0
VARIANTS = (*(f"Female{n}" for n in range(1, 6)), *(f"Male{n}" for n in range(1, 8)))
PITCH_RANGE_HZ = (60.0, 500.0)
"""Range of the pitch of all voices."""
FORMANTS, PITCH = 0.06, 0.10
"""Standard deviations of the logarithms of formant shift and pitch between speakers, at ``own_voice`` 1."""
INTONATION = 0.03
"""Standard deviation of the logarithm of the pitch between utterances."""
PHONE_TIER = 4
LEAD_S = 0.007
"""By how much the sound of the synthesiser precedes the times that it gives for its phones, in seconds: the mean of
five estimates from 1 to 13 ms, by canonical correlation of voices with the articulators of their phones or with
filmed lips. Voices that are played backward gave the opposite sign."""

ROOM = 1e-3
"""Standard deviation of the noise of the room, of full scale: -60 dB."""
LOUDNESS = 0.07
"""Standard deviation of the speech, of full scale."""
LOUDNESS_DB = 1.5
"""Standard deviation of the level of an utterance, in decibels."""

WINDOW, HOP = 512, 128
"""Samples in a spectrum, and between two of them."""
SMOOTH = 30
"""Number of cepstral coefficients that describe the envelope of a spectrum."""
OPENING_SHIFT, ROUNDING_SHIFT = 0.35, 0.20
"""By how much the logarithm of a resonance rises as the jaw opens fully, or the lips spread from rest."""
OPENING_DB = 9.0
"""By how much the sound becomes louder as the jaw opens fully, in decibels."""
LOW_HZ, HIGH_HZ = 900.0, 1300.0
"""Below the one, resonances follow the jaw, above the other the lips."""


class Voice(NamedTuple):
    """The voice of a speaker: a variant of the synthesiser, factors of its formants and its pitch."""

    variant: str
    formants: float
    pitch: float


def voice_of(speaker: Speaker, own_voice: float, seed: int) -> Voice:
    """Return the voice of a speaker; without anything of their own, all speakers have the same voice."""
    rng = random_source(seed, "population", "voice", speaker.name)
    variant = VARIANTS[int(rng.integers(len(VARIANTS)))] if own_voice > 0.0 else VARIANTS[0]
    formants, pitch = np.exp(own_voice * np.array([FORMANTS, PITCH]) * rng.standard_normal(2))
    return Voice(variant, float(formants), float(pitch))


def speak(utterance: Utterance, own: Voice, seed: int) -> tuple[Floats, Spoken]:
    """Return the sound (n,) of an utterance with usual phones, and the phones with silence around them.

    The sound is at 16 kHz, with full scale 1.
    """
    rng = speakers.utterance_rng(utterance, "voice", seed)
    # Overlap-add reverses pieces of unvoiced sound at random, using Praat's generator, which is seeded here.
    run(f"random_initializeWithSeedUnsafelyButPredictably ({rng.integers(2**31)})\n")
    pitch = own.pitch * float(np.exp(INTONATION * rng.standard_normal()))
    speed = WORDS_PER_MINUTE * speakers.tempo(utterance, seed)
    synthesiser = call("Create SpeechSynthesizer", LANGUAGE, own.variant)
    call(synthesiser, "Speech output settings", RATE_HZ, 0.01, float(np.clip(pitch, 0.5, 2.0)), 1.0, speed, "IPA")
    grid, usual = call(synthesiser, "To Sound", utterance.phrase, "yes")
    shifted = call(usual, "Change gender", *PITCH_RANGE_HZ, own.formants, 0.0, 1.0, 1.0).values[0]
    before, after = (int(RATE_HZ * margin_s) for margin_s in rng.uniform(*phones.MARGIN_S, 2))
    return np.pad(shifted, (before, after)), _phones(grid, before / RATE_HZ, len(shifted) / RATE_HZ, after / RATE_HZ)


def _phones(grid: parselmouth.TextGrid, before_s: float, spoken_s: float, after_s: float) -> Spoken:
    """Return the phones of a synthesised phrase in the middle of silence."""
    labels, starts_s = [phones.SILENCE], [0.0]
    for interval in range(1, call(grid, "Get number of intervals", PHONE_TIER) + 1):
        label = phones.known(call(grid, "Get label of interval", PHONE_TIER, interval).strip())
        if label == phones.SILENCE == labels[-1]:
            continue
        labels.append(label)
        starts_s.append(before_s - LEAD_S + call(grid, "Get start time of interval", PHONE_TIER, interval))
    end_s = before_s + spoken_s
    if labels[-1] != phones.SILENCE:
        labels.append(phones.SILENCE)
        starts_s.append(end_s)
    return Spoken(labels, np.append(starts_s, end_s + after_s))


def articulated(usual: Floats, how: Articulation, utterance: Utterance, seed: int) -> Floats:
    """Return the sound of an utterance as it is articulated, in a room, (n,).

    Parameters
    ----------
    usual : (n,) sound with usual phones.
    """
    rng = speakers.utterance_rng(utterance, "room", seed)
    starts = np.arange(0, len(usual) + HOP, HOP)
    deviation = how.voice(starts / RATE_HZ) - phones.movement(how.heard, starts / RATE_HZ)
    warped = _warped(usual, deviation[:, 0], deviation[:, 1])
    level = LOUDNESS * 10.0 ** (LOUDNESS_DB / 20.0 * rng.standard_normal()) / warped[np.abs(warped) > 0.0].std()
    return np.clip(level * warped + ROOM * rng.standard_normal(len(warped)), -1.0, 1.0)


def _warped(sound: Floats, opening: Floats, spreading: Floats) -> Floats:
    """Return a sound (n,) whose spectral envelopes are moved by these deviations (T,), one per ``HOP`` samples."""
    half = WINDOW // 2
    padded = np.pad(sound, (half, half + WINDOW))
    window = np.hanning(WINDOW + 1)[:-1]
    places = HOP * np.arange(len(opening))[:, None] + np.arange(WINDOW)
    spectra = np.fft.rfft(window * padded[places])
    envelopes = _log_envelopes(spectra)
    hz = np.fft.rfftfreq(WINDOW, 1.0 / RATE_HZ)
    high = np.clip((hz - LOW_HZ) / (HIGH_HZ - LOW_HZ), 0.0, 1.0)
    shift = OPENING_SHIFT * opening[:, None] * (1.0 - high) + ROUNDING_SHIFT * spreading[:, None] * high
    moved = np.array([np.interp(hz * np.exp(-by), hz, log) for by, log in zip(shift, envelopes, strict=True)])
    louder = OPENING_DB / 20.0 * np.log(10.0) * opening[:, None]
    pieces = window * np.fft.irfft(spectra * np.exp(moved - envelopes + louder), WINDOW)
    total, weight = np.zeros(len(padded)), np.full(len(padded), 1e-9)
    for start, piece in zip(places[:, 0], pieces, strict=True):
        total[start : start + WINDOW] += piece
        weight[start : start + WINDOW] += window**2
    return np.asarray((total / weight)[half : half + len(sound)])


def _log_envelopes(spectra: npt.NDArray[np.complex128]) -> Floats:
    """Return the logarithm of the envelope of each spectrum (T, F), smoothed in the cepstrum."""
    cepstra = np.fft.irfft(np.log(np.abs(spectra) + 1e-6))
    cepstra[:, SMOOTH : WINDOW - SMOOTH + 1] = 0.0
    return np.asarray(np.fft.rfft(cepstra).real)
