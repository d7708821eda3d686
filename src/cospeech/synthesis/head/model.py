"""The model of an actor's head gestures, and its conversion to and from tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.errors import UserError
from cospeech.markov import iohmm, labelled_hmm, parallel_symbols
from cospeech.markov.iohmm import IOHMM
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.markov.parallel_symbols import SymbolHMM
from cospeech.synthesis.head import features, generation, patterns, prediction, tables
from cospeech.synthesis.head.generation import NO_NOISE, Generator, Noise, Style
from cospeech.synthesis.head.prediction import HEAD, MELODY, IOHMMLabeller, JointLabeller, Labeller, WeightedLabeller
from cospeech.synthesis.interface import Training

JOINT_SEGMENT_S = (1.0, 2.0, 0.5)
"""Mean durations of the random segments that initialise the joint patterns, in turn."""

PSEUDO = 0.5
"""Count that is added to every symbol in every state of the second stage, so that nothing is impossible."""

PSEUDO_IOHMM = 0.01
"""The same for the input-output HMM, which has many more parameters."""

SYSTEMS = ("head", "head_weighted", "iohmm", "iohmm_ahead")
"""The systems that share the model."""

STREAMS = ("head", "melody")
"""Names of the streams of the joint patterns in tables."""

TOLERANCE = 1e-4
"""Training of the second stage ends when the gain per frame falls below this."""


class Stage(NamedTuple):
    """The first stage: patterns of the head at ``fps`` frames per second, and of the melody at 100 Hz."""

    head: LabelledHMM
    melody: LabelledHMM
    fps: float


class Lags(NamedTuple):
    """When labels are decided: frames of the melody, and frames of the head, after they are heard."""

    melody: int
    head: int


class Example(NamedTuple):
    """A stretch of a training record, from frame ``first`` on: the patterns of head and melody in each, (T, 2)."""

    record: str
    first: int
    symbols: Integers


class Model(NamedTuple):
    """A trained model.

    Attributes
    ----------
    stage : the patterns of the first stage.
    joint : the joint patterns of the second stage, with the streams ``HEAD`` and ``MELODY`` and equal weights.
    weighted : the same, with a smaller weight of the melody. A melody pattern lasts for many frames, each of which
        the printed model counts as evidence of its own.
    iohmms : by look-ahead in frames, the input-output HMM from melody patterns to head patterns.
    noise : noise of the filters ``kept``, by system.
    examples : the stretches of the training records, labelled with the patterns of the first stage.
    lags, style : when labels are decided, and how angles are generated.
    """

    stage: Stage
    joint: SymbolHMM
    weighted: SymbolHMM
    iohmms: Mapping[int, IOHMM]
    noise: Mapping[str, Noise]
    examples: Sequence[Example]
    lags: Lags
    style: Style


def train(training: Training, settings: Mapping[str, Any]) -> Model:
    """Return the model of an actor (Sargin 2006, 4.2), with the input-output HMMs of its baseline (4.4.3).

    Raises
    ------
    UserError : if no training record has angles of the head that can be learnt from, or a setting is impossible.
    """
    rng = random_source(0, "head", training.actor, *sorted(training.heads))
    stage, examples, angles = first_stage(training, settings, rng)
    sequences = [example.symbols for example in examples]
    joint, weighted = (
        second_stage(sequences, stage, weight, settings, rng) for weight in (1.0, float(settings["melody_weight"]))
    )
    look_ahead = settings["look_ahead_frames"]
    iohmms = {ahead: baseline(sequences, stage, ahead, settings, rng) for ahead in (0, look_ahead)}
    lags = Lags(round(settings["melody_lag_s"] * features.MELODY_HZ), look_ahead)
    how = generation.style(settings["overlap_frames"], look_ahead, settings["filters"])
    model = Model(stage, joint, weighted, iohmms, {}, examples, lags, how)
    noise = {system: _noise(model, system, angles) for system in SYSTEMS}
    return model._replace(noise=noise)


def first_stage(
    training: Training, settings: Mapping[str, Any], rng: np.random.Generator
) -> tuple[Stage, list[Example], list[Floats]]:
    """Return the patterns of the first stage, the training records labelled with them, and their angles."""
    fps = features.common_rate(list(training.heads.values()))
    heads = {record: features.at_rate(table, fps) for record, table in training.heads.items()}
    least = settings["head_states"]
    stretches = [part for record, head in heads.items() for part in features.stretches(record, head, least)]
    if not stretches:
        raise UserError(
            f"actor {training.actor}: no training record shows the head in {least} successive frames; head gestures "
            "cannot be learnt"
        )
    melodies = {record: features.melody_features(training.melodies[record]) for record in heads}
    restarts, iterations = settings["restarts"], settings["iterations"]
    of_head = [features.head_features(stretch.angles) for stretch in stretches]
    head = patterns.learn(
        patterns.GESTURES, of_head, fps, settings["head_patterns"], least, restarts, iterations, rng
    )
    melody = patterns.learn(
        patterns.MELODIES, list(melodies.values()), features.MELODY_HZ,
        settings["melody_patterns"], settings["melody_states"], restarts, iterations, rng,
    )  # fmt: skip
    spoken = {record: patterns.label(melody.hmm, frames) for record, frames in melodies.items()}
    examples = []
    for stretch, frames in zip(stretches, of_head, strict=True):
        labels = spoken[stretch.record]
        at = features.melody_frames(len(frames), fps, stretch.first)
        symbols = np.column_stack([patterns.label(head.hmm, frames), labels[np.minimum(at, len(labels) - 1)]])
        examples.append(Example(stretch.record, stretch.first, symbols))
    return Stage(head, melody, fps), examples, [stretch.angles for stretch in stretches]


def second_stage(
    sequences: list[Integers],
    stage: Stage,
    melody_weight: float,
    settings: Mapping[str, Any],
    rng: np.random.Generator,
) -> SymbolHMM:
    """Return the joint patterns (Sargin 2006, 4.2.2); restarts are treated as in the first stage.

    Parameters
    ----------
    sequences : (T, 2) patterns of head and melody.
    melody_weight : exponent of the melody (eq. 4.18); that of the head is 1.
    """
    states = settings["joint_states"]
    longest = max(states, stage.fps * max(JOINT_SEGMENT_S))
    n_patterns = patterns.affordable(settings["joint_patterns"], longest, sequences)
    sizes = len(stage.head.labels), len(stage.melody.labels)
    long_enough = [symbols for symbols in sequences if len(symbols) >= states]
    tried = []
    for restart in range(settings["restarts"]):
        length = max(states, round(JOINT_SEGMENT_S[restart % len(JOINT_SEGMENT_S)] * stage.fps))
        start = parallel_symbols.start(long_enough, sizes, (1.0, melody_weight), n_patterns, states, length, rng)
        tried.append(parallel_symbols.fit(start, sequences, patterns.TRIED, 0.0, PSEUDO))
    best = tried[int(np.argmax([fit.objective[-1] for fit in tried]))].model
    return parallel_symbols.fit(best, sequences, settings["iterations"], TOLERANCE, PSEUDO).model


def baseline(
    sequences: list[Integers], stage: Stage, ahead: int, settings: Mapping[str, Any], rng: np.random.Generator
) -> IOHMM:
    """Return the input-output HMM from melody patterns ``ahead`` frames ahead to head patterns."""
    pairs = [
        iohmm.Sequence(prediction.ahead(symbols[:, MELODY], ahead), np.ascontiguousarray(symbols[:, HEAD]))
        for symbols in sequences
    ]
    start = iohmm.start(len(stage.melody.labels), settings["iohmm_states"], len(stage.head.labels), rng)
    return iohmm.fit(start, pairs, settings["iterations"], TOLERANCE, PSEUDO_IOHMM).model


def labeller(model: Model, system: str) -> Labeller:
    """Return what predicts head patterns in a system."""
    if system == "head":
        return JointLabeller(model.joint, model.lags.head)
    if system == "head_weighted":
        return WeightedLabeller(model.weighted, model.lags.head)
    ahead = model.lags.head if system == "iohmm_ahead" else 0
    return IOHMMLabeller(model.iohmms[ahead], ahead)


def _noise(model: Model, system: str, angles: list[Floats]) -> Noise:
    """Return the noise of the filters ``kept``: what a system lacks when it makes the training records."""
    if model.style.filters != "kept":
        return NO_NOISE
    made = []
    for example in model.examples:
        labels = prediction.whole(labeller(model, system), np.ascontiguousarray(example.symbols[:, MELODY]))
        head = Generator(generation.patterns_of(model.stage.head), model.style, NO_NOISE, np.random.default_rng(0))
        made.append(np.concatenate([head.hear(labels), head.end()]))
    return generation.fit_noise(angles, made)


def to_tables(model: Model) -> dict[str, pd.DataFrame]:
    """Return the model as tables, with the names of ``TABLES``."""
    rates = {
        "fps": [model.stage.fps],
        "melody_lag_frames": [model.lags.melody],
        "look_ahead_frames": [model.lags.head],
        "overlap_frames": [model.style.overlap],
        "filters": [model.style.filters],
    }
    return {
        "head_patterns": labelled_hmm.to_table(model.stage.head),
        "melody_patterns": labelled_hmm.to_table(model.stage.melody),
        "joint_patterns": tables.of_symbols(model.joint, STREAMS),
        "weighted_patterns": tables.of_symbols(model.weighted, STREAMS),
        "iohmm": tables.of_iohmms(model.iohmms),
        "noise": tables.of_noise(model.noise),
        "examples": tables.of_examples([(own.record, own.first, own.symbols) for own in model.examples]),
        "rates": pd.DataFrame(rates),
    }


def from_tables(found: Mapping[str, pd.DataFrame]) -> Model:
    """Return the model of ``to_tables``."""
    row = found["rates"].iloc[0]
    look_ahead = int(row["look_ahead_frames"])
    stage = Stage(
        labelled_hmm.from_table(found["head_patterns"]),
        labelled_hmm.from_table(found["melody_patterns"]),
        float(row["fps"]),
    )
    return Model(
        stage,
        tables.symbols_in(found["joint_patterns"], STREAMS),
        tables.symbols_in(found["weighted_patterns"], STREAMS),
        tables.iohmms_in(found["iohmm"]),
        tables.noise_in(found["noise"]),
        [Example(*own) for own in tables.examples_in(found["examples"])],
        Lags(int(row["melody_lag_frames"]), look_ahead),
        generation.style(int(row["overlap_frames"]), look_ahead, str(row["filters"])),
    )
