"""What is heard: the same as offline, whatever the chunks, and robust against wrong samples."""

import gc
import tracemalloc

import numpy as np
import pandas as pd
import pytest
import soxr

from cospeech import api
from cospeech.formats import sound
from cospeech.live.hearing import RECENT_S, Hearing
from cospeech.speech import prosody, syllables
from cospeech.synthesis import live
from cospeech.synthesis.interface import Speech

SETTINGS = api.default_settings()["speech"]
SIZES = [1, 37, 400, 100_000]


@pytest.fixture(scope="module")
def clusters():
    return api.load_model().prosody_model


def listen(samples, size, clusters, needs=("syllables",), rate_hz=16000):
    """All frames, and what hears them."""
    hearing = Hearing(rate_hz, needs, SETTINGS, clusters)
    frames = []
    for first in range(0, len(samples), size):
        frames += list(hearing.push(samples[first : first + size]))
    return frames + list(hearing.finish()), hearing


def same(frames, others):
    """Whether two sequences of frames are equal; NaN equals NaN."""
    assert [(one.frame, one.time_s, one.label, len(one.syllables)) for one in frames] == [
        (one.frame, one.time_s, one.label, len(one.syllables)) for one in others
    ]
    numbers = [
        np.array([list(syllable.values()) for one in heard for syllable in one.syllables])
        for heard in (frames, others)
    ]
    return np.array_equal(*numbers, equal_nan=True)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("length", [159_999, 160_000, 32_123])
def test_frames_and_syllables_are_those_of_the_recording(samples, clusters, size, length):
    spoken = samples[:length] if size > 1 else samples[16_000 : 16_000 + length // 4]
    frames, hearing = listen(spoken, size, clusters)
    found = syllables.table("stream", syllables.find(spoken, 16000))
    offline = Speech("stream", 0.025, len(spoken) // 400, syllables=found)
    assert same(frames, list(live.frames(offline)))
    assert (hearing.n_samples, hearing.n_frames) == (len(spoken), len(frames))
    known = [syllable for one in frames for syllable in one.syllables]
    assert all(set(syllable) == set(found.columns) - {"record"} for syllable in known)
    assert len(found) - len(known) <= 2  # the end reveals the others


def test_nothing_is_heard_before_its_time(samples, clusters):
    hearing = Hearing(16000, ("syllables",), SETTINGS, clusters)
    for n, sample in enumerate(samples[:16000], start=1):
        for heard in hearing.push(np.array([sample])):
            assert n == 400 * (heard.frame + 1)
            assert all(syllable["known_s"] <= n / 16000 for syllable in heard.syllables)


@pytest.mark.parametrize("rate_hz", [8000, 44100, 48000])
def test_another_rate_gives_the_same_in_all_chunks_and_nearly_the_recording(samples, clusters, rate_hz):
    spoken = soxr.resample(samples[:80_000], 16000, rate_hz, quality="VHQ")
    frames, hearing = listen(spoken, 441, clusters, rate_hz=rate_hz)
    other, _ = listen(spoken, 100_000, clusters, rate_hz=rate_hz)
    assert same(frames, other)
    recording = sound.mixed("x.wav", iter([spoken[:, None]]), rate_hz, 1).samples
    assert abs(hearing.n_samples - len(recording)) <= 1
    found = syllables.find(recording, 16000)
    peaks_s = [syllable["peak_s"] for one in frames for syllable in one.syllables]
    known = [one.peak_s for one in found if one.known_s <= len(frames) * 0.025]
    assert len(peaks_s) == len(known)
    assert np.abs(np.array(peaks_s) - known).max() < 0.011


def test_samples_that_are_not_finite_or_too_loud_are_silence_and_full_scale(samples, clusters):
    wrong = samples[:48_000].copy()
    wrong[[5, 700, 20_000]] = np.nan, np.inf, -np.inf
    wrong[30_000:30_020] = 5.0
    mended = wrong.copy()
    mended[[5, 700, 20_000]] = 0.0
    mended[30_000:30_020] = 1.0
    before = wrong.copy()
    frames, hearing = listen(wrong, 1000, clusters)
    np.testing.assert_array_equal(wrong, before)
    assert same(frames, listen(mended, 1000, clusters)[0])
    assert hearing.troubles == (3, 20)


@pytest.mark.parametrize("size", SIZES)
def test_prosody_is_that_of_the_recording_but_for_its_normalisation(samples, clusters, size):
    spoken = samples if size > 1 else samples[16_000:40_000]
    hearing = Hearing(16000, ("prosody", "prosody_labels"), SETTINGS, clusters)
    latest = []
    for first in range(0, len(spoken), size):
        for heard in hearing.push(spoken[first : first + size]):
            assert hearing.recent.n_heard == heard.frame + 1
            if heard.frame % 20 == 19:
                latest.append(hearing.recent.latest(True))
    frames = list(hearing.finish())
    assert (frames[-1].frame + 1 if frames else hearing.n_frames) == len(spoken) // 400
    # the statistics at the end are those of the recording
    expected = api.prosody(spoken)
    pd.testing.assert_frame_equal(hearing.recent.table(), expected, check_exact=True)
    how = {key: value for key, value in SETTINGS.items() if key != "voiced_gain"}
    measured = prosody.measure(spoken, 16000, **how)
    for place, (label, features) in enumerate(latest):
        number = 20 * place + 19
        assert label in ("", *clusters.labels)
        if label:
            assert features["intensity_log"] == measured.intensity_log[number]
            table = prosody.features(
                prosody.Frames(*(values[: number + 1] for values in measured)),
                prosody.statistics(
                    "x", prosody.Frames(*(v[: number + 1] for v in measured)), SETTINGS["voiced_gain"]
                ),
                0.025,
            )
            assert features["d_pitch_lag"] == table["d_pitch_lag"].iloc[-1]
    assert latest[-1][0]


def test_before_anybody_speaks_there_is_no_label(clusters):
    hearing = Hearing(16000, ("prosody_labels",), SETTINGS, clusters)
    assert len(list(hearing.push(np.zeros(16000)))) == 39  # the window of the last frame is not complete
    label, features = hearing.recent.latest(True)
    assert label == ""
    assert set(features.values()) == {0.0}


@pytest.mark.parametrize("needs", [("syllables",), ("prosody",)])
def test_memory_does_not_grow_with_silence(clusters, needs):
    hearing = Hearing(16000, needs, SETTINGS, clusters)
    minute = np.zeros(16000)

    def listen_for(seconds):
        return sum(len(list(hearing.push(minute))) for _ in range(seconds))

    tracemalloc.start()
    try:
        listen_for(round(RECENT_S) + 5)
        gc.collect()  # windows of samples refer to themselves
        before, _ = tracemalloc.get_traced_memory()
        assert listen_for(60) == 60 * 40
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 2400 * 4  # less than one number per frame
