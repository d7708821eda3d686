"""The voice: Turkish speech from Praat's synthesiser, resynthesised with the planted pitch and intensity.

The stretches between pauses are filled with the number of words that fits best. Overlap-add (PSOLA) adjusts their
tempo and replaces the pitch of the synthesiser with the planted one; a slowly varying gain then sets the planted
intensity. Room noise underlies everything and is all there is in pauses. Unvoiced sounds have no pitch and stay
unvoiced.

The synthesiser keeps state within a process, including a flutter of the voice that cannot be reset. The sound is
therefore reproducible only for the same sequence of calls from the start of a process; the workflow runs every record
in its own process. The base pitch of a voice is always measured in a new process.

Where a record has syllables (see ``syllables``), each vowel is one of them: words are chosen whose vowels are as many
as the syllables of a stretch, and stretched or shortened between vowels so that the middle of each vowel is at the
peak of its syllable.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
import parselmouth
from parselmouth.praat import call, run

from cospeech.data.arrays import Floats
from cospeech.data.rng import random_source
from cospeech.data.segments import at_times, frame_times
from cospeech.errors import UserError
from cospeech.studio.melody import ROOM_DB, Plan, phrase_contours, plan
from cospeech.studio.patterns import PATTERNS
from cospeech.studio.sentences import SENTENCES
from cospeech.studio.syllables import Delivery, stretches

LANGUAGE = "Turkish"
KNOWN_VOICES = "use Female1 to Female5 or Male1 to Male7"
RATE_HZ = 16000
WORDS_PER_MINUTE = 175
LOWEST_HZ, HIGHEST_HZ = 75.0, 350.0
"""Range of planted pitch: that of human speakers, and well within the search range of a pitch tracker."""
TEMPO = (0.75, 1.35)
"""Range of the duration factor by which words may be shortened or stretched."""
LONGEST_PERIOD_S = 0.02
"""Largest distance of successive glottal pulses in voiced speech, as in Praat."""
VOICE_RANGE_HZ = (55.0, 450.0)
"""Search range for the pitch of the synthesiser."""
WORD_TIER, PHONEME_TIER = 3, 4
"""Numbers of the tiers of words and phonemes; those of Praat's synthesiser are sentence, clause, word, phoneme."""
VOWELS = "aeiouyøœɑɐæɛɪɨɯɔʊʌəɘ"
"""First letters of the synthesiser's vowels."""
LONGEST_SEARCH = 200
"""Number of words per vowel among which suitable ones are looked for; every story has words with a single vowel."""
LENGTHENING = (0.35, 3.5)
"""Range of the duration factor between two vowels."""
PITCH_STEP_S = 0.005
DEEPEST_DB = 10.0
"""Largest level deficit, relative to the mean of the stretch, that is compensated; softer parts stay soft."""
MEASURE = "import sys; from cospeech.studio import voice; print(voice.natural_hz(sys.argv[1]))"
"""Program that measures the pitch of a voice in a process of its own."""
KNOT_S = 1e-6
"""Distance of two points of a duration tier between which the factor changes."""
EDGE_S = 0.015
SYLLABLE_S = 0.1


class Word(NamedTuple):
    """A synthesised word: its samples (n,), and the middles of its vowels in seconds from its start, (V,)."""

    samples: Floats
    vowels_s: Floats


@dataclass(frozen=True)
class Stretch:
    """Speech between two pauses.

    Attributes
    ----------
    start_s, end_s : its start and end in seconds.
    words : (n,) samples of its words.
    vowels_s : (V,) middles of the vowels in these samples, in seconds.
    peaks_s : (V,) times from the start of the stretch at which they are spoken, None if the tempo is even.
    """

    start_s: float
    end_s: float
    words: Floats
    vowels_s: Floats
    peaks_s: Floats | None


class Tempo(NamedTuple):
    """How the time of synthesised words is mapped to that of a stretch: linearly between knots, in seconds.

    Attributes
    ----------
    words_s, spoken_s : (K,) times of the knots in the words and in the stretch.
    factors : (K - 1,) duration factor between each two knots.
    """

    words_s: Floats
    spoken_s: Floats
    factors: Floats

    def spoken(self, words_s: Floats) -> Floats:
        """Return the times in the stretch of times in the words."""
        row = np.clip(np.searchsorted(self.words_s, words_s, side="right") - 1, 0, len(self.factors) - 1)
        return np.asarray(self.spoken_s[row] + self.factors[row] * (words_s - self.words_s[row]))

    def words(self, spoken_s: Floats) -> Floats:
        """Return the times in the words of times in the stretch."""
        row = np.clip(np.searchsorted(self.spoken_s, spoken_s, side="right") - 1, 0, len(self.factors) - 1)
        return np.asarray(self.words_s[row] + (spoken_s - self.spoken_s[row]) / self.factors[row])


