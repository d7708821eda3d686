"""Features planted without film, and without sound: a population in seconds.

Voice and lips are linear in what moves them, which is the model of canonical correlation analysis (Sargin 2006,
appendix A), except that lips also depend on squares and products of the articulators, as pictures do. The matrices
are those of one imaginary microphone and one imaginary camera; they do not depend on the seed of the run.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import frame_times
from cospeech.studio.population import phones, speakers
from cospeech.studio.population.phones import ARTICULATORS, PHONES, Spoken
from cospeech.studio.population.settings import Settings
from cospeech.studio.population.speakers import CENTRE, ROWS, Articulation, Speaker, Utterance

AUDIO_HZ = 100.0
CEPSTRA, LIPS = 13, 50
HIDDEN = 6
"""Number of articulators that only the voice tells: those behind the lips, and the glottis."""

LEVEL = 1.0 / np.sqrt(1.0 + np.arange(CEPSTRA))
"""Standard deviation of each cepstral coefficient, relative to the first."""
VOICE_NOISE, VOICE_MEMORY = 0.25, 0.6
"""Noise of the cepstral coefficients relative to ``LEVEL``, and its correlation from frame to frame."""
OWN_VOICE = 0.35
"""Standard deviation of a speaker's mean cepstrum and hidden targets, relative to ``LEVEL``, at ``own_voice`` 1."""
CHANNEL = 0.10
"""Standard deviation of the mean cepstrum of an utterance: the distance to the microphone and the mood."""

FADING = 1.0 / np.sqrt(1.0 + 0.25 * np.arange(LIPS))
"""Standard deviation of each lip coefficient, in zig-zag order, relative to the first."""
OWN_LIPS = 0.6
"""Standard deviation of the resting mouth between speakers, relative to ``FADING``, at ``own_lips`` 1."""
LIGHT = 1.0
"""Standard deviation of the lighting of a session, in the first coefficients, relative to ``FADING``."""
LIGHT_COEFFICIENTS = 10
CONTRAST = 0.15
"""Standard deviation of the logarithm of the contrast of a session."""
LIP_NOISE = 0.4
"""Noise of the lip coefficients, relative to ``FADING``."""
COLUMNS_AUDIO = [f"c{n}" for n in range(1, 3 * CEPSTRA + 1)]
COLUMNS_LIPS = [f"d{n}" for n in range(1, LIPS + 1)]

DEVICES = 2006
"""Seed of the matrices of the imaginary microphone and camera."""


def _microphone() -> tuple[Floats, Floats]:
    """Return how cepstra depend on the articulators (17, 13) and the hidden targets of each phone (P, 6)."""
    rng = random_source(DEVICES, "microphone")
    mixing = rng.standard_normal((len(ARTICULATORS) + HIDDEN, CEPSTRA)) * LEVEL
    mixing[: len(ARTICULATORS)] *= 1.6
    hidden = 0.6 * rng.standard_normal((len(PHONES), HIDDEN))
    return mixing, hidden


def _camera() -> Floats:
    """Return how lip coefficients depend on the articulators and on their squares and products, (14, 50)."""
    rng = random_source(DEVICES, "camera")
    n_products = len(ARTICULATORS) * (len(ARTICULATORS) + 1) // 2
    strengths = np.concatenate([np.full(len(ARTICULATORS), 1.5), np.full(n_products, 0.6)])
    return rng.standard_normal((len(strengths), LIPS)) * strengths[:, None] * FADING


MIXING, HIDDEN_TARGETS = _microphone()
PICTURE = _camera()


def utter(utterance: Utterance, everyone: list[Speaker], settings: Settings, seed: int) -> Articulation:
    """Return an utterance without sound: its phones have random durations."""
    rng = speakers.utterance_rng(utterance, "phones", seed)
    heard = phones.spoken(utterance.phrase, speakers.tempo(utterance, seed), rng)
    return speakers.articulate(utterance, heard, everyone, settings, seed)


def cepstra(utterance: Utterance, said: Articulation, settings: Settings, seed: int) -> Floats:
    """Return planted mel-frequency cepstral coefficients (T, 13), 100 per second."""
    own = random_source(seed, "population", "own voice", utterance.speaker.name)
    own_targets = HIDDEN_TARGETS + settings.own_voice * OWN_VOICE * own.standard_normal(HIDDEN_TARGETS.shape)
    own_mean = settings.own_voice * OWN_VOICE * own.standard_normal(CEPSTRA) * LEVEL
    times_s = frame_times(round(said.heard.duration_s * AUDIO_HZ), AUDIO_HZ)
    rows = [ROWS[phone] for phone in said.heard.phones]
    share = phones.weights(said.heard, times_s).mean(axis=2)
    moved = np.concatenate([said.voice(times_s) - CENTRE, share @ own_targets[rows]], axis=1)
    rng = speakers.utterance_rng(utterance, "sound", seed)
    noise = rng.standard_normal((len(times_s), CEPSTRA))
    for frame in range(1, len(noise)):
        noise[frame] = VOICE_MEMORY * noise[frame - 1] + np.sqrt(1 - VOICE_MEMORY**2) * noise[frame]
    channel = CHANNEL * rng.standard_normal(CEPSTRA)
    return np.asarray(moved @ MIXING + own_mean + (channel + VOICE_NOISE * noise) * LEVEL)


def lips(utterance: Utterance, said: Articulation, settings: Settings, seed: int) -> Floats:
    """Return planted lip coefficients (T, 50) at the frame rate of the films."""
    own = random_source(seed, "population", "own lips", utterance.speaker.name)
    resting = settings.own_lips * OWN_LIPS * own.standard_normal(LIPS)
    light = random_source(seed, "population", "light", f"{utterance.session}", utterance.speaker.name)
    lighting = LIGHT * light.standard_normal(LIPS) * (np.arange(LIPS) < LIGHT_COEFFICIENTS)
    contrast = np.exp(CONTRAST * light.standard_normal())
    times_s = frame_times(int(said.heard.duration_s * settings.fps), settings.fps)
    moved = said.lips(times_s) - CENTRE
    pairs = combinations_with_replacement(range(len(ARTICULATORS)), 2)
    products = np.stack([moved[:, one] * moved[:, other] for one, other in pairs], axis=1)
    noise = speakers.utterance_rng(utterance, "picture", seed).standard_normal((len(times_s), LIPS))
    still = (resting + lighting) * FADING
    return np.asarray(
        contrast * (np.concatenate([moved, products], axis=1) @ PICTURE + still) + LIP_NOISE * FADING * noise
    )


def lips_table(clip: str, coefficients: Floats, fps: float) -> pd.DataFrame:
    """Return the table of planted lip coefficients of a clip (schema ``lips``)."""
    table = pd.DataFrame(coefficients, columns=COLUMNS_LIPS)
    table.insert(0, "clip", clip)
    table.insert(1, "frame", np.arange(len(coefficients)))
    table.insert(2, "time_s", frame_times(len(coefficients), fps))
    return table.assign(status="planted")


def phones_table(clip: str, spoken: Spoken) -> pd.DataFrame:
    """Return the table of the phones of a clip (schema ``phones``)."""
    return pd.DataFrame(
        {"clip": clip, "phone": spoken.phones, "start_s": spoken.edges_s[:-1], "end_s": spoken.edges_s[1:]}
    )
