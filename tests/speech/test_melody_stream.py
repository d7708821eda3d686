"""The melody of a stream: chunks do not matter, and it is that of a recording but for what only its end can tell."""

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.formats import sound
from cospeech.speech import melody, pitch
from cospeech.speech import melody_kernels as kernels
from cospeech.speech.melody_stream import Stream


@pytest.fixture(scope="module")
def samples(recordings):
    return sound.read(recordings / "speech.wav").samples


def heard(samples, size):
    """The melody of samples that arrive in chunks, (T, 3)."""
    stream = Stream(16000, "x", 1)
    parts = [stream.push(samples[first : first + size]) for first in range(0, len(samples), size)]
    return np.concatenate([*parts, stream.finish()])


def test_chunks_do_not_change_a_bit(samples):
    whole = heard(samples, len(samples))
    assert whole.shape == (1000, 3)
    for size in (37, 777, 100_000):
        np.testing.assert_array_equal(heard(samples, size), whole)
    np.testing.assert_array_equal(heard(samples[40_000:48_001], 1), heard(samples[40_000:48_001], 8001))


@pytest.mark.parametrize("n_samples", [0, 100, 159, 160, 3000, 16_080])
def test_there_is_a_frame_for_every_10_ms(samples, n_samples):
    assert heard(samples[20_000 : 20_000 + n_samples], 500).shape == (n_samples // 160, 3)


def test_pitch_and_intensity_follow_those_of_the_recording(samples):
    table = melody.table("x", pitch.track(samples, 16000).f0_hz, melody.intensity(samples, 16000), seed=1)
    later = table["active"].to_numpy() & (table["time_s"] > 3.0).to_numpy()
    live = heard(samples, 400)
    for column, name in ((0, "pitch"), (2, "intensity")):
        assert np.corrcoef(live[later, column], table.loc[later, name])[0, 1] > 0.9


def entered(f0_hz, db, noise):
    """The melody (T, 3) of measured frames, 0 Hz where unvoiced."""
    memories, rows, row = kernels.memory(), [], np.empty(3)
    for values in zip(f0_hz, db, noise, strict=True):
        if kernels.enter(memories[0], *values, row):
            rows.append(row.copy())
    memories["end"] = len(f0_hz)
    last = np.empty((min(len(f0_hz), kernels.LATER), 3))
    kernels.close(memories, last)
    return np.vstack([*rows, last])


def adapted(values, typical):
    """Deviations of values (T,) from their weighted mean until then, in weighted standard deviations."""
    found = np.empty(len(values))
    for t in range(len(values)):
        weights = np.exp(-0.01 / 60.0) ** np.arange(t, -1, -1)
        mean = np.average(values[: t + 1], weights=weights)
        running = [np.average(values[: k + 1], weights=weights[t - k :]) for k in range(t + 1)]
        before = [0.0, *running[:-1]]
        squares = np.sum(weights * (values[: t + 1] - before) * (values[: t + 1] - running))
        prior = 100.0 * (typical if typical > 1.0 else typical * mean) ** 2
        found[t] = (values[t] - mean) / np.sqrt((squares + prior) / (weights.sum() + 100.0))
    return found


@pytest.mark.parametrize("seed", range(3))
def test_utterances_gaps_smoothing_and_slopes_are_those_of_a_recording(seed):
    rng = np.random.default_rng(seed)
    lengths = rng.integers(1, 45, 14)
    voiced = np.repeat(np.arange(14) % 2 == seed % 2, lengths)
    n_frames = len(voiced)
    f0_hz = np.where(voiced, rng.uniform(140.0, 160.0, n_frames), np.nan)
    db, noise = rng.normal(-30.0, 5.0, n_frames), rng.standard_normal((n_frames, 2))
    active = melody.utterances(voiced)
    assert 0 < active.sum() < n_frames
    expected = noise.copy()
    expected[active, 0] = adapted(melody._smoothed(melody._without_gaps(f0_hz), active)[active], 0.18)
    expected[active, 1] = adapted(db[active], 7.0)
    found = entered(np.nan_to_num(f0_hz), db, noise)
    np.testing.assert_allclose(found[:, [0, 2]], expected, atol=1e-9)
    np.testing.assert_allclose(found[:, 1], melody.slope(expected[:, 0]), atol=1e-9)


def test_the_intensity_is_that_of_the_recording(samples):
    memories, tracks = kernels.memory(), kernels.syllables_kernels.memory()
    rows = np.empty((1001, 3))
    kernels.push(samples[:16_000], tracks, memories, np.zeros((101, 2)), rows)
    n_known = int(memories["n"][0])
    expected = melody.intensity(samples[:32_000], 16000)
    np.testing.assert_allclose(memories["db"][0, np.arange(50, n_known) % kernels.RING], expected[50:n_known])


def test_a_pitch_far_from_that_of_the_speaker_counts_as_unvoiced():
    f0_hz = np.full(400, 100.0)
    f0_hz[[250, 251]] = 60.0, 210.0
    found = entered(f0_hz, np.full(400, -20.0), np.zeros((400, 2)))
    np.testing.assert_allclose(found[:, 0], 0.0, atol=1e-9)
    voice_hz = np.repeat([100.0, 220.0], [1000, 3000])
    another = entered(voice_hz, np.full(4000, -20.0), np.zeros((4000, 2)))[:, 0]
    assert np.abs(another[:1030]).max() < 1e-9
    assert another[1100:].max() > 2.0  # another speaker is accepted after some seconds


def test_another_sampling_rate_is_refused():
    with pytest.raises(UserError, match="melody: the sound has 8000 Hz; resample it to 16000 Hz"):
        Stream(8000, "x", 1)