def speak(
    record: str,
    prosody: pd.DataFrame,
    voice: str,
    scenario: str,
    frame_s: float,
    seed: int,
    delivery: Delivery | None = None,
) -> tuple[Floats, pd.DataFrame]:
    """Return the sound of one record and the planted prosody.

    Parameters
    ----------
    prosody : the intonation phrases of the record in the script.
    voice : a voice variant of Praat's synthesiser.
    scenario : the story to tell, a key of ``sentences.SENTENCES``.
    frame_s : spacing of prosody frames, seconds.
    delivery : its syllables, and how arousal and accents change it; by default the tempo is even.

    Returns
    -------
    The samples (n,) at 16 kHz with full scale 1; and a table (schema ``planted_prosody``) with, per prosody frame,
    the planted lag 1 / F0 (null in pauses and unvoiced sounds), the planted intensity over a syllable in decibels re
    full scale, and the pattern.

    Raises
    ------
    UserError : if Praat has no such voice.

    Notes
    -----
    The synthesiser keeps state: only the first call in a process is reproducible, as in a job of the workflow.
    """
    duration_s = float(prosody["end_s"].iloc[-1])
    frames_s = frame_times(round(duration_s / frame_s), 1.0 / frame_s)
    rng = random_source(seed, "voice", record)
    # Overlap-add reverses pieces of unvoiced sound at random, using Praat's generator, which is seeded here.
    run(f"random_initializeWithSeedUnsafelyButPredictably ({rng.integers(2**31)})\n")
    sound = np.zeros(round(duration_s * RATE_HZ))
    lag_s, intensity_db = np.full(len(frames_s), np.nan), np.full(len(frames_s), ROOM_DB)
    contours = phrase_contours if delivery is None else delivery.contours
    whole = plan(prosody, _base_hz(voice, natural_hz(voice)), contours)
    peaks_s = None
    if delivery is not None:
        whole = whole.within(LOWEST_HZ, HIGHEST_HZ)
        peaks_s = delivery.syllables["peak_s"].to_numpy()
    for stretch in _stretches(prosody, _words(voice, scenario, rng), peaks_s):
        planted = whole.part(stretch.start_s, stretch.end_s)
        first, last = round(stretch.start_s * RATE_HZ), round(stretch.end_s * RATE_HZ)
        spoken, is_voiced = _with_pitch(stretch, planted, last - first)
        sound[first:last] = _with_intensity(spoken, planted.intensity_at((np.arange(first, last) + 0.5) / RATE_HZ))
        here = np.flatnonzero((frames_s >= stretch.start_s) & (frames_s < stretch.end_s))
        intensity_db[here] = planted.intensity_at(frames_s[here])
        here = here[is_voiced(frames_s[here])]
        lag_s[here] = 1.0 / planted.pitch_at(frames_s[here])
    sound += rng.normal(0.0, 10.0 ** (ROOM_DB / 20.0), len(sound))
    patterns = prosody["label"].to_numpy(dtype=object)[at_times(prosody, frames_s)]
    table = pd.DataFrame(
        {
            "frame": np.arange(len(frames_s)),
            "time_s": frames_s,
            "lag_s": lag_s,
            "intensity_db": intensity_db,
            "pattern": patterns.astype(str),
        }
    )
    return np.clip(sound, -1.0, 1.0), table


@cache
def base_hz(voice: str) -> float:
    """Return the base pitch of a voice: its median pitch, limited so that all patterns stay in the range of speech.

    It does not depend on what this process has synthesised before.

    Raises
    ------
    UserError : if Praat has no such voice, or if it is a whisper.
    """
    _synthesiser(voice)  # reports an unknown voice
    measured = subprocess.run([sys.executable, "-c", MEASURE, voice], check=True, stdout=subprocess.PIPE, text=True)
    return _base_hz(voice, float(measured.stdout))


def natural_hz(voice: str) -> float:
    """Return the median pitch of a sentence of a voice, NaN if it has none; see ``speak`` for its reproducibility."""
    sound = _synthesised(_synthesiser(voice), SENTENCES["memory"][0])[1]
    track = sound.to_pitch(pitch_floor=50.0, pitch_ceiling=500.0).selected_array["frequency"]
    return float(np.median(track[track > 0])) if track.any() else np.nan


