"""Formants compared with planted resonances, and with those that Praat finds."""

import numpy as np
import parselmouth
import pytest
from scipy import signal

from cospeech.speech import formants

RATE = 16000


def vowel(resonances_hz, f0=110.0, seconds=1.0, rate=RATE):
    """Pulses of pitch ``f0`` that fall by 6 dB per octave, through resonances of 80 Hz bandwidth."""
    source = np.zeros(int(seconds * rate))
    source[:: round(rate / f0)] = 1.0
    source = signal.lfilter([1.0], [1.0, -np.exp(-2 * np.pi * 50.0 / rate)], source)
    radius = np.exp(-np.pi * 80.0 / rate)
    for resonance in resonances_hz:
        pole = radius * np.exp(2j * np.pi * resonance / rate)
        source = signal.lfilter([1.0], np.poly([pole, pole.conj()]).real, source)
    return source / np.abs(source).max()


def test_burg_finds_the_filter_of_a_process():
    rng = np.random.default_rng(1)
    truth = -np.poly([0.9 * np.exp(0.5j), 0.9 * np.exp(-0.5j), 0.7, -0.6]).real[1:]
    process = signal.lfilter([1.0], np.append(1.0, -truth), rng.standard_normal((3, 20_000)), axis=1)
    np.testing.assert_allclose(formants.burg(process[:, 500:], 4), np.tile(truth, (3, 1)), atol=0.03)


def test_a_window_of_zeros_has_no_formant():
    assert np.isnan(formants.find(np.zeros(RATE), RATE)).all()
    assert formants.find(np.zeros(RATE), RATE).shape == (100, formants.N_FORMANTS)


@pytest.mark.parametrize("planted", [(300, 2300, 3000), (700, 1200, 2600), (500, 1500, 2500)])
def test_planted_resonances_are_found(planted):
    found = formants.find(vowel([*planted, 3700, 4700]), RATE)[10:-10]
    assert np.abs(np.median(found[:, :3], axis=0) / planted - 1).max() < 0.03


@pytest.mark.parametrize("ceiling", [5000.0, 5500.0])
def test_formants_are_those_of_praat(ceiling):
    """Where there are as many resonances as formants, so that no root is left over whose place noise decides."""
    vowels = (((700, 1200, 2600, 3500, 4600), 120), ((350, 2000, 2800, 3600, 4600), 190))
    sound = np.concatenate([vowel(where, f0) for where, f0 in vowels])
    sound += 1e-4 * np.random.default_rng(0).standard_normal(len(sound))
    ours = formants.find(sound, RATE, ceiling)
    praat = parselmouth.Sound(sound, RATE).to_formant_burg(
        time_step=0.01, max_number_of_formants=5, maximum_formant=ceiling, window_length=0.025, pre_emphasis_from=50.0
    )
    times = (np.arange(len(ours)) + 0.5) * 0.01
    theirs = np.array([[praat.get_value_at_time(n + 1, t) for n in range(3)] for t in times])
    steady = (np.abs(times - 0.5) < 0.4) | (np.abs(times - 1.5) < 0.4)
    assert np.nanquantile(np.abs(ours[steady, :3] / theirs[steady] - 1), 0.99) < 0.001
