"""Simulated features match their schema, follow the planted contours, and resemble features from the sound."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pandas as pd
import pytest

from cospeech.data import segments, tables
from cospeech.speech import prosody as measured
from cospeech.studio import cast, features, script, voice
from cospeech.studio.patterns import NAMES

FRAME_S, SEED, GAIN = 0.025, 2012, 0.4


def phrases(actor, record, duration_s):
    return script.write(cast.member(actor, SEED, FRAME_S, 10.0), record, duration_s, 0.8, FRAME_S, SEED)[1]


@pytest.fixture(scope="module", params=[("ada", "Female1"), ("deniz", "Male1")], ids=["woman", "man"])
def pair(request):
    """Features from the sound, simulated features, and patterns of one record of 60 s."""
    actor, name = request.param
    prosody = phrases(actor, "x", 60.0)
    # In a separate process, like a job: the synthesiser keeps state.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as alone:
        sound, planted = alone.submit(voice.speak, "x", prosody, name, "documentary", FRAME_S, SEED).result()
    frames = measured.measure(sound, voice.RATE_HZ, frame_s=FRAME_S, window_s=0.05, pitch_min_hz=60, pitch_max_hz=400)
    from_sound = measured.features(frames, measured.statistics("x", frames, GAIN), FRAME_S)
    simulated = features.features("x", prosody, voice.base_hz(name), FRAME_S, GAIN, SEED)
    return from_sound, simulated, planted["pattern"].to_numpy()


def test_the_table_matches_its_schema_and_is_normalised():
    simulated = features.features("x", phrases("ada", "x", 60.0), 180.0, FRAME_S, GAIN, SEED)
    tables.validate(simulated, "prosody", "x")
    assert len(simulated) == 2400
    assert simulated["intensity"].mean() == pytest.approx(0, abs=1e-9)
    assert simulated["intensity"].std(ddof=0) == pytest.approx(1)
    voiced = simulated["pitch_gain"] > GAIN
    assert simulated.loc[voiced, "pitch_lag"].mean() == pytest.approx(0, abs=1e-12)
    for name in ("intensity", "pitch_lag", "pitch_gain"):
        np.testing.assert_allclose(simulated[f"d_{name}"], np.diff(simulated[name], prepend=simulated[name].iloc[0]))


def test_a_table_is_reproducible_and_differs_between_records():
    prosody = phrases("ada", "x", 30.0)
    one, again, other = (features.features(name, prosody, 180.0, FRAME_S, GAIN, SEED) for name in ("x", "x", "y"))
    pd.testing.assert_frame_equal(one, again)
    assert (one["intensity"] != other["intensity"]).all()


def test_voiced_frames_follow_the_planted_contours():
    prosody = segments.from_starts("x", [0, 40, 80], ["p3", "p1", "p7"], 1200, 40.0)
    simulated = features.features("x", prosody, 100.0, FRAME_S, GAIN, SEED)
    level = simulated["lag_s"][:40][simulated["pitch_gain"][:40] > GAIN]
    assert 12 * np.log2(0.01 / level.median()) == pytest.approx(4.5, abs=0.2)
    loudness = simulated["intensity_log"] * 10 / np.log(10)
    assert loudness[82:].mean() - loudness[1:39].mean() == pytest.approx(9.5, abs=1.5)
    assert loudness[42:78].mean() == pytest.approx(-60, abs=0.5)


def test_each_pattern_has_the_same_mean_as_in_the_sound(pair):
    """The tolerances cover differences between patterns and voices, whose measured parameters are pooled."""
    from_sound, simulated, patterns = pair
    for name in NAMES:
        here = patterns == name
        if here.sum() < 80:
            continue
        voiced = (here & (from_sound["pitch_gain"] > GAIN), here & (simulated["pitch_gain"] > GAIN))
        assert from_sound["intensity_log"][here].mean() == pytest.approx(
            simulated["intensity_log"][here].mean(), abs=0.35
        )
        assert from_sound["pitch_gain"][here].mean() == pytest.approx(simulated["pitch_gain"][here].mean(), abs=0.1)
        if voiced[0].sum() > 40:
            lags = from_sound["lag_s"][voiced[0]].median(), simulated["lag_s"][voiced[1]].median()
            assert abs(12 * np.log2(lags[0] / lags[1])) < 1.0


def test_frames_vary_as_in_the_sound(pair):
    from_sound, simulated, patterns = pair
    speaks = patterns != "p1"
    for name, rel in {"intensity": 0.15, "d_intensity": 0.25, "pitch_gain": 0.2, "d_pitch_gain": 0.25}.items():
        assert simulated[name][speaks].std() == pytest.approx(from_sound[name][speaks].std(), rel=rel), name
    share = [(table["pitch_gain"][speaks] > GAIN).mean() for table in (from_sound, simulated)]
    assert share[0] == pytest.approx(share[1], abs=0.08)  # one parameter for two voices that differ by 5 %
