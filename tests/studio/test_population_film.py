"""Voices and faces of the virtual population: what is planted is heard and seen."""

import subprocess
import sys

import numpy as np
import parselmouth
import pytest

from cospeech.studio.population import drawing, face, film, phones, speakers, voice
from cospeech.studio.population.settings import Settings

SEED = 5
SETTINGS = Settings(4, 2, 1, 1.0, 1.0, 1.0, 40.0, 2, 15.0, True, True)

TWICE = """
import hashlib
from cospeech.studio.population import speakers, voice
from cospeech.studio.population.settings import Settings
settings = Settings(4, 2, 1, 1.0, 1.0, 1.0, 40.0, 2, 15.0, True, True)
everyone = speakers.population(settings, 5)
own, digest = voice.voice_of(everyone[1], 1.0, 5), hashlib.sha256()
for one in speakers.utterances(everyone, everyone[1], settings, 5):
    usual, heard = voice.speak(one, own, 5)
    how = speakers.articulate(one, heard, everyone, settings, 5)
    digest.update(voice.articulated(usual, how, one, 5).tobytes() + heard.edges_s.tobytes())
print(digest.hexdigest())
"""


@pytest.fixture(scope="module")
def everyone():
    return speakers.population(SETTINGS, SEED)


@pytest.fixture(scope="module")
def utterance(everyone):
    return speakers.utterances(everyone, everyone[0], SETTINGS, SEED)[0]


class Held:
    """Articulation that stays as it is, where usual phones would be silent."""

    def __init__(self, position, duration_s=1.0):
        self.position = np.array(position)
        self.heard = phones.Spoken([phones.SILENCE], np.array([0.0, duration_s]))

    def lips(self, times_s):
        return np.tile(self.position, (len(times_s), 1))

    def voice(self, times_s):
        return phones.movement(self.heard, times_s) + self.position


def test_a_speaker_sounds_the_same_in_every_process():
    runs = [subprocess.run([sys.executable, "-c", TWICE], check=True, capture_output=True).stdout for _ in range(2)]
    assert runs[0] == runs[1] != b""


def test_phones_are_where_the_voice_is(utterance):
    samples, heard = voice.speak(utterance, voice.Voice("Female1", 1.0, 1.0), SEED)
    assert heard.duration_s == pytest.approx(len(samples) / voice.RATE_HZ, abs=1e-3)
    assert heard.phones[0] == heard.phones[-1] == phones.SILENCE
    assert (np.diff(heard.edges_s) > 0.0).all()
    power = [
        (samples[round(start * voice.RATE_HZ) : round(end * voice.RATE_HZ)] ** 2).mean()
        for start, end in zip(heard.edges_s[:-1], heard.edges_s[1:], strict=True)
    ]
    vowels = [phone in set("aæɛeiɯɔøœʊuyɪo") for phone in heard.phones]
    assert np.mean(power, where=vowels) > 100 * max(power[0], power[-1])


def test_formants_and_pitch_are_shifted_as_planted(utterance):
    usual, shifted = (
        parselmouth.Sound(voice.speak(utterance, own, SEED)[0], voice.RATE_HZ)
        for own in (voice.Voice("Female1", 1.0, 1.0), voice.Voice("Female1", 1.15, 1.0))
    )
    times_s = np.arange(0.25, min(usual.duration, shifted.duration) - 0.25, 0.01)
    tracks = [one.to_formant_burg() for one in (usual, shifted)]
    third = [[track.get_value_at_time(3, time_s) for time_s in times_s] for track in tracks]
    assert np.nanmedian(third[1]) / np.nanmedian(third[0]) == pytest.approx(1.15, abs=0.06)
    pitch = [one.to_pitch().selected_array["frequency"] for one in (usual, shifted)]
    medians = [np.median(track[track > 0]) for track in pitch]
    assert medians[1] == pytest.approx(medians[0], rel=0.03)


def test_speakers_without_anything_of_their_own_have_one_voice(everyone):
    assert len({voice.voice_of(speaker, 0.0, SEED) for speaker in everyone}) == 1
    assert len({voice.voice_of(speaker, 1.0, SEED) for speaker in everyone}) == len(everyone)


def buzz():
    """Return a second of a harmonic sound with resonances at 600 and 1800 Hz."""
    times_s, hz = np.arange(voice.RATE_HZ) / voice.RATE_HZ, 100.0 * np.arange(1, 60)
    level = np.exp(-(((hz - 600.0) / 150.0) ** 2)) + np.exp(-(((hz - 1800.0) / 250.0) ** 2)) + 1e-3
    return 0.02 * (level[:, None] * np.sin(2 * np.pi * hz[:, None] * times_s)).sum(axis=0)


