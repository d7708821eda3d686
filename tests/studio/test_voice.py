"""The voice: the sound is valid, and Praat's pitch tracker recovers the planted prosody from it."""

import subprocess
import sys

import numpy as np
import parselmouth
import pytest

from cospeech.data import segments, tables
from cospeech.data.vocabulary import SCENARIOS
from cospeech.errors import UserError
from cospeech.studio import cast, melody, script, voice
from cospeech.studio.patterns import NAMES, PATTERNS, contour
from cospeech.studio.sentences import SENTENCES

FRAME_S = 0.025
SEED = 2012

TWICE = """
import hashlib
from cospeech.studio import scenes, voice, worlds
for world in ("phrases", "all"):
    actor = scenes.player("ada", world, 1, 0.025, 10.0)
    scene = scenes.write(actor, "ada_1", 12.0, worlds.couplings(world, 0.8, {}), 0.025, 1)
    sound, table = voice.speak("ada_1", scene.prosody, "Female2", "fairy_tale", 0.025, 1, scene.delivery())
    print(hashlib.sha256(sound.tobytes() + table.to_csv().encode()).hexdigest())
"""


@pytest.fixture(scope="module", params=[("ada", "Female1"), ("deniz", "Male1")], ids=["woman", "man"])
def take(request):
    """Forty seconds of one speaker: intonation phrases, sound and table of planted prosody."""
    actor, name = request.param
    prosody = script.write(cast.member(actor, SEED, FRAME_S, 10.0), "x", 40.0, 0.8, FRAME_S, SEED)[1]
    return prosody, *voice.speak("x", prosody, name, "memory", FRAME_S, SEED)


def tracked_hz(sound, times_s):
    """Return Praat's pitch at ``times_s``, with a low silence threshold: an aside is 22 dB softer than an accent."""
    praat = parselmouth.Sound(sound, voice.RATE_HZ)
    track = praat.to_pitch_ac(
        time_step=0.005, pitch_floor=65.0, pitch_ceiling=420.0, silence_threshold=0.005, voicing_threshold=0.5
    )
    return np.array([track.get_value_at_time(time_s) for time_s in times_s])


