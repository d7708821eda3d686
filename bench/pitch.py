"""Compare the pitch track with the printed features and Praat's defaults: python bench/pitch.py

Each of the studio's voices speaks for 40 s with planted pitch. The table shows gross errors among the frames that are
voiced and taken as voiced, and errors of voicing among all frames, in per cent; once as recorded, and once with white
noise 20 dB below the speech.
"""

from __future__ import annotations

import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pandas as pd
import parselmouth

from cospeech.evaluation import pitch as comparison
from cospeech.evaluation import recovery
from cospeech.speech import pitch, prosody
from cospeech.studio import cast, script, voice

SECONDS, FRAME_S, VOICED, SEED = 40.0, 0.025, 0.4, 2012
VOICES = ("Female1", "Female2", "Female3", "Female4", "Male1", "Male2", "Male3", "Male4")
NOISE_DB = -20.0


def take(name: str) -> tuple[np.ndarray, pd.DataFrame]:
    """Return the sound of a voice and its planted prosody; only reproducible in a process of its own."""
    phrases = script.write(cast.member(name, SEED, FRAME_S, 10.0), name, SECONDS, 0.8, FRAME_S, SEED)[1]
    return voice.speak(name, phrases, name, "memory", FRAME_S, SEED)


def errors(samples: np.ndarray, planted: pd.DataFrame) -> dict[str, float]:
    """Return the gross and the voicing errors of each method in per cent, and the seconds that tracking took."""
    rate_hz = voice.RATE_HZ
    frames = prosody.measure(samples, rate_hz, frame_s=FRAME_S, window_s=0.05, pitch_min_hz=60, pitch_max_hz=400)
    printed = prosody.features(frames, prosody.statistics("x", frames, VOICED), FRAME_S)
    started = time.perf_counter()
    ours = pitch.table(pitch.track(samples, rate_hz))
    took_s = time.perf_counter() - started
    praat = parselmouth.Sound(samples, rate_hz).to_pitch()
    default = ours.assign(f0_hz=[praat.get_value_at_time(time_s) for time_s in ours["time_s"]])
    found = {row["quantity"]: row["value"] for row in recovery.pitch(planted, printed, VOICED)}
    row = {"gain gross": found["pitch_gross_errors"]}
    for method, table in (("Praat", default), ("track", ours)):
        found = {row["quantity"]: row["value"] for row in comparison.errors(planted, printed, VOICED, table)}
        row["gain voicing"] = found["voicing_errors"]
        row[f"{method} gross"], row[f"{method} voicing"] = found["track_gross_errors"], found["track_voicing_errors"]
    return {name: 100 * value for name, value in row.items()} | {"track s": took_s}


def main() -> None:
    """Print the errors of each voice, and their means."""
    rng = np.random.default_rng(SEED)
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=fresh, max_tasks_per_child=1) as processes:
        takes = dict(zip(VOICES, processes.map(take, VOICES), strict=True))
    for title, level_db in (("as recorded", None), (f"with noise of {NOISE_DB:g} dB", NOISE_DB)):
        rows = {}
        for name, (samples, planted) in takes.items():
            level = 0.0 if level_db is None else samples.std() * 10 ** (level_db / 20)
            rows[name] = errors(samples + level * rng.normal(size=len(samples)), planted)
        table = pd.DataFrame(rows).T
        table.loc["mean"] = table.mean()
        print(f"{title}\n{table.round(2).to_string()}\n")


if __name__ == "__main__":
    main()
