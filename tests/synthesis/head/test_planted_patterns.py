"""Planted joint patterns are found with their lag, predicted almost as well as possible, and not if there are none.

Everything here is planted: the numbers say how well the methods recover it, and nothing about people.
"""

import numpy as np
import pytest
from planted_heads import KINDS, REST, corpus, training_of
from scipy import stats
from sklearn.metrics import adjusted_mutual_info_score

from cospeech.markov import parallel_symbols
from cospeech.synthesis.head import SETTINGS, features, model, patterns, prediction
from cospeech.synthesis.head.boosting import BoostedLabeller
from cospeech.synthesis.head.prediction import HEAD, MELODY, WeightedLabeller, whole

EVERY_KIND = SETTINGS | {"head_patterns": KINDS + 1, "melody_patterns": KINDS + 1}
"""Settings with a pattern for each planted kind, and one for rest."""


def planted_segments(labels):
    """First frame, end and label of each planted pattern of a record."""
    edges = np.flatnonzero(np.diff(labels)) + 1
    parts = zip(np.append(0, edges), np.append(edges, len(labels)), strict=True)
    return [(begin, end, labels[begin]) for begin, end in parts if labels[begin] != REST]


def recovered(records, examples, found):
    """Adjusted mutual information of the planted head patterns and the most frequent found label in each."""
    true, own = [], []
    for example, labels in zip(examples, found, strict=True):
        for begin, end, kind in planted_segments(records[example.record].of_head):
            true.append(kind)
            own.append(np.bincount(labels[begin:end]).argmax())
    return adjusted_mutual_info_score(true, own)


def second_stage(records, held_out, rng, settings=EVERY_KIND):
    """The first stage, its examples, and the weighted joint patterns, without what the test does not need."""
    stage, examples, _ = model.first_stage(training_of(records, held_out), settings, rng)
    sequences = [example.symbols for example in examples]
    return stage, examples, model.second_stage(sequences, stage, settings["melody_weight"], settings, rng)


def heard(stage, record):
    """Patterns of head and melody of a record that was not learnt from."""
    head = patterns.label(stage.head.hmm, features.head_features(features.angles_of(record.head)))
    melody = patterns.label(stage.melody.hmm, features.melody_features(record.melody))
    return head, melody[features.melody_frames(len(head), stage.fps)]


def test_planted_patterns_are_found(trained, records):
    heads = [example.symbols[:, HEAD] for example in trained.examples]
    assert recovered(records, trained.examples, heads) > 0.9
    joints = [parallel_symbols.decode(trained.weighted, example.symbols).branch for example in trained.examples]
    assert recovered(records, trained.examples, joints) > 0.7


@pytest.mark.parametrize("lag", [0, 6, 12])
def test_the_lag_is_found_to_one_frame(lag):
    records = corpus(seed=1, lag_frames=lag)
    _, examples, _ = model.first_stage(training_of(records, None), EVERY_KIND, np.random.default_rng(0))
    shifts = np.arange(-4, 20)
    shared = [
        sum(
            adjusted_mutual_info_score(
                example.symbols[4:-20, HEAD], np.roll(example.symbols[:, MELODY], -shift)[4:-20]
            )
            for example in examples
        )
        for shift in shifts
    ]
    assert abs(shifts[int(np.argmax(shared))] - lag) <= 1


def test_the_weighted_system_comes_close_to_the_ceiling_at_all_lags():
    below = []
    for seed, lag in enumerate((0, 6, 12)):
        records = corpus(seed, lag_frames=lag)
        stage, examples, joint = second_stage(records, "r0", np.random.default_rng(seed))
        head, melody = heard(stage, records["r0"])
        symbols = [example.symbols for example in examples]
        ceiling = BoostedLabeller([own[:, MELODY] for own in symbols], [own[:, HEAD] for own in symbols], KINDS + 1)
        reached, highest = (
            (whole(labeller, melody) == head).mean() for labeller in (WeightedLabeller(joint, 24), ceiling)
        )
        assert reached > 0.5
        below.append(highest - reached)
    assert np.mean(below) < 0.03


def test_without_coupling_own_speech_is_no_advantage():
    records = {
        name: own._replace(head=other.head, of_head=other.of_head)
        for (name, own), other in zip(corpus(4, 9).items(), corpus(5, 9).values(), strict=True)
    }
    learnt = {name: records[name] for name in ("r0", "r1", "r2")}
    stage, _, joint = second_stage(learnt, None, np.random.default_rng(0))
    fresh = [heard(stage, record) for name, record in records.items() if name not in learnt]
    right = np.array(
        [[(whole(WeightedLabeller(joint, 24), melody) == head).mean() for _, melody in fresh] for head, _ in fresh]
    )
    own, others = np.diag(right), (right.sum(axis=1) - np.diag(right)) / (len(right) - 1)
    low, high = stats.ttest_1samp(own - others, 0.0).confidence_interval(0.95)
    assert low < 0.0 < high


def test_the_printed_and_the_weighted_prediction_agree_on_an_unambiguous_model():
    """Each melody pattern goes with one head pattern: both predictions must return it."""
    rng = np.random.default_rng(5)
    symbols = np.repeat(rng.integers(3, size=60), 15)
    sequences = [np.column_stack([symbols, symbols])]
    start = parallel_symbols.start(sequences, (3, 3), (1.0, 1.0), 3, 2, 15, rng)
    joint = parallel_symbols.fit(start, sequences, 40, pseudo=0.1).model
    for labeller in (prediction.JointLabeller(joint, 24), WeightedLabeller(joint, 24)):
        assert (whole(labeller, symbols) == symbols).mean() > 0.99
