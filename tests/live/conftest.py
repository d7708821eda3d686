"""A stand-in for a live system: every syllable moves the whole body a little, so that no detail goes unnoticed."""

from __future__ import annotations

import numpy as np
import pytest
from stand_in import SYSTEM, Method

from cospeech import api
from cospeech.formats import sound
from cospeech.synthesis.session import Trained


@pytest.fixture(scope="session")
def samples(recordings):
    """The samples (n,) of ten seconds of speech."""
    return sound.read(recordings / "speech.wav").samples


@pytest.fixture
def model():
    """The bundled model with the stand-in in place of its system."""
    return api.load_model()._replace(system=SYSTEM, trained=Trained(Method(), np.linspace(0.1, 0.9, 17)))
