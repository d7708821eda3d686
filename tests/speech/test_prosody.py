"""Prosody features compared with the printed equations, sounds of known pitch, and Praat's pitch tracker."""

from pathlib import Path

import numpy as np
import parselmouth
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st
from parselmouth.praat import call

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.speech import prosody

SETTINGS = {"frame_s": 0.025, "window_s": 0.05, "pitch_min_hz": 60, "pitch_max_hz": 400}
RATE = 16000
VOICED = 0.4
FIFTH = 12 * np.log2(1.2)  # threshold of a gross pitch error in semitones: off by more than a fifth

LIBRIVOX = Path(__file__).parents[3] / "shared/data/librivox"
SENTENCES = (
    "Merhaba arkadaşlar, bugün size çok güzel bir hikaye anlatacağım.",
    "Eski zamanlarda küçük bir köyde yaşlı bir adam yaşarmış, her sabah erkenden kalkarmış.",
)


def pulses(f0, seconds=1.0, rate=RATE, seed=0):
    """A voice-like train of decaying pulses of pitch f0 (Hz), with a little noise."""
    time = np.arange(int(seconds * rate)) / rate
    phase = (time * f0) % 1.0 / f0
    noise = np.random.default_rng(seed).normal(0, 0.001, len(time))
    return 0.3 * np.exp(-phase * 300) * np.cos(2 * np.pi * 700 * phase) + noise


def semitones(frames, f0):
    return 12 * np.log2(1 / (frames.lag_s * f0))


