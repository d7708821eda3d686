"""What speech is worth: nothing where it tells nothing, and enough to beat every control where it tells something.

One actor, 16 records of 150 s (40 minutes), leave-one-out, scored on kappa of the frames and on D; the same gestures
at both couplings. Intervals of the mean paired difference are bootstrapped over records at 99.5 %, so that of the
twelve comparisons at coupling 0 one would exclude 0 by chance in about one corpus of twenty.
"""

import numpy as np
import pytest
from cospeech.synthesis.agreement import boundary_distance, kappa
from cospeech.synthesis.fold import fold
from coupled_actor import FRAME_S, corpus

from cospeech.data import segments
from cospeech.synthesis import hsmm, hsmm_weighted, random_phrases
from cospeech.synthesis.speech import frame_labels, heard

SEED = 2012
WEIGHTS = (0.1, 0.3, 1.0)
HOW = hsmm.Estimate(segments.GESTURES, 8, 10.0, 1e-6, "none", 1.0)


def scores(coupling):
    """Kappa and D of each system on each record: {system: (kappa (R,), D (R,) in seconds)}."""
    gestures, prosody = corpus(5, 16, 150.0, coupling)
    labels = frame_labels(prosody)
    found = {}
    for record, actual in gestures.groupby("record", sort=False):
        known = fold(record, gestures, prosody, FRAME_S)
        counted = hsmm.counts(known, HOW)
        model = hsmm.train(counted.values(), HOW)
        weight = hsmm_weighted.choose_weight(known, counted, HOW, WEIGHTS, "none")
        made = {"random": random_phrases.synthesise(known, SEED)}
        for drive in ("own", "shuffled", "shifted"):
            speech = heard(labels, record, FRAME_S, drive, SEED, 5.0)
            made[f"hsmm {drive}"] = hsmm.synthesise(model, speech)
            made[f"hsmm_weighted {drive}"] = hsmm.synthesise(model, speech, weight)
        for name, (phrases, _) in made.items():
            agreed = kappa(segments.to_labels(actual), segments.to_labels(phrases))
            distance = FRAME_S * boundary_distance(actual["start_frame"], phrases["start_frame"])
            found.setdefault(name, []).append((agreed, distance))
    return {name: np.array(values).T for name, values in found.items()}


@pytest.fixture(scope="module")
def uncoupled():
    return scores(0.0)


@pytest.fixture(scope="module")
def coupled():
    return scores(0.8)


def gain(found, system, control):
    """Bootstrap interval of the mean gain of a system over its control, in kappa and in D (less is gained)."""
    drawn = np.random.default_rng(1).integers(16, size=(2000, 16))
    differences = (found[system] - found[control]) * [[1], [-1]]
    return [np.quantile(measure[drawn].mean(axis=1), [0.0025, 0.9975]) for measure in differences]


PAIRS = [(system, drive) for system in ("hsmm", "hsmm_weighted") for drive in ("shuffled", "shifted")]


@pytest.mark.parametrize(("system", "drive"), PAIRS)
def test_speech_that_tells_nothing_gains_nothing(uncoupled, system, drive):
    for low, high in gain(uncoupled, f"{system} own", f"{system} {drive}"):
        assert low < 0 < high


@pytest.mark.parametrize(("system", "drive"), PAIRS)
def test_speech_that_tells_something_beats_the_same_decoder_under_wrong_speech(coupled, system, drive):
    for low, _ in gain(coupled, f"{system} own", f"{system} {drive}"):
        assert low > 0


@pytest.mark.parametrize(
    ("better", "worse"),
    [("hsmm own", "random"), ("hsmm_weighted own", "random"), ("hsmm_weighted own", "hsmm own")],
)
def test_speech_beats_random_phrases_and_the_weight_beats_the_printed_model(coupled, better, worse):
    for low, _ in gain(coupled, better, worse):
        assert low > 0
