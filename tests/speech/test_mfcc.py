"""Mel-frequency cepstral coefficients: against the formulae, against Praat, and on the time grid."""

import numpy as np
import parselmouth
import pytest
from parselmouth.praat import call

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.speech import mfcc

RATE_HZ = 16000


def speech_like(seconds, seed=1):
    """Return a buzz with two moving resonances, in bursts, with noise."""
    rng = np.random.default_rng(seed)
    times_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    phase = 2 * np.pi * np.cumsum(120 + 30 * np.sin(3 * times_s)) / RATE_HZ
    sound = np.zeros(len(times_s))
    for harmonic in range(1, 60):
        hz = 120.0 * harmonic
        first, second = 500 + 250 * np.sin(5 * times_s), 1500 + 600 * np.cos(4 * times_s)
        sound += np.sin(harmonic * phase) * (
            np.exp(-(((hz - first) / 150) ** 2)) + np.exp(-(((hz - second) / 250) ** 2))
        )
    return 0.05 * sound * (0.2 + np.sin(7 * times_s) ** 2) + 1e-3 * rng.standard_normal(len(times_s))


def by_the_formulae(samples):
    """Return the coefficients (T, 13) by their definition, with the defaults of Kaldi."""
    length, shift, size, n_filters = 400, 160, 512, 23
    x = (samples * 32768.0).astype(np.float32).astype(float)

    def mel(hz):
        return 1127.0 * np.log(1.0 + hz / 700.0)

    edges, bins = np.linspace(mel(20.0), mel(RATE_HZ / 2), n_filters + 2), mel(np.arange(size // 2) * RATE_HZ / size)
    rise = (bins - edges[:-2, None]) / np.diff(edges)[:-1, None]
    fall = (edges[2:, None] - bins) / np.diff(edges)[1:, None]
    filters = np.clip(np.minimum(rise, fall), 0.0, None)
    window = (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / (length - 1))) ** 0.85
    cosines = np.sqrt(2 / n_filters) * np.cos(np.pi / n_filters * np.outer(np.arange(13), np.arange(n_filters) + 0.5))
    cosines[0] = np.sqrt(1 / n_filters)
    lifter = 1 + 11 * np.sin(np.pi * np.arange(13) / 22)
    mirrored = np.concatenate([x[::-1], x, x[::-1]])
    frames = []
    for frame in range(int(len(x) / shift + 0.5)):
        start = len(x) + frame * shift + shift // 2 - length // 2
        cut = mirrored[start : start + length] - mirrored[start : start + length].mean()
        cut = (cut - 0.97 * np.concatenate([cut[:1], cut[:-1]])) * window
        power = np.abs(np.fft.rfft(cut, size)[: size // 2]) ** 2
        frames.append(lifter * (cosines @ np.log(filters @ power)))
    return np.array(frames)


def test_coefficients_are_those_of_the_formulae():
    sound = speech_like(1.0)
    np.testing.assert_allclose(mfcc.cepstra(sound, RATE_HZ), by_the_formulae(sound), atol=5e-3)


def test_coefficients_follow_those_of_praat():
    synthesiser = call("Create SpeechSynthesizer", "Turkish", "Female1")
    spoken = call(synthesiser, "To Sound", "Merhaba Ayşe Yılmaz, bugün hava çok güzel", "yes")[1].resample(RATE_HZ)
    sound = spoken.values[0] + 1e-3 * np.random.default_rng(1).standard_normal(spoken.n_samples)
    emphasised = sound - 0.97 * np.concatenate([[0.0], sound[:-1]])
    praat = parselmouth.Sound(emphasised, RATE_HZ).to_mfcc(12, 0.0125, 0.01, 118.0, 118.0)
    theirs = praat.to_array().T
    times_s = praat.x1 + praat.dx * np.arange(len(theirs))
    ours = mfcc.cepstra(sound, RATE_HZ)
    ours = np.array([np.interp(times_s, (np.arange(len(ours)) + 0.5) / 100, one) for one in ours.T]).T
    correlations = [np.corrcoef(one, other)[0, 1] for one, other in zip(ours.T, theirs.T, strict=True)]
    assert min(correlations) > 0.9


def test_a_click_is_in_the_frames_around_it():
    sound = np.full(RATE_HZ, 1e-5)
    sound[8000] = 0.5
    loudest = np.argsort(mfcc.cepstra(sound, RATE_HZ)[:, 0])[-2:]
    assert sorted(loudest) == [49, 50]


def test_derivatives_of_a_parabola_are_exact_away_from_the_ends():
    frames = np.arange(20.0)
    values = np.stack([frames, frames**2], axis=1)
    features = mfcc.with_derivatives(values)
    assert features.shape == (20, 6)
    np.testing.assert_allclose(features[4:-4, 2], 1.0)
    np.testing.assert_allclose(features[4:-4, 3], 2 * frames[4:-4])
    np.testing.assert_allclose(features[4:-4, 4:], [[0.0, 2.0]] * 12, atol=1e-12)


@pytest.mark.parametrize("rate_hz", [8000, 16000, 44100])
def test_there_are_a_hundred_frames_per_second_at_any_rate(rate_hz):
    features = mfcc.coefficients(np.random.default_rng(0).standard_normal(rate_hz) * 0.1, rate_hz)
    assert features.shape == (100, 39)
    tables.validate(mfcc.table("x", features), "mfcc", "x")


def test_less_than_a_frame_is_refused():
    with pytest.raises(UserError, match=r"^0\.001 s of sound is less than one frame; record more$"):
        mfcc.coefficients(np.zeros(16), RATE_HZ)