def reference_frame(samples, rate, k):
    """Eq. 4.3 and 4.4 for frame k with plain loops: log energy, and r at each lag of the range."""
    width, centre = round(0.05 * rate), round((k + 0.5) * 0.025 * rate)
    window = samples[max(centre - width // 2, 0) : max(centre - width // 2 + width, 0)]
    s = window - window.mean()
    intensity = np.log(sum(value**2 for value in s) / len(s))
    r = {}
    for lag in range(int(np.ceil(rate / 400)), int(rate / 60) + 1):
        product = sum(s[i] * s[i - lag] for i in range(lag, len(s)))
        r[lag] = product / np.sqrt(sum(s**2) * sum(s**2))
    return intensity, r


def test_intensity_lag_and_gain_match_the_printed_equations():
    samples = pulses(143.0, 0.3, seed=3) + 0.02
    frames = prosody.measure(samples, RATE, **SETTINGS)
    for k in (2, 5, 9):
        intensity, r = reference_frame(samples, RATE, k)
        best = max(r, key=r.get)
        assert frames.intensity_log[k] == pytest.approx(intensity, rel=1e-12)
        assert frames.lag_s[k] * RATE == pytest.approx(
            best, abs=0.5
        )  # interpolated, but never beyond the next sample
        assert r[best] <= frames.gain[k] + 1e-12
        assert frames.gain[k] == pytest.approx(r[best], abs=0.02)  # the most that the parabola adds here


@pytest.mark.parametrize("rate", [8000, 16000, 44100])
@pytest.mark.parametrize("f0", [65, 90, 131, 200, 277, 390])
def test_a_known_pitch_is_found_without_octave_errors(f0, rate):
    frames = prosody.measure(pulses(f0, rate=rate), rate, **SETTINGS)
    inner = semitones(frames, f0)[2:-2]
    # at 8 kHz and 390 Hz, a quarter of a sample is 0.2 semitones
    assert np.abs(inner).max() < 0.25
    assert (frames.gain[2:-2] > VOICED).all()


def test_a_pure_tone_is_found_up_to_the_bias_of_the_window():
    for f0 in (100, 150, 220, 350):
        tone = 0.3 * np.sin(2 * np.pi * f0 * np.arange(RATE) / RATE)
        frames = prosody.measure(tone, RATE, **SETTINGS)
        omega, width = 2 * np.pi * f0, 0.05
        # the maximum of (1 - lag / width) cos(omega lag), to first order
        biased = 1 / f0 - 1 / (width * omega**2 * (1 - 1 / (f0 * width)))
        assert frames.lag_s[3:-3] == pytest.approx(biased, rel=0.01)
        assert frames.gain[3:-3] == pytest.approx(1 - biased / width, abs=0.03)


def praat_pitch(samples, rate, times_s):
    pitch = parselmouth.Sound(samples, rate).to_pitch_ac(time_step=0.005, pitch_floor=60, pitch_ceiling=400)
    return np.array([pitch.get_value_at_time(time) for time in times_s])


def compare_with_praat(samples, rate):
    """Number of frames voiced for both, gross errors among them, |semitones| of the others, agreement on voicing."""
    frames = prosody.measure(samples, rate, **SETTINGS)
    theirs = praat_pitch(samples, rate, (np.arange(len(frames.gain)) + 0.5) * 0.025)
    ours = frames.gain > VOICED
    both = ours & ~np.isnan(theirs)
    off = np.abs(12 * np.log2(1 / (frames.lag_s[both] * theirs[both])))
    return both.sum(), (off > FIFTH).sum(), off[off <= FIFTH], (ours == ~np.isnan(theirs)).mean()


@pytest.mark.parametrize(("voice", "pitch"), [("Male1", 90), ("Male1", 120), ("Female1", 180), ("Female2", 240)])
def test_praat_agrees_on_synthesised_speech(voice, pitch):
    synthesiser = call("Create SpeechSynthesizer", "Turkish", voice)
    call(synthesiser, "Speech output settings", RATE, 0.01, 1.0, 1.0, 175, "IPA")
    n_both = n_gross = 0
    for sentence in SENTENCES:
        sound = call(synthesiser, "To Sound", sentence, "no")
        manipulation = call(sound, "To Manipulation", 0.01, 60, 400)
        tier = call(manipulation, "Extract pitch tier")
        call(tier, "Multiply frequencies", 0, 100, pitch / call(tier, "Get mean (points)", 0, 0))
        call([manipulation, tier], "Replace pitch tier")
        spoken = call(manipulation, "Get resynthesis (overlap-add)")
        both, gross, off, agreed = compare_with_praat(spoken.values[0], spoken.sampling_frequency)
        n_both, n_gross = n_both + both, n_gross + gross
        assert np.median(off) < 0.15
        assert agreed > 0.75
    assert n_both > 100
    assert n_gross / n_both < 0.03


@pytest.mark.recorded
@pytest.mark.skipif(not LIBRIVOX.is_dir(), reason="needs the real recordings in ../shared/data/librivox")
def test_praat_agrees_on_read_sentences():
    n_both = n_gross = 0
    for path in sorted(LIBRIVOX.glob("*.wav")):
        samples, rate = soundfile.read(path)
        both, gross, off, agreed = compare_with_praat(samples, rate)
        n_both, n_gross = n_both + both, n_gross + gross
        assert np.median(off) < 0.15  # measured 0.07 to 0.09 semitones
        assert agreed > 0.8  # measured 0.84 to 0.90
    assert n_both > 400
    assert n_gross / n_both < 0.01  # measured 0.3 %


def speech_like(seconds=3.0, seed=0):
    """Pulses with a varying pitch, separated by pauses with faint noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * RATE)) / RATE
    cycles = np.cumsum(150 + 30 * np.sin(2 * np.pi * time)) / RATE
    voice = np.exp(-(cycles % 1.0) * 3) * np.cos(2 * np.pi * 4 * (cycles % 1.0))
    return 0.3 * voice * (time % 1.0 < 0.6) + rng.normal(0, 1e-3, len(time))


def table_of(samples):
    frames = prosody.measure(samples, RATE, **SETTINGS)
    statistics = prosody.statistics("a", frames, VOICED)
    return frames, statistics, prosody.features(frames, statistics, 0.025)


def test_features_are_normalised_and_the_raw_values_are_kept():
    _, statistics, table = table_of(speech_like())
    tables.validate(table, "prosody", "features")
    tables.validate(statistics, "prosody_statistics", "statistics")
    assert table["intensity"].mean() == pytest.approx(0, abs=1e-12)
    assert table["intensity"].to_numpy().std() == pytest.approx(1)
    voiced = table["pitch_gain"] > VOICED
    assert table["pitch_lag"][voiced].mean() == pytest.approx(0, abs=1e-15)
    assert (table["lag_s"] - table["pitch_lag"]).to_numpy() == pytest.approx(statistics["lag_mean_s"].iloc[0])
    assert table["time_s"].iloc[0] == pytest.approx(0.0125)
    for name in prosody.FEATURES:
        assert table[f"d_{name}"].iloc[0] == 0
        accumulated = (table[name] - table[name].iloc[0]).to_numpy()
        assert np.cumsum(table[f"d_{name}"].to_numpy()) == pytest.approx(accumulated, abs=1e-12)


def test_loudness_has_no_effect():
    _, _, table = table_of(speech_like())
    _, _, louder = table_of(2.5 * speech_like())
    for name in table.columns.difference(["intensity_log"]):
        assert louder[name].to_numpy() == pytest.approx(table[name].to_numpy(), abs=1e-9)


@pytest.mark.parametrize("shift", [0.01, 0.05, -0.3])
def test_a_constant_offset_has_no_effect(shift):
    frames, offset = (prosody.measure(speech_like() + added, RATE, **SETTINGS) for added in (0.0, shift))
    for before, after in zip(frames, offset, strict=True):
        assert after == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize(
    "drift", [lambda time: 0.05 * np.sin(2 * np.pi * 0.05 * time), lambda time: 0.05 * (time > 1.3)]
)
def test_a_slow_drift_or_a_step_of_the_offset_hardly_changes_the_intensity(drift):
    samples = speech_like(4.0)
    _, _, table = table_of(samples)
    _, _, drifted = table_of(samples + drift(np.arange(len(samples)) / RATE))
    assert np.corrcoef(table["intensity"], drifted["intensity"])[0, 1] > 0.995
    assert np.corrcoef(table["d_intensity"], drifted["d_intensity"])[0, 1] > 0.98


def test_processing_in_blocks_does_not_change_the_result():
    samples = speech_like(8.0)
    whole = prosody.measure(samples, RATE, **SETTINGS)
    assert len(whole.gain) > 2 * prosody.BLOCK_FRAMES
    middle = prosody.measure(samples[RATE * 2 : RATE * 5], RATE, **SETTINGS)
    for long, short in zip(whole, middle, strict=True):
        assert long[82:118] == pytest.approx(short[2:38], abs=1e-12)


def test_digital_silence_has_no_lag_zero_gain_and_finite_intensity():
    samples = speech_like()
    samples[RATE : 2 * RATE] = 0
    frames, _, table = table_of(samples)
    assert np.isnan(frames.lag_s[45:75]).all()
    assert (frames.gain[45:75] == 0).all()
    assert np.isfinite(frames.intensity_log).all()
    tables.validate(table, "prosody", "features")
    assert (table["pitch_lag"][45:75] == 0).all()


@pytest.mark.parametrize("samples", [np.zeros(RATE), np.random.default_rng(0).normal(0, 0.1, RATE)])
def test_a_record_without_a_voiced_frame_is_rejected(samples):
    with pytest.raises(UserError, match=r"record 'x'.*voiced"):
        prosody.statistics("x", prosody.measure(samples, RATE, **SETTINGS), VOICED)


def test_a_window_too_short_for_the_pitch_range_is_rejected():
    with pytest.raises(UserError, match="window"):
        prosody.measure(np.ones(RATE), RATE, **SETTINGS | {"pitch_min_hz": 19})
    with pytest.raises(UserError, match="less than one frame"):
        prosody.measure(np.ones(100), RATE, **SETTINGS)


@settings(max_examples=50, deadline=None)
@given(st.integers(400, 9000), st.integers(0, 2**32 - 1))
def test_any_sound_has_one_frame_per_25_ms_and_bounded_values(length, seed):
    samples = np.random.default_rng(seed).uniform(-1, 1, length)
    frames = prosody.measure(samples, RATE, **SETTINGS)
    assert len(frames.gain) == length // 400
    assert np.isfinite(frames.intensity_log).all()
    assert (np.abs(frames.gain) <= 1).all()
    # the peak lies in the range, or up to one sample outside if the limit itself is the peak
    assert ((frames.lag_s > 0.0025 - 1 / RATE) & (frames.lag_s < 1 / 60 + 1 / RATE)).all()


@pytest.mark.parametrize("frame_s", [0.025, 0.06, 0.0333])
@pytest.mark.parametrize("chunk", [1, 37, 400, 100_000])
def test_a_stream_measures_the_frames_of_the_whole_sound_to_the_last_bit(frame_s, chunk):
    how = SETTINGS | {"frame_s": frame_s}
    for length in (300, 960, 8000 if chunk == 1 else 41_234):
        samples = speech_like(3.0)[:length] + 0.01 * np.random.default_rng(length).normal(size=length)
        stream = prosody.Stream(RATE, **how)
        parts = [stream.push(samples[first : first + chunk]) for first in range(0, length, chunk)]
        heard = [np.concatenate(values) for values in zip(*parts, stream.finish(), strict=True)]
        n_frames = int(length / (frame_s * RATE) + 1e-6)
        expected = prosody.measure(samples, RATE, **how) if n_frames else (np.empty(0),) * 3
        assert len(heard[0]) == n_frames
        assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(heard, expected, strict=True))
