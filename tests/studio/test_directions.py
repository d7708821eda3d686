"""Route directions: words, accents and gestures are where the tables say."""

import itertools

import numpy as np
import pandas as pd
import parselmouth
import pytest

from cospeech.data import tables
from cospeech.data.rng import random_source
from cospeech.errors import UserError
from cospeech.studio.directions import gestures, sentences, voice
from cospeech.studio.directions.settings import Settings
from cospeech.studio.directions.voice import Event, Spoken

SEED = 5


def settings(**changes):
    usual = {
        "voices": ["Female2"], "answers": 20, "accent_st": 4.0, "ripple_st": 0.0, "accents_with_head": 1.0,
        "keywords_with_hand": 1.0, "head_lag_s": 0.05,
    }  # fmt: skip
    return Settings(**(usual | changes))


@pytest.fixture(scope="module")
def spoken():
    text = ["Take a left at the bank.", "Go straight past the museum and turn right."]
    return voice.speak("a", "Female2", text, settings(), SEED)


def test_every_word_has_its_time(spoken):
    said = " ".join(word.label for word in spoken.words)
    assert said == "take a left at the bank go straight past the museum and turn right"
    bounds = np.array([(word.start_s, word.end_s) for word in spoken.words])
    assert (bounds[:, 1] > bounds[:, 0]).all()
    assert (bounds[1:, 0] >= bounds[:-1, 1] - 1e-9).all()
    assert bounds[-1, 1] < len(spoken.samples) / voice.RATE_HZ
    pauses = np.ones(len(spoken.samples), dtype=bool)
    for start, end in bounds:
        pauses[round(start * voice.RATE_HZ) : round((end + 0.05) * voice.RATE_HZ)] = False
    assert spoken.samples[pauses].std() < 0.1 * spoken.samples[~pauses].std()


def test_accented_syllables_are_higher_than_others():
    texts = [sentences.answer(random_source(SEED, str(n))) for n in range(2)]
    high, low = [], []
    for number, text in enumerate(texts):
        spoken = voice.speak(f"b{number}", "Female2", text, settings(), SEED)
        track = parselmouth.Sound(spoken.samples, voice.RATE_HZ).to_pitch(pitch_floor=75.0, pitch_ceiling=600.0)
        for syllable in spoken.syllables:
            hz = track.get_value_at_time((syllable.start_s + syllable.end_s) / 2.0)
            if not np.isnan(hz):
                (high if syllable.label == "accent" else low).append(12.0 * np.log2(hz))
    assert np.median(high) - np.median(low) == pytest.approx(4.0, abs=1.5)


def test_an_unknown_voice_is_reported():
    with pytest.raises(UserError, match=r"studio\.directions\.voices: Praat's synthesiser has no voice 'Nobody'"):
        voice.speak("a", "Nobody", ["Go."], settings(), SEED)


def planted(duration_s=400.0):
    """Accents every two seconds, and keywords every five, far from one another."""
    accents = [Event(at, at + 0.2, "accent") for at in np.arange(1.0, duration_s - 2.0, 2.0)]
    words = [Event(at, at + 0.3, "left") for at in np.arange(2.0, duration_s - 3.0, 5.0)]
    return Spoken(np.zeros(0), words, accents)


def test_gestures_accompany_the_share_of_accents_that_is_asked_for():
    for share in (0.0, 0.6, 1.0):
        chosen = settings(accents_with_head=share, keywords_with_hand=share)
        performed = gestures.perform("a", planted(), 400.0, chosen, SEED)
        starts = np.array([event.start_s for event in performed.head])
        near = [np.abs(starts - accent.start_s).min() < 0.16 for accent in planted().syllables]
        assert np.mean(near) == pytest.approx(share, abs=0.1)


def test_gestures_do_not_overlap_and_move_what_they_should():
    performed = gestures.perform("a", planted(), 400.0, settings(), SEED)
    for events in (performed.head, performed.hand):
        assert all(one.end_s <= other.start_s for one, other in itertools.pairwise(events))
    times_s = (np.arange(len(performed.movement)) + 0.5) / gestures.FPS
    moved = pd.DataFrame(performed.movement, columns=gestures.COLUMNS)
    middles = {
        label: np.any([np.abs(times_s - (0.4 * e.end_s + 0.6 * e.start_s)) < 0.06 for e in events], axis=0)
        for label, events in {
            "nod": [event for event in performed.head if event.label == "nod"],
            "left": [event for event in performed.hand if event.label == "left"],
        }.items()
    }
    rest = ~np.any([(times_s > e.start_s) & (times_s < e.end_s) for e in performed.head + performed.hand], axis=0)
    assert moved["x_deg"][middles["nod"]].mean() - moved["x_deg"][rest].mean() > 3.0
    assert moved["left_x_m"][middles["left"]].mean() > 0.08
    assert abs(moved["right_x_m"][middles["left"]].mean()) < 0.05


def test_tables_have_their_schemas(spoken):
    performed = gestures.perform("a", spoken, len(spoken.samples) / voice.RATE_HZ, settings(), SEED)
    tiers = {"word": spoken.words, "syllable": spoken.syllables, "head": performed.head, "hand": performed.hand}
    tables.validate(gestures.event_table("a", tiers), "direction_events", "x")
    tables.validate(gestures.movement_table("a", performed.movement), "direction_movement", "x")


def test_a_fifth_of_the_answers_is_tested_and_a_fifth_of_the_rest_validated():
    portions = [settings().portion(number) for number in range(20)]
    assert portions[16:] == ["test"] * 4
    assert [portions.count(name) for name in ("training", "validation")] == [13, 3]