def _base_hz(voice: str, natural: float) -> float:
    """Return the natural pitch of a voice, limited so that all patterns stay in the range of speech."""
    if np.isnan(natural):
        raise UserError(f"config: studio.actors: voice '{voice}' has no pitch; {KNOWN_VOICES}")
    spoken = [value for pattern in PATTERNS for value in pattern.pitch_st]
    lowest, highest = LOWEST_HZ * 2.0 ** (-min(spoken) / 12.0), HIGHEST_HZ * 2.0 ** (-max(spoken) / 12.0)
    return round(min(max(natural, lowest), highest), 1)


def _synthesiser(voice: str) -> parselmouth.Data:
    try:
        synthesiser = call("Create SpeechSynthesizer", LANGUAGE, voice)
    except parselmouth.PraatError as error:
        raise UserError(
            f"config: studio.actors: Praat's synthesiser has no voice '{voice}'; {KNOWN_VOICES}"
        ) from error
    call(synthesiser, "Speech output settings", RATE_HZ, 0.01, 1.0, 1.0, WORDS_PER_MINUTE, "IPA")
    return synthesiser


def _synthesised(synthesiser: parselmouth.Data, text: str) -> tuple[parselmouth.TextGrid, parselmouth.Sound]:
    grid, sound = call(synthesiser, "To Sound", text, "yes")
    return grid, sound


def _words(voice: str, scenario: str, rng: np.random.Generator) -> Iterator[Word]:
    """Yield the words of the story without its pauses, starting at a random sentence and repeating endlessly."""
    synthesiser = _synthesiser(voice)
    story = SENTENCES[scenario]
    spoken: dict[int, list[Word]] = {}
    place = int(rng.integers(len(story)))
    while True:
        if place not in spoken:
            spoken[place] = _cut(*_synthesised(synthesiser, story[place]))
        yield from spoken[place]
        place = (place + 1) % len(story)


def _cut(grid: parselmouth.TextGrid, sound: parselmouth.Sound) -> list[Word]:
    """Return the words of a synthesised sentence."""
    samples = sound.values[0]
    vowels_s = np.array(
        [(start + end) / 2 for start, end, label in intervals(grid, PHONEME_TIER) if label[0] in VOWELS]
    )
    words = []
    for start_s, end_s, _ in intervals(grid, WORD_TIER):
        own_s = vowels_s[(vowels_s > start_s) & (vowels_s < end_s)] - start_s
        words.append(Word(samples[round(start_s * RATE_HZ) : round(end_s * RATE_HZ)], own_s))
    return words


def intervals(grid: parselmouth.TextGrid, tier: int) -> Iterator[tuple[float, float, str]]:
    """Yield start and end in seconds and the label of each labelled interval of a tier."""
    for interval in range(1, call(grid, "Get number of intervals", tier) + 1):
        label = call(grid, "Get label of interval", tier, interval).strip()
        if label:
            start_s = call(grid, "Get start time of interval", tier, interval)
            yield start_s, call(grid, "Get end time of interval", tier, interval), label


def _stretches(prosody: pd.DataFrame, words: Iterator[Word], peaks_s: Floats | None) -> Iterator[Stretch]:
    """Yield the stretches of speech between pauses, each with the words that fit its length, or its syllables, best.

    Parameters
    ----------
    peaks_s : peaks of the syllables of the record, one for each vowel, or None.
    """
    for start_s, end_s in stretches(prosody).tolist():
        own_s = None if peaks_s is None else peaks_s[(peaks_s >= start_s) & (peaks_s < end_s)] - start_s
        chosen = _by_length(words, (end_s - start_s) * RATE_HZ) if own_s is None else _by_vowels(words, len(own_s))
        begins_s = np.cumsum([0, *(len(word.samples) for word in chosen[:-1])]) / RATE_HZ
        vowels_s = np.concatenate([start + word.vowels_s for start, word in zip(begins_s, chosen, strict=True)])
        yield Stretch(start_s, end_s, np.concatenate([word.samples for word in chosen]), vowels_s, own_s)


def _by_length(words: Iterator[Word], room: float) -> list[Word]:
    """Return the number of words that fits a number of samples best."""
    chosen = [next(words)]
    # Add words until the remaining room is less than half a word.
    while sum(len(word.samples) for word in chosen) + len(chosen[-1].samples) / 2 < room:
        chosen.append(next(words))
    return chosen


def _by_vowels(words: Iterator[Word], n_vowels: int) -> list[Word]:
    """Return words with ``n_vowels`` vowels in all; a word with too many is left out."""
    chosen: list[Word] = []
    room = n_vowels
    for word in islice(words, LONGEST_SEARCH * n_vowels):
        if 0 < len(word.vowels_s) <= room:
            chosen.append(word)
            room -= len(word.vowels_s)
        if room == 0:
            return chosen
    raise RuntimeError(f"the story has no words with {n_vowels} vowels")


