"""What the systems learn and do, as material for the figures of Sargin 2006, 4.4.2, and figure 4.5."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments, tables
from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.markov import parallel, parallel_start, parallel_symbols
from cospeech.synthesis.head import features, generation, patterns
from cospeech.synthesis.head.generation import NO_NOISE, Generator, Style
from cospeech.synthesis.head.model import JOINT_SEGMENT_S, PSEUDO, Model, labeller
from cospeech.synthesis.head.prediction import MelodyLabeller, whole
from cospeech.synthesis.interface import Speech, Training
from cospeech.synthesis.live import ANGLES, MELODY

COUNTS = range(2, 9)
"""Numbers of patterns in the curves of figures 4.6, 4.8 and 4.10."""

RESTARTS, ITERATIONS = 3, 15
"""Restarts per number of patterns, whose agreement is the stability, and iterations of training of each."""

STEPS = 20
"""Number of steps into which a segment of the melody is divided for its mean contour (fig. 4.9)."""

SHOWN_S = 12.0
"""Duration of the generation that is shown (fig. 4.5)."""


class _Trial(NamedTuple):
    """A restart: its log-likelihood, beta, number of parameters, and the patterns of all frames."""

    log_likelihood: float
    beta: float
    n_parameters: int
    labels: Integers


def report(training: Training, model: Model, speech: Speech, seed: int) -> dict[str, pd.DataFrame]:
    """Return the reports that the system declares. The curves take seconds."""
    return {
        "curves": curves(training, model),
        "means": means(training, model),
        "contours": contours(training, model),
        "segments": found_segments(model),
        "generation": stages(model, speech, seed),
    }


def curves(training: Training, model: Model) -> pd.DataFrame:
    """Return alpha, beta, BIC and stability by number of patterns (schema ``head_curves``)."""
    head_states, melody_states = (one.hmm.stay.shape[1] for one in (model.stage.head, model.stage.melody))
    heads = [
        features.head_features(stretch.angles)
        for record, head in training.heads.items()
        for stretch in features.stretches(record, features.at_rate(head, model.stage.fps), head_states)
    ]
    melodies = [features.melody_features(training.melodies[record]) for record in training.heads]
    symbols = [example.symbols for example in model.examples]
    rng = random_source(0, "head curves", training.actor)
    kinds: list[tuple[str, Sequence[Floats] | Sequence[Integers], Callable[[int, int], _Trial]]] = [
        ("head", heads, _continuous(patterns.GESTURES, heads, model.stage.fps, head_states, rng)),
        ("melody", melodies, _continuous(patterns.MELODIES, melodies, features.MELODY_HZ, melody_states, rng)),
        ("joint", symbols, _discrete(symbols, model, rng)),
    ]
    rows = []
    for stream, sequences, tried in kinds:
        n_frames = sum(len(frames) for frames in sequences)
        for n_patterns in COUNTS:
            trials = [tried(n_patterns, restart) for restart in range(RESTARTS)]
            best = max(trials, key=lambda trial: trial.log_likelihood)
            rows.append(
                {
                    "stream": stream,
                    "n_patterns": n_patterns,
                    "alpha": parallel.alpha(best.log_likelihood, n_frames),
                    "beta": best.beta,
                    "bic": (best.n_parameters * np.log(n_frames) - 2.0 * best.log_likelihood) / n_frames,
                    "stability": _agreement([trial.labels for trial in trials]),
                }
            )
    return pd.DataFrame(rows)


def _continuous(
    kind: patterns.Kind, sequences: list[Floats], fps: float, states: int, rng: np.random.Generator
) -> Callable[[int, int], _Trial]:
    floor = parallel_start.variance_floor(sequences, kind.features, patterns.VARIANCE_FLOOR)

    def tried(n_patterns: int, restart: int) -> _Trial:
        start = patterns.begin(kind, sequences, fps, n_patterns, states, restart, rng)
        fit = parallel.fit(start, sequences, floor, ITERATIONS)
        paths = [parallel.decode(fit.model, frames) for frames in sequences]
        n_parameters = n_patterns * states * (2 * len(kind.features) + 1) + n_patterns - 1
        beta = parallel.beta(fit.model, sequences, paths)
        return _Trial(fit.log_likelihoods[-1], beta, n_parameters, np.concatenate([path.branch for path in paths]))

    return tried


def _discrete(sequences: list[Integers], model: Model, rng: np.random.Generator) -> Callable[[int, int], _Trial]:
    states = model.joint.stay.shape[1]
    sizes = tuple(values.shape[-1] for values in model.joint.emissions)

    def tried(n_patterns: int, restart: int) -> _Trial:
        length = max(states, round(JOINT_SEGMENT_S[restart % len(JOINT_SEGMENT_S)] * model.stage.fps))
        start = parallel_symbols.start(sequences, sizes, model.joint.weights, n_patterns, states, length, rng)
        fit = parallel_symbols.fit(start, sequences, ITERATIONS, 0.0, PSEUDO)
        paths = [parallel_symbols.decode(fit.model, symbols) for symbols in sequences]
        n_parameters = n_patterns * states * (1 + sum(sizes) - len(sizes)) + n_patterns - 1
        score = parallel_symbols.expect(fit.model, sequences).score
        beta = parallel_symbols.beta(fit.model, sequences, paths)
        return _Trial(score, beta, n_parameters, np.concatenate([path.branch for path in paths]))

    return tried


def _agreement(labels: list[Integers]) -> float:
    """Return the mean adjusted mutual information of every two restarts: 1 if they agree, 0 by chance."""
    from sklearn.metrics import adjusted_mutual_info_score  # takes half a second to import

    pairs = [(one, other) for place, one in enumerate(labels) for other in labels[:place]]
    return float(np.mean([adjusted_mutual_info_score(one, other) for one, other in pairs]))


def means(training: Training, model: Model) -> pd.DataFrame:
    """Return the mean angles of each head pattern (schema ``head_means``; fig. 4.7)."""
    heads = {record: features.at_rate(head, model.stage.fps) for record, head in training.heads.items()}
    parts = []
    for example in model.examples:
        end = example.first + len(example.symbols)
        part = heads[example.record].iloc[example.first : end][list(ANGLES)]
        parts.append(part.assign(pattern=np.array(model.stage.head.labels, dtype=object)[example.symbols[:, 0]]))
    frames = pd.concat(parts, ignore_index=True)
    grouped = frames.groupby("pattern", sort=True)
    found = grouped.mean().join(grouped.std(ddof=0).add_suffix("_sd")).reset_index()
    return found.assign(share=grouped.size().to_numpy() / len(frames))


def contours(training: Training, model: Model) -> pd.DataFrame:
    """Return the mean course of the pitch in each melody pattern (schema ``head_contours``; fig. 4.9)."""
    rows = []
    for record in training.heads:
        frames = features.melody_features(training.melodies[record])
        path = parallel.decode(model.stage.melody.hmm, frames)
        edges = np.append(np.flatnonzero(path.begins), len(frames))
        for begin, end in itertools.pairwise(edges):
            places = begin + (np.arange(STEPS) + 0.5) * (end - begin) / STEPS
            course = frames[places.astype(np.int64), MELODY.index("pitch")]
            rows.append((model.stage.melody.labels[path.branch[begin]], course))
    labels, courses = zip(*rows, strict=True)
    steps = np.tile(np.arange(STEPS), len(rows))
    pitches = pd.DataFrame({"pattern": np.repeat(labels, STEPS), "step": steps, "pitch": np.concatenate(courses)})
    grouped = pitches.groupby(["pattern", "step"], sort=True)["pitch"]
    return grouped.agg(pitch="mean", pitch_sd=lambda values: values.std(ddof=0), n="size").reset_index()


def found_segments(model: Model) -> pd.DataFrame:
    """Return the segments of head and melody patterns in the training records (schema ``head_segments``)."""
    parts = []
    for stretch, example in enumerate(model.examples):
        for place, stage in enumerate((model.stage.head, model.stage.melody)):
            labels = np.array(stage.labels, dtype=object)[example.symbols[:, place]]
            own = segments.from_labels(example.record, labels, model.stage.fps)
            start_s = example.first / model.stage.fps
            moved = own[["record", "segment", "label"]].assign(
                stretch=stretch,
                stream=("head", "melody")[place],
                start_s=own["start_s"] + start_s,
                end_s=own["end_s"] + start_s,
            )
            parts.append(moved)
    return pd.concat(parts, ignore_index=True)


def stages(model: Model, speech: Speech, seed: int) -> pd.DataFrame:
    """Return the first angles that are generated, before and after the filters (schema ``head_generation``)."""
    heard = MelodyLabeller(model.stage.melody.hmm, model.lags.melody)
    if speech.melody is None:
        return tables.empty("head_generation")
    labels = np.append(heard.hear(features.melody_features(speech.melody)), heard.end())
    frames = features.melody_frames(int(len(labels) * model.stage.fps / features.MELODY_HZ), model.stage.fps)
    gesture = whole(labeller(model, "head"), labels[frames])[: round(SHOWN_S * model.stage.fps)]
    parts = []
    for stage in ("drawn", "median", "printed", "kept"):
        own = generation.of_stage(stage)
        how = Style(model.style.overlap, model.style.ahead, own.filters)
        noise = model.noise["head"] if stage == "kept" else NO_NOISE
        rng = random_source(seed, "head", speech.record)
        head = Generator(generation.patterns_of(model.stage.head), how, noise, rng, own.n_filters)
        angles = np.concatenate([head.hear(gesture), head.end()])
        table = pd.DataFrame(angles, columns=list(ANGLES))
        table.insert(0, "stage", stage)
        table.insert(1, "time_s", segments.frame_times(len(angles), model.stage.fps))
        table["pattern"] = np.array(model.stage.head.labels, dtype=object)[gesture]
        parts.append(table)
    return pd.concat(parts, ignore_index=True)
