"""Measure the syllables of a stream: delay, accuracy and processing time: python bench/syllables.py

Voices of the studio speak ten minutes (sentences of the synthesiser, whose phone times are known), with faint noise.
If the LibriVox sentences are present in ../shared/data, they are measured too.

- A voiced syllable is right if its peak lies in a vowel or within 50 ms of it, and each counts once (F1). The delay
  lasts from the peak of a voiced syllable until it is known.
- The processor time is that of one push of 25 ms, garbage collection included. *Best of five* takes the best of five
  passes of each push: what remains when neither other programs nor garbage collection disturb. Goal: 60 us at the
  99th percentile.
- Praat computes pitch and intensity of the same sound with whole-recording methods, for comparison.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import parselmouth
import soundfile
from parselmouth.praat import call

from cospeech.data.arrays import Floats
from cospeech.speech import syllables
from cospeech.studio import voice
from cospeech.studio.sentences import SENTENCES

RATE_HZ, CHUNK, SECONDS, TOLERANCE_S, SEED = 16000, 400, 600, 0.05, 2012
VOICES = ("Female1", "Female2", "Female3", "Female4", "Male1", "Male2", "Male3", "Male4")
STUDIO_VOWELS = set("aeiouyæøɛɪɯʊ")
LIBRIVOX = Path(__file__).parents[2] / "shared/data/librivox"
LIBRIVOX_VOWELS = {"AA", "AE", "AH", "AO", "AW", "AY", "EH", "ER", "EY", "IH", "IY", "OW", "OY", "UH", "UW"}
PHONES = 4

Take = tuple[Floats, list[tuple[float, float]]]
"""Samples, and the start and end of each vowel in seconds."""


def studio(name: str, rng: np.random.Generator) -> list[Take]:
    """Return sentences of a voice."""
    synthesiser = call("Create SpeechSynthesizer", voice.LANGUAGE, name)
    call(synthesiser, "Speech output settings", RATE_HZ, 0.01, 1.0, 1.0, voice.WORDS_PER_MINUTE, "IPA")
    takes = []
    for sentence in SENTENCES["memory"]:
        grid, sound = call(synthesiser, "To Sound", sentence, "yes")
        vowels = []
        for n in range(1, call(grid, "Get number of intervals", PHONES) + 1):
            if call(grid, "Get label of interval", PHONES, n)[:1] in STUDIO_VOWELS:
                edges = (call(grid, f"Get {edge} time of interval", PHONES, n) for edge in ("start", "end"))
                vowels.append(tuple(edges))
        samples = sound.values[0]
        takes.append((samples + 1e-3 * rng.normal(size=len(samples)), vowels))
    return takes


def librivox() -> list[Take]:
    """Return the sentences of LibriVox; none if they are not present."""
    takes = []
    for path in sorted(LIBRIVOX.glob("*.wav")):
        words = json.loads(path.with_suffix(".phone.json").read_text())["w"]
        phones = [phone for word in words for phone in word["w"]]
        vowels = [(phone["b"], phone["b"] + phone["d"]) for phone in phones if phone["t"] in LIBRIVOX_VOWELS]
        takes.append((soundfile.read(path)[0], vowels))
    return takes


def n_right(peaks_s: Sequence[float], vowels: list[tuple[float, float]]) -> int:
    """Return how many vowels have a peak of their own."""
    left, n = sorted(peaks_s), 0
    for start_s, end_s in sorted(vowels, key=lambda vowel: vowel[1]):
        inside = [peak for peak in left if start_s - TOLERANCE_S <= peak < end_s + TOLERANCE_S]
        if inside:
            left.remove(inside[0])
            n += 1
    return n


def report(name: str, takes: list[Take]) -> None:
    """Print F1 and delay of some takes."""
    right = found = true = 0
    delays_s: list[float] = []
    for samples, vowels in takes:
        voiced = [one for one in syllables.find(samples, RATE_HZ) if not np.isnan(one.f0_hz)]
        right += n_right([one.peak_s for one in voiced], vowels)
        found, true = found + len(voiced), true + len(vowels)
        delays_s += [one.known_s - one.peak_s for one in voiced]
    median, p90 = 1000 * np.quantile(delays_s, [0.5, 0.9])
    f1 = 2 * right / (found + true)
    print(f"{name:10} {true:7} {f1:6.3f} {right / found:10.2f} {right / true:7.2f} {median:10.0f} {p90:9.0f}")


def passes(samples: Floats, n: int) -> Floats:
    """Return the processor time of each push in us, (n passes, pushes)."""
    chunks = [samples[first : first + CHUNK] for first in range(0, len(samples) - CHUNK + 1, CHUNK)]
    times = np.empty((n, len(chunks)))
    for row in times:
        stream = syllables.Stream(RATE_HZ)
        for place, chunk in enumerate(chunks):
            begin = time.thread_time_ns()
            stream.push(chunk)
            row[place] = (time.thread_time_ns() - begin) / 1000
    return times


def main() -> None:
    """Print accuracy and delay of each voice, then processing times."""
    rng = np.random.default_rng(SEED)
    spoken = {name: studio(name, rng) for name in VOICES}
    print("sound       vowels     F1  precision  recall  delay p50  p90 (ms)")
    for name, takes in ({"LibriVox": librivox()} | spoken).items():
        if takes:
            report(name, takes)
    sound = np.concatenate([samples for takes in spoken.values() for samples, _ in takes])
    sound = np.resize(sound, SECONDS * RATE_HZ)
    times = passes(sound, 5)
    print(f"\nprocessor time per 25 ms of sound, {times.shape[1]} pushes, in us: median, 99th, 99.9th percentile")
    for title, row in (("one pass", times[0]), ("best of five", times.min(axis=0))):
        print(f"{title:13}" + "".join(f"{value:8.1f}" for value in np.quantile(row, [0.5, 0.99, 0.999])))
    praat = parselmouth.Sound(sound, RATE_HZ)
    begin = time.process_time()
    praat.to_pitch_ac(time_step=0.005, pitch_floor=60, pitch_ceiling=500)
    praat.to_intensity(minimum_pitch=60, time_step=0.005)
    praat_s = time.process_time() - begin
    begin = time.process_time()
    syllables.find(sound, RATE_HZ)
    ours_s = time.process_time() - begin
    ratio = praat_s / ours_s
    print(f"\n{SECONDS} s of sound: {ours_s:.2f} s; Praat's pitch and intensity: {praat_s:.2f} s, {ratio:.0f} times")


if __name__ == "__main__":
    main()