def _with_pitch(
    stretch: Stretch, planted: Plan, length: int
) -> tuple[Floats, Callable[[Floats], npt.NDArray[np.bool_]]]:
    """Return the words of a stretch at its length and with its pitch, (length,), and a function of voiced times."""
    tempo = _tempo(stretch, length)
    words = parselmouth.Sound(stretch.words, RATE_HZ)
    manipulation = call(words, "To Manipulation", 0.01, *VOICE_RANGE_HZ)
    pulses_s = call(call(manipulation, "Extract pulses"), "To Matrix").values[0]
    call([manipulation, _pitch_tier(stretch, planted, tempo, words.duration)], "Replace pitch tier")
    duration = _duration_tier(tempo, words.duration)
    call([manipulation, duration], "Replace duration tier")
    spoken = call(manipulation, "Get resynthesis (overlap-add)").values[0]

    def is_voiced(times_s: Floats) -> npt.NDArray[np.bool_]:
        edges = np.concatenate([[-np.inf], pulses_s, [np.inf]])
        after = np.searchsorted(edges, tempo.words(times_s - stretch.start_s), side="right")
        return edges[after] - edges[after - 1] <= LONGEST_PERIOD_S

    return np.pad(spoken, (0, max(0, length - len(spoken))))[:length], is_voiced


def _tempo(stretch: Stretch, length: int) -> Tempo:
    """Return the tempo at which the words of a stretch have ``length`` samples, and their vowels the wanted times."""
    words_s = len(stretch.words) / RATE_HZ
    if stretch.peaks_s is None:
        even = float(np.clip(length / len(stretch.words), *TEMPO))
        return Tempo(np.array([0.0, words_s]), np.array([0.0, words_s * even]), np.array([even]))
    knots_s = np.concatenate([[0.0], stretch.vowels_s, [words_s]])
    wanted_s = np.concatenate([stretch.peaks_s, [length / RATE_HZ]])
    spoken_s, factors = [0.0], []
    for span_s, wanted in zip(np.diff(knots_s), wanted_s, strict=True):
        factors.append(float(np.clip((wanted - spoken_s[-1]) / span_s, *LENGTHENING)))
        spoken_s.append(spoken_s[-1] + factors[-1] * span_s)
    return Tempo(knots_s, np.array(spoken_s), np.array(factors))


def _duration_tier(tempo: Tempo, duration_s: float) -> parselmouth.Data:
    """Return the tempo as a duration tier of Praat, which interpolates between points."""
    tier = call("Create DurationTier", "tempo", 0.0, duration_s)
    call(tier, "Add point", 0.0, float(tempo.factors[0]))
    for knot_s, before, after in zip(tempo.words_s[1:-1], tempo.factors, tempo.factors[1:], strict=False):
        call(tier, "Add point", float(knot_s) - KNOT_S, float(before))
        call(tier, "Add point", float(knot_s), float(after))
    return tier


def _pitch_tier(stretch: Stretch, planted: Plan, tempo: Tempo, duration_s: float) -> parselmouth.Data:
    """Return the planted pitch as a pitch tier of Praat, over the words at their original tempo."""
    steps = max(1, int(duration_s / PITCH_STEP_S))
    source_s = frame_times(steps, 1.0 / PITCH_STEP_S)
    course = parselmouth.Sound(planted.pitch_at(stretch.start_s + tempo.spoken(source_s)), 1.0 / PITCH_STEP_S)
    return call(call(call(course, "Down to Matrix"), "To Pitch"), "Down to PitchTier")


def _with_intensity(spoken: Floats, intensity_db: Floats) -> Floats:
    """Return the speech with its level over a syllable set to the planted intensity, and with faded edges."""
    width = round(SYLLABLE_S * RATE_HZ)
    power = _running_mean(_running_mean(spoken**2, width // 2), width // 2)
    # The floor is not zero because the words may be shorter than the stretch.
    softest = 10.0 ** (-DEEPEST_DB / 10.0) * power.mean() + 1e-12
    own_db = 10.0 * np.log10(np.maximum(power, softest))
    place = np.arange(len(spoken))
    edge = np.clip((np.minimum(place, place[::-1]) + 1) / (EDGE_S * RATE_HZ), 0.0, 1.0)
    return spoken * 10.0 ** ((intensity_db - own_db) / 20.0) * (0.5 - 0.5 * np.cos(np.pi * edge))


def _running_mean(values: Floats, width: int) -> Floats:
    """Return the centred running mean over ``width`` values, over fewer near the ends."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    place = np.arange(len(values))
    first, last = np.maximum(place - width // 2, 0), np.minimum(place + width - width // 2, len(values))
    return (total[last] - total[first]) / (last - first)
