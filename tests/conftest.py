"""What all tests share: property-based tests have no time limit, and there are recordings of a virtual actor."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# How long an example takes depends on what else the machine does.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

FRAME_S, FPS, SEED = 0.025, 20.0, 7
SECONDS = {"speech": 10.0, "talk_1": 12.0, "talk_2": 12.0}


@pytest.fixture(scope="session")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder, not to be changed, with speech.wav (10 s), and talk_1 and talk_2 (12 s each) as .wav and .bvh."""
    from cospeech.formats import bvh, sound
    from cospeech.studio import cast, motion, script, voice

    folder = tmp_path_factory.mktemp("recordings")
    actor = cast.member("ada", SEED, FRAME_S, 10.0)
    for name, duration_s in SECONDS.items():
        gestures, prosody = script.write(actor, name, duration_s, 0.8, FRAME_S, SEED)
        samples, _ = voice.speak(name, prosody, "Female2", "memory", FRAME_S, SEED)
        sound.write(samples, folder / f"{name}.wav")
        if name != "speech":
            bvh.write(motion.perform("ada", name, gestures, prosody, FPS, SEED), folder / f"{name}.bvh")
    return folder
