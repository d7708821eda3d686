"""Speech gains nothing where it tells nothing about gestures, and beats every control where it tells something.

One actor, 16 records of 150 s (40 minutes), leave-one-out, scored by kappa of the frames and by D; the same gestures
at both couplings. Intervals of the mean paired difference are bootstrapped over records at 99.5 %, so that of the
twelve comparisons at coupling 0, one would exclude 0 by chance in about one corpus in twenty.
"""

import numpy as np
import pandas as pd
import pytest
from coupled_actor import FRAME_S, corpus
from one_fold import ACTOR, SEED, SHARED, all_systems

from cospeech.data import segments
from cospeech.data.vocabulary import GESTURES
from cospeech.metrics import agreement, boundaries
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.speech import Wrong
from cospeech.synthesis.training import fold

N_RECORDS = 16
SETTINGS = SHARED | {"emission_weights": [0.1, 0.3, 1.0]}
CLASSES = pd.Index(GESTURES)
COMPARED = {
    name: system
    for name, system in all_systems().items()
    if system.decoder in ("hsmm", "hsmm_weighted") or name == "random"
}


def scores(coupling):
    """Kappa and D of each system on each record: {system: (kappa (R,), D (R,) in seconds)}."""
    gestures, prosody = corpus(5, N_RECORDS, 150.0, coupling)
    actor = ACTOR._replace(records=tuple(gestures["record"].unique()))
    found = {}
    for record in actor.records:
        training, streams = fold(actor, record, gestures, prosody)
        session, driving = (
            Session(training, SETTINGS, {}),
            Driving(streams, record, FRAME_S, SEED, Wrong(5.0, 3.0, 1.5)),
        )
        actual = gestures[gestures["record"] == record]
        for name, system in COMPARED.items():
            drawn = []
            for made in session.synthesise(system, driving):
                labels = (segments.to_labels(table) for table in (actual, made.phrases))
                agreed = agreement.kappa(*map(CLASSES.get_indexer, labels))
                starts = (table["start_frame"].to_numpy() for table in (made.phrases, actual))
                drawn.append((agreed, FRAME_S * boundaries.distance(*starts)))
            assert len(drawn) == (1 if system.role == "system" else 8)
            found.setdefault(name, []).append(np.mean(drawn, axis=0))
    return {name: np.array(values).T for name, values in found.items()}


@pytest.fixture(scope="module")
def uncoupled():
    return scores(0.0)


@pytest.fixture(scope="module")
def coupled():
    return scores(0.8)


def gain(found, system, control):
    """Bootstrap interval of the mean gain of a system over its control, in kappa and in D (where less is a gain)."""
    drawn = np.random.default_rng(1).integers(N_RECORDS, size=(2000, N_RECORDS))
    differences = (found[system] - found[control]) * [[1], [-1]]
    return [np.quantile(measure[drawn].mean(axis=1), [0.0025, 0.9975]) for measure in differences]


PAIRS = [(system.decoder, name) for name, system in COMPARED.items() if system.drive != "own"]


def test_both_systems_have_both_controls():
    assert sorted(PAIRS) == [
        ("hsmm", "shifted"),
        ("hsmm", "shuffled"),
        ("hsmm_weighted", "hsmm_weighted_shifted"),
        ("hsmm_weighted", "hsmm_weighted_shuffled"),
    ]


@pytest.mark.parametrize(("system", "control"), PAIRS)
def test_speech_that_tells_nothing_gains_nothing(uncoupled, system, control):
    for low, high in gain(uncoupled, system, control):
        assert low < 0 < high


@pytest.mark.parametrize(("system", "control"), PAIRS)
def test_speech_that_tells_something_beats_the_same_decoder_on_the_wrong_speech(coupled, system, control):
    for low, _ in gain(coupled, system, control):
        assert low > 0


@pytest.mark.parametrize(
    ("better", "worse"), [("hsmm", "random"), ("hsmm_weighted", "random"), ("hsmm_weighted", "hsmm")]
)
def test_speech_beats_random_phrases_and_the_weight_beats_the_printed_model(coupled, better, worse):
    for low, _ in gain(coupled, better, worse):
        assert low > 0
