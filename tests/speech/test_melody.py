"""The melody compared with formulas written out, with planted contours, and with what the noise must not tell."""

import numpy as np
import parselmouth
import pytest

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.speech import melody, pitch

RATE = 16000


def contour(n_frames=600, seed=0):
    """Pitch of three utterances with short unvoiced gaps, and the intensity of all frames."""
    rng = np.random.default_rng(seed)
    frames = np.arange(n_frames)
    f0_hz = 150.0 + 30.0 * np.sin(frames / 20.0) + rng.normal(0.0, 1.0, n_frames)
    f0_hz[(frames % 200 > 140) | (frames % 50 < 6)] = np.nan
    return f0_hz, np.where(frames % 200 > 140, -60.0, -20.0) + rng.normal(0.0, 2.0, n_frames)


def test_the_table_has_its_schema_and_means_and_deviations_over_utterances():
    table = melody.table("x", *contour(), seed=1)
    tables.validate(table, "melody", "x")
    spoken = table[table["active"]]
    for name in ("pitch", "intensity"):
        assert abs(spoken[name].mean()) < 1e-12
        assert abs(spoken[name].std(ddof=0) - 1) < 1e-12
    np.testing.assert_allclose(table["time_s"], (np.arange(600) + 0.5) * 0.01)


def test_the_slope_is_that_of_equation_4_8():
    values = np.random.default_rng(2).standard_normal(30)
    found = melody.slope(values)
    for k in range(2, 28):
        printed = sum(i * (values[k + i] - values[k - i]) for i in (1, 2)) / (2 * sum(i**2 for i in (1, 2)))
        assert found[k] == pytest.approx(printed)
        assert found[k] == pytest.approx(np.polyfit(np.arange(5), values[k - 2 : k + 3], 1)[0])
    np.testing.assert_allclose(melody.slope(np.arange(10.0))[2:-2], 1.0)


def test_utterances_bridge_short_gaps_and_leave_out_short_voices():
    voiced = np.zeros(200, dtype=bool)
    voiced[[*range(10, 20), *range(40, 60)]] = True  # a gap of 20 frames, just short enough
    voiced[[*range(81, 90)]] = True  # 21 frames later, and 9 frames long
    voiced[[*range(150, 160)]] = True
    expected = np.zeros(200, dtype=bool)
    expected[10:60] = expected[150:160] = True
    np.testing.assert_array_equal(melody.utterances(voiced), expected)
    assert not melody.utterances(np.zeros(10, dtype=bool)).any()
    assert melody.utterances(np.ones(10, dtype=bool)).all()


def test_the_pitch_is_interpolated_within_utterances_and_noise_between_them():
    f0_hz, intensity_db = contour()
    first, second, again = (melody.table("x", f0_hz, intensity_db, seed) for seed in (1, 2, 1))
    assert first.equals(again)
    active = first["active"].to_numpy()
    bridged = active & np.isnan(f0_hz)
    assert bridged.sum() > 20
    assert first["pitch"][bridged].abs().max() < 2.0
    assert np.array_equal(first["pitch"][active], second["pitch"][active])
    assert not np.isclose(first["pitch"][~active], second["pitch"][~active]).any()
    assert not np.isclose(first["pitch"][~active], melody.table("y", f0_hz, intensity_db, 1)["pitch"][~active]).any()
    noise = np.concatenate([melody.table("x", f0_hz, intensity_db, s)["intensity"][~active] for s in range(40)])
    assert abs(noise.mean()) < 0.03
    assert abs(noise.std() - 1) < 0.03


def test_utterances_do_not_mix_in_the_smoothing():
    f0_hz = np.full(200, np.nan)
    f0_hz[:90], f0_hz[120:] = 100.0, 200.0
    table = melody.table("x", f0_hz, np.full(200, -20.0), 0)
    assert set(table.loc[table["active"], "pitch"].round(9)) == {
        round((value - (90 * 100 + 80 * 200) / 170) / np.std([100.0] * 90 + [200.0] * 80), 9) for value in (100, 200)
    }
    assert (table.loc[table["active"], "intensity"] == 0).all()


def test_the_intensity_is_that_of_a_sine_and_of_the_window_written_out():
    time = np.arange(RATE) / RATE
    found = melody.intensity(0.5 * np.sin(2 * np.pi * 1000 * time), RATE)
    assert len(found) == 100
    np.testing.assert_allclose(found[3:-3], 10 * np.log10(0.125), atol=0.01)
    noise = np.random.default_rng(3).standard_normal(4000)
    weights = np.kaiser(512, 20.0)
    for frame in (3, 10, 20):
        centre = round((frame + 0.5) * 0.01 * RATE)
        window = noise[centre - 256 : centre + 256]
        assert melody.intensity(noise, RATE)[frame] == pytest.approx(
            10 * np.log10((window**2 * weights).sum() / weights.sum())
        )
    assert melody.intensity(np.zeros(1600), RATE).max() == melody.FLOOR_DB


def test_the_intensity_follows_that_of_praat():
    rng = np.random.default_rng(4)
    level = np.repeat(rng.uniform(-40, -10, 20), RATE // 10)
    sound = 10 ** (level / 20) * rng.standard_normal(len(level))
    praat = parselmouth.Sound(sound, RATE).to_intensity(minimum_pitch=200, time_step=0.01, subtract_mean=False)
    ours = melody.intensity(sound, RATE)
    theirs = np.interp((np.arange(len(ours)) + 0.5) * 0.01, praat.xs(), praat.values[0])
    assert np.corrcoef(ours[5:-5], theirs[5:-5])[0, 1] > 0.98


def test_a_voice_without_pauses_needs_no_noise_and_silence_is_refused():
    time = np.arange(2 * RATE) / RATE
    voice = np.sign(np.sin(2 * np.pi * (150 * time + 3 * np.sin(2 * np.pi * time)))) * 0.2
    table = melody.table("x", pitch.track(voice, RATE).f0_hz, melody.intensity(voice, RATE), 0)
    assert table["active"].mean() > 0.9
    f0_hz = np.full(300, np.nan)
    f0_hz[:9] = 100.0
    with pytest.raises(UserError, match=r"record 'x': there is no utterance in its 3.0 s of sound, of which 0.1 s"):
        melody.table("x", f0_hz, np.zeros(300), 0)