def centroid(sound, low_hz, high_hz):
    power = np.abs(np.fft.rfft(sound[2000:-2000])) ** 2
    hz = np.fft.rfftfreq(len(sound) - 4000, 1 / voice.RATE_HZ)
    band = (hz >= low_hz) & (hz < high_hz)
    return (hz * power)[band].sum() / power[band].sum()


@pytest.mark.parametrize(
    ("position", "band_hz", "shift"),
    [
        ((0.3, 0.0, 0.0, 0.0), (300.0, 1000.0), voice.OPENING_SHIFT * 0.3),
        ((0.0, -0.5, 0.0, 0.0), (1300.0, 2400.0), -voice.ROUNDING_SHIFT * 0.5),
    ],
    ids=["lower jaw", "rounder lips"],
)
def test_resonances_follow_the_articulation(utterance, position, band_hz, shift):
    usual = voice.articulated(buzz(), Held((0.0, 0.0, 0.0, 0.0)), utterance, SEED)
    moved = voice.articulated(buzz(), Held(position), utterance, SEED)
    found = np.log(centroid(moved, *band_hz) / centroid(usual, *band_hz))
    assert found == pytest.approx(shift, abs=0.35 * abs(shift))


def test_articulation_as_usual_leaves_the_sound_as_it_is(utterance):
    still = voice.articulated(buzz(), Held((0.0, 0.0, 0.0, 0.0)), utterance, SEED)
    gain = still.std() / buzz().std()
    assert np.abs(still - gain * buzz())[600:-600].std() < 0.03 * still.std()


def first_frame(own, utterance, position, seed=SEED):
    return next(film.frames(own, utterance, Held(position), 15.0, seed)).astype(float).copy()


def test_the_upper_face_does_not_change_as_the_mouth_opens(everyone, utterance):
    own = face.face(everyone[0], 1.0, SEED)
    closed, opened = (first_frame(own, utterance, (opening, 0.0, 0.0, 0.2))[0] for opening in (0.0, 0.9))
    pose = film.pose(film.motion(utterance, np.array([0.5 / 15]), SEED)[0])
    changed = np.abs(opened - closed) > 12
    middle = round(float(pose[7]) + own.mouth.height)
    assert not changed[: middle - 18].any()
    assert changed[middle - 10 : middle + 25].sum() > 300


def test_the_point_of_a_face_in_a_pixel_is_that_of_the_turned_paraboloid():
    rng = np.random.default_rng(0)
    for _ in range(20):
        pose = film.pose(
            np.array([*np.deg2rad(rng.normal(0.0, 4.0, 3)), *rng.normal(0.0, 3.0, 2), rng.uniform(0.95, 1.05)])
        )
        point = rng.uniform(-45.0, 45.0, 2)
        depth = float(drawing.DEPTH) * (1 - (point[0] / face.HALF_WIDTH) ** 2 - (point[1] / face.HALF_HEIGHT) ** 2)
        seen = np.linalg.inv(pose[:4].reshape(2, 2).astype(float)) @ point + depth * pose[4:6]
        np.testing.assert_allclose(
            drawing.face_point(np.float32(seen[0]), np.float32(seen[1]), pose), point, atol=0.1
        )


def test_light_changes_between_sessions_more_than_within_them(everyone):
    said = [speakers.Utterance(f"x{n}", everyone[0], "x", n, n // 10) for n in range(40)]
    gains = np.array([film.light(one, SEED)[0] for one in said]).reshape(4, 10)
    assert gains.mean(axis=1).std() > 2 * gains.std(axis=1).mean()


def test_mouths_without_anything_of_their_own_are_one_mouth(everyone):
    same = [face.face(speaker, 0.0, SEED).mouth for speaker in everyone[:2]]
    assert len({(one.height, one.half_width, one.upper, one.lower, one.teeth, *one.lip) for one in same}) == 1
    own = [face.face(speaker, 1.0, SEED).mouth for speaker in everyone[:2]]
    assert own[0].half_width != own[1].half_width


def test_the_same_seed_gives_the_same_film_and_another_one_does_not(everyone, utterance):
    own, position = face.face(everyone[0], 1.0, SEED), (0.4, 0.1, 0.0, 0.2)
    np.testing.assert_array_equal(first_frame(own, utterance, position), first_frame(own, utterance, position))
    assert (first_frame(own, utterance, position) != first_frame(own, utterance, position, seed=6)).mean() > 0.3