def energy_db(sound, frames=1):
    """Return the power in decibels around each prosody frame, over an odd number of ``frames``."""
    power = (sound[: len(sound) // 400 * 400].reshape(-1, 400) ** 2).mean(axis=1)
    return 10 * np.log10(np.convolve(power, np.full(frames, 1 / frames), mode="same"))


def test_the_planted_table_matches_its_schema(take):
    prosody, sound, planted = take
    tables.validate(planted, "planted_prosody", "x")
    assert len(planted) == 1600
    assert len(sound) == 40 * voice.RATE_HZ
    np.testing.assert_array_equal(planted["pattern"], segments.to_labels(prosody).astype(str))
    assert planted.loc[planted["pattern"] == "p1", "lag_s"].isna().all()
    voiced = planted.loc[planted["pattern"] != "p1", "lag_s"].notna().mean()
    assert 0.75 < voiced < 0.99


def test_the_sound_neither_clips_nor_is_ever_silent(take):
    _, sound, _ = take
    assert np.abs(sound).max() < 1.0
    assert np.abs(sound.mean()) < 1e-3
    samples = np.round(sound * 32767)
    assert (np.abs(samples.reshape(-1, 400)).max(axis=1) > 10).all()


def test_praats_pitch_tracker_recovers_the_planted_pitch(take):
    _, sound, planted = take
    found = tracked_hz(sound, planted["time_s"])
    both = ~np.isnan(found) & planted["lag_s"].notna().to_numpy()
    assert both.sum() > 0.75 * planted["lag_s"].notna().sum()
    semitones = 12 * np.log2(found[both] * planted["lag_s"][both])
    assert np.median(np.abs(semitones)) < 0.08
    assert abs(np.median(semitones)) < 0.02
    assert (np.abs(semitones) > 2).mean() < 0.02


def test_frames_planted_as_unvoiced_are_unvoiced(take):
    _, sound, planted = take
    found = tracked_hz(sound, planted["time_s"])
    pause = (planted["pattern"] == "p1").to_numpy()
    inside = pause & np.roll(pause, 1) & np.roll(pause, -1)
    assert np.isnan(found[inside]).mean() > 0.97


def test_the_planted_intensity_is_in_the_sound(take):
    _, sound, planted = take
    db = energy_db(sound, frames=5)  # about a syllable, over which the intensity is defined
    speaks = (planted["pattern"] != "p1").to_numpy()
    inside = np.convolve(speaks, np.ones(5), mode="same") == 5
    off = (db - planted["intensity_db"])[inside]
    assert -2.0 < off.mean() < 0.5
    assert off.std() < 2.0
    level = {name: db[inside & (planted["pattern"] == name)].mean() for name in ("p2", "p7", "p8")}
    assert level["p7"] - level["p2"] == pytest.approx(8.5, abs=1.5)
    assert level["p2"] - level["p8"] == pytest.approx(13.5, abs=1.5)


def test_pauses_contain_the_room_noise(take):
    _, sound, planted = take
    pause = (planted["pattern"] == "p1").to_numpy()
    inside = pause & np.roll(pause, 1) & np.roll(pause, -1)
    assert inside.sum() > 100
    assert np.median(energy_db(sound)[inside]) == pytest.approx(melody.ROOM_DB, abs=0.5)


def test_no_click_where_speech_begins_or_ends(take):
    """At the edge of a pause, the sound steps by no more than five standard deviations of steps of the room noise."""
    prosody, sound, _ = take
    speaks = (prosody["label"] != "p1").to_numpy()
    edges = prosody["start_s"].to_numpy()[1:][speaks[1:] != speaks[:-1]]
    at = np.round(edges * voice.RATE_HZ).astype(int)
    steps = np.abs(sound[at] - sound[at - 1])
    assert steps.max() < 5 * np.sqrt(2) * 10 ** (melody.ROOM_DB / 20)


def test_patterns_can_be_distinguished_frame_by_frame(take):
    """Nearest-centroid labels from Praat's pitch and energy, smoothed over 0.2 s, agree with the planted patterns."""
    from sklearn.metrics import adjusted_mutual_info_score

    _, sound, planted = take
    hertz = tracked_hz(sound, planted["time_s"])
    known = np.flatnonzero(~np.isnan(hertz))
    semitones = 12 * np.log2(np.interp(np.arange(1600), known, hertz[known]))
    features = np.column_stack([semitones / 3, energy_db(sound) / 6])
    smooth = np.column_stack([np.convolve(values, np.full(9, 1 / 9), mode="same") for values in features.T])
    labels = planted["pattern"].to_numpy().astype(str)
    present = [name for name in NAMES if (labels == name).any()]
    centroids = np.array([smooth[labels == name].mean(axis=0) for name in present])
    guess = ((smooth[:, None] - centroids) ** 2).sum(axis=2).argmin(axis=1)
    assert adjusted_mutual_info_score(labels, guess) > 0.5


def test_a_take_has_the_same_bytes_in_every_process():
    hashes = {
        subprocess.run([sys.executable, "-c", TWICE], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    }
    assert len(hashes) == 1


def test_base_pitch_leaves_room_for_every_pattern():
    spoken = [value for pattern in PATTERNS for value in pattern.pitch_st]
    bases = {name: voice.base_hz(name) for name in ("Female1", "Male1", "Female3")}
    assert bases["Female1"] > 1.3 * bases["Male1"]
    for base in bases.values():
        # Bases are rounded to a tenth of a hertz.
        assert base * 2 ** (min(spoken) / 12) > voice.LOWEST_HZ - 0.1
        assert base * 2 ** (max(spoken) / 12) < voice.HIGHEST_HZ + 0.1


def test_base_pitch_does_not_depend_on_what_was_synthesised_before():
    drifted = {voice.natural_hz("Female1") for _ in range(4)}
    assert len(drifted) > 1  # the state of the synthesiser, which made the base pitch drift
    before = voice.base_hz("Female1")
    voice.base_hz.cache_clear()
    assert voice.base_hz("Female1") == before


@pytest.mark.parametrize("name", ["Adam", "Whisper"])
def test_a_voice_without_pitch_is_rejected_by_name(name):
    with pytest.raises(UserError, match=rf"studio\.actors: .*'{name}'.*use Female1 to Female5"):
        voice.base_hz(name)


@pytest.mark.parametrize("labels", [["p1"], ["p7"], ["p2", "p1", "p2"]])
def test_a_record_may_be_all_pause_all_speech_or_have_a_stretch_of_one_frame(labels):
    starts = [0, 1, 80][: len(labels)]
    prosody = segments.from_starts("x", starts, labels, 120, 40.0)
    sound, planted = voice.speak("x", prosody, "Male2", "documentary", FRAME_S, 1)
    assert len(sound) == 3 * voice.RATE_HZ
    assert np.isfinite(sound).all()
    assert planted["lag_s"].notna().any() == (labels != ["p1"])


def test_a_contour_passes_smoothly_through_its_knots():
    u = np.linspace(0, 1, 2001)
    course = contour((-3.0, 6.0, -3.0), u)
    np.testing.assert_allclose(course[[0, 1000, 2000]], [-3.0, 6.0, -3.0])
    assert np.abs(np.diff(course)).max() < 2 * np.pi / 2 * 9 / 2000 * 1.01
    np.testing.assert_allclose(contour((4.5, 4.5), u), 4.5)


def test_a_plan_changes_smoothly_between_phrases_but_not_into_pauses():
    prosody = segments.from_starts("x", [0, 40, 80], ["p2", "p3", "p1"], 120, 40.0)
    plan = melody.plan(prosody, 100.0)
    assert np.isnan(plan.pitch_hz[2000:]).all()
    assert np.isfinite(plan.pitch_hz[:2000]).all()
    assert plan.pitch_hz[500] == pytest.approx(100 * 2 ** (-4.5 / 12), rel=1e-3)
    assert plan.pitch_hz[1999] == pytest.approx(100 * 2 ** (4.0 / 12), rel=1e-3)
    assert (
        np.abs(np.diff(12 * np.log2(plan.pitch_hz[:2000]))).max() < 9 / 18
    )  # nine semitones in 40 ms, at most twice
    assert plan.pitch_at(np.array([1.0])).item() == pytest.approx(100.0, rel=0.02)  # midway, on the log scale


def test_every_scenario_has_a_story():
    assert tuple(SENTENCES) == SCENARIOS
    assert min(map(len, SENTENCES.values())) >= 10
    assert len({sentence for story in SENTENCES.values() for sentence in story}) == 40
