"""The voice: English from Praat's synthesiser, with planted pitch accents and the times of words and syllables.

Overlap-add (PSOLA) replaces the pitch of the synthesiser: it declines over each sentence, varies a little from
syllable to syllable, and rises in accents, which are also louder. All syllables of a sentence differ in pitch, so
that an accent is no more than a larger deviation, as in speech.

The synthesiser keeps state: the sound is reproducible only for the same sequence of calls from the start of a
process, so that the workflow lets every voice speak in a process of its own.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
import parselmouth
from parselmouth.praat import call, run

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.errors import UserError
from cospeech.studio.directions import sentences
from cospeech.studio.directions.settings import Settings
from cospeech.studio.voice import KNOWN_VOICES, PHONEME_TIER, RATE_HZ, VOICE_RANGE_HZ, VOWELS, WORD_TIER, intervals

LANGUAGE = "English (America)"
ENGLISH_VOWELS = VOWELS + "ɜɚɒʌᵻ"
"""First letters of the vowels of English."""
WORDS_PER_MINUTE, TEMPO = 175.0, 0.08
"""Mean tempo, and the standard deviation of its logarithm between sentences."""
PITCH_FACTOR = (0.5, 2.0)
"""Limits of the pitch relative to that of the voice."""
REGISTER_ST = 1.0
"""Standard deviation of the mean pitch of sentences, in semitones."""
DECLINATION_ST = 3.0
"""How far the pitch falls over a sentence."""
ACCENT_SHARE = 0.4
"""Share of the words that can carry a pitch accent which do."""
ACCENT_VARIES, ACCENT_S, ACCENT_DB = 0.35, 0.1, 3.0
"""Relative spread of the height of accents, standard deviation of their course in seconds, and gain in decibels."""
PAUSE_S = (0.25, 0.9)
"""Range of the pauses between sentences."""
ROOM, LOUDNESS = 1e-3, 0.07
"""Standard deviations of the noise of the room and of the speech, full scale 1."""
PITCH_STEP_S = 0.005
SYLLABLE_S = 0.08
"""Shortest syllable that is labelled."""


class Event(NamedTuple):
    """An interval in seconds, and its label."""

    start_s: float
    end_s: float
    label: str


class Spoken(NamedTuple):
    """An answer: samples (n,) at 16 kHz with full scale 1, its words and its syllables."""

    samples: Floats
    words: list[Event]
    syllables: list[Event]


def speak(record: str, voice: str, text: list[str], settings: Settings, seed: int) -> Spoken:
    """Return the sound of an answer with pauses between its sentences, its words and its syllables.

    Parameters
    ----------
    record : name of the answer, which random numbers depend on.
    voice : a voice of Praat's synthesiser.
    text : its sentences.

    Raises
    ------
    UserError : if Praat has no such voice.
    """
    rng = random_source(seed, "directions", "voice", record)
    # Overlap-add reverses pieces of unvoiced sound at random, using Praat's generator, which is seeded here.
    run(f"random_initializeWithSeedUnsafelyButPredictably ({rng.integers(2**31)})\n")
    pieces, words, syllables, time_s = [], [], [], 0.0
    for sentence in text:
        pause = np.zeros(round(rng.uniform(*PAUSE_S) * RATE_HZ))
        time_s += len(pause) / RATE_HZ
        spoken = _sentence(voice, sentence, settings, rng)
        pieces += [pause, spoken.samples]
        words += [_moved(event, time_s) for event in spoken.words]
        syllables += [_moved(event, time_s) for event in spoken.syllables]
        time_s += len(spoken.samples) / RATE_HZ
    sound = np.concatenate([*pieces, np.zeros(round(PAUSE_S[0] * RATE_HZ))])
    sound = np.clip(sound + ROOM * rng.standard_normal(len(sound)), -1.0, 1.0)
    return Spoken(sound, words, syllables)


def _moved(event: Event, by_s: float) -> Event:
    return event._replace(start_s=event.start_s + by_s, end_s=event.end_s + by_s)


def _sentence(voice: str, text: str, settings: Settings, rng: np.random.Generator) -> Spoken:
    grid, sound = call(_synthesiser(voice, rng), "To Sound", text, "yes")
    words = [Event(start, end, sentences.plain(label)) for start, end, label in intervals(grid, WORD_TIER)]
    vowels = [Event(*found) for found in intervals(grid, PHONEME_TIER) if found[2][0] in ENGLISH_VOWELS]
    syllables = [syllable for word in words for syllable in _syllables(word, vowels, rng)]
    accented = _with_pitch(sound, syllables, settings, rng)
    louder = sum(_bump(syllable, _times(accented)) for syllable in syllables if syllable.label == "accent")
    samples = accented * 10.0 ** (ACCENT_DB / 20.0 * louder)
    return Spoken(LOUDNESS / samples.std() * samples, words, syllables)


def _synthesiser(voice: str, rng: np.random.Generator) -> parselmouth.Data:
    try:
        synthesiser = call("Create SpeechSynthesizer", LANGUAGE, voice)
    except parselmouth.PraatError as error:
        raise UserError(
            f"config: studio.directions.voices: Praat's synthesiser has no voice '{voice}'; {KNOWN_VOICES}"
        ) from error
    tempo = WORDS_PER_MINUTE * float(np.exp(TEMPO * rng.standard_normal()))
    call(synthesiser, "Speech output settings", RATE_HZ, 0.01, 1.0, 1.0, tempo, "IPA")
    return synthesiser


def _syllables(word: Event, vowels: list[Event], rng: np.random.Generator) -> list[Event]:
    """Return the syllables of a word, which meet halfway between its vowels; the first one may be accented."""
    own = [vowel for vowel in vowels if word.start_s <= vowel.start_s < word.end_s]
    if not own:
        return []
    meet_s = [(one.end_s + other.start_s) / 2.0 for one, other in itertools.pairwise(own)]
    is_accented = word.label not in sentences.WEAK and rng.random() < ACCENT_SHARE
    labels = ["accent" if is_accented else "non_accent", *(["non_accent"] * (len(own) - 1))]
    bounds = zip([word.start_s, *meet_s], [*meet_s, word.end_s], labels, strict=True)
    return [Event(*found) for found in bounds if found[1] - found[0] >= SYLLABLE_S]


def _times(samples: Floats) -> Floats:
    return np.arange(len(samples)) / RATE_HZ


def _bump(syllable: Event, times_s: Floats) -> Floats:
    """Return the course of an accent over time, 1 in the middle of its syllable."""
    middle = (syllable.start_s + syllable.end_s) / 2.0
    return np.asarray(np.exp(-0.5 * ((times_s - middle) / ACCENT_S) ** 2))


def _with_pitch(
    sound: parselmouth.Sound, syllables: list[Event], settings: Settings, rng: np.random.Generator
) -> Floats:
    """Return the samples of a sentence with its planted pitch.

    Raises
    ------
    UserError : if the voice is a whisper.
    """
    manipulation = call(sound, "To Manipulation", 0.01, *VOICE_RANGE_HZ)
    track = sound.to_pitch(pitch_floor=VOICE_RANGE_HZ[0], pitch_ceiling=VOICE_RANGE_HZ[1]).selected_array["frequency"]
    if not track.any():
        raise UserError(f"config: studio.directions.voices: a voice has no pitch; {KNOWN_VOICES}")
    times_s = np.arange(PITCH_STEP_S / 2, sound.duration, PITCH_STEP_S)
    middles = [(syllable.start_s + syllable.end_s) / 2.0 for syllable in syllables]
    ripple = np.interp(times_s, middles, settings.ripple_st * rng.standard_normal(len(syllables)))
    semitones = REGISTER_ST * rng.standard_normal() + DECLINATION_ST * (0.5 - times_s / sound.duration) + ripple
    for syllable in syllables:
        height = settings.accent_st * float(np.exp(ACCENT_VARIES * rng.standard_normal()))
        if syllable.label == "accent":
            semitones += height * _bump(syllable, times_s)
    hz = np.median(track[track > 0]) * np.clip(2.0 ** (semitones / 12.0), *PITCH_FACTOR)
    course = parselmouth.Sound(hz, 1.0 / PITCH_STEP_S)
    tier = call(call(call(course, "Down to Matrix"), "To Pitch"), "Down to PitchTier")
    call([manipulation, tier], "Replace pitch tier")
    spoken: Floats = call(manipulation, "Get resynthesis (overlap-add)").values[0]
    return spoken
