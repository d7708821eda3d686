"""Features of a planted population: what voice and lips share is a common latent, or one of each without relation."""

import numpy as np
import pandas as pd

from cospeech.identity import features


def smooth(rng, n_frames, n_features, width=9):
    """Gaussian noise of variance 1, smoothed over time."""
    kernel = np.hanning(width + 2)[1:-1]
    kernel /= np.sqrt((kernel**2).sum())
    noise = rng.normal(size=(n_frames + width - 1, n_features))
    return np.stack([np.convolve(column, kernel, "valid") for column in noise.T], axis=1)


def population(seed, shared, speakers=12, repetitions=10, others=5, n_audio=12, n_lips=15, n_latent=4, delay=0,
               nuisance=1.5, own=0.5, n_frames=(60, 90)):  # fmt: skip
    """Features of clips of names.

    The course of a name and a habit of the speaker are planted in a latent of a few dimensions, which is mixed into
    voice and lips below a nuisance that is correlated over features. If it is not shared, the lips have a
    latent of their own, with courses and habits of their own.
    """
    rng = np.random.default_rng(seed)
    mix = {"audio": rng.normal(size=(n_latent, n_audio)), "lips": rng.normal(size=(n_latent, n_lips))}
    spread = {
        side: np.eye(n) + rng.normal(size=(n, n)) / np.sqrt(n) for side, n in (("audio", n_audio), ("lips", n_lips))
    }
    courses = {side: [smooth(rng, 100, n_latent, 25) for _ in range(speakers)] for side in mix}
    habits = {side: own * rng.normal(size=(speakers, n_latent)) for side in mix}
    if shared:
        courses["lips"], habits["lips"] = courses["audio"], habits["audio"]
    rows, sides = [], {"audio": [], "lips": []}
    for speaker in range(speakers):
        said = [(speaker, k) for k in range(repetitions)]
        said += [((speaker + 1 + k) % speakers, 0) for k in range(others)]
        for name, repetition in said:
            length = int(rng.integers(*n_frames))
            places = np.linspace(0, 99, length)
            variation = {side: 0.5 * smooth(rng, length, n_latent) for side in mix}
            if shared:
                variation["lips"] = variation["audio"]
            for side in mix:
                course = np.stack([np.interp(places, np.arange(100), one) for one in courses[side][name].T], axis=1)
                latent = course + habits[side][speaker] + variation[side]
                found = (
                    latent @ mix[side] / np.sqrt(n_latent)
                    + nuisance * smooth(rng, length, len(spread[side])) @ spread[side]
                )
                sides[side].append(np.roll(found, delay, axis=0) if side == "audio" else found)
            rows.append({"clip": f"s{speaker:02}_{name:02}_{repetition}", "speaker": f"s{speaker:02}",
                         "phrase": f"name{name:02}", "repetition": repetition, "session": None,
                         "own_name": name == speaker, "delay_planted_s": delay / 100})  # fmt: skip
    return features.joined(pd.DataFrame(rows), sides["audio"], sides["lips"])
