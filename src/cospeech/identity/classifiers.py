"""Classifiers of one stream of features: a word HMM for each speaker, and a world model (Sargin 2006, 2.1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.markov import word_hmm
from cospeech.markov.word_hmm import Clips, WordHMMs


class Settings(NamedTuple):
    """How word models are trained.

    Attributes
    ----------
    states : number of states.
    iterations : maximum number of iterations of Baum-Welch.
    tolerance : training ends when the log-likelihood gain per frame falls below this.
    variance_floor : minimum variance, as a share of that of the training frames.
    """

    states: int = 6
    iterations: int = 10
    tolerance: float = 1e-3
    variance_floor: float = 0.01


def train(training: Clips, owner: Integers, n_speakers: int, settings: Settings) -> WordHMMs:
    """Return the models of all speakers, followed by the world model, which is trained on the clips of all of them.

    Parameters
    ----------
    training : C clips.
    owner : (C,) index of the speaker of each.
    n_speakers : number of speakers.
    settings : how they are trained.
    """
    twice = np.concatenate([np.arange(len(owner)), np.arange(len(owner))])
    clips, models = training.chosen(twice), np.concatenate([owner, np.full(len(owner), n_speakers)])
    floor = np.maximum(settings.variance_floor * variance(training), np.finfo(float).tiny)
    begun = word_hmm.start(clips, models, n_speakers + 1, settings.states, floor)
    return word_hmm.fit(begun, clips, models, floor, settings.iterations, settings.tolerance).models


def variance(clips: Clips) -> Floats:
    """Return the variance (D,) of the frames of clips, without a copy of them."""
    parts = [clips.frames[begin : begin + n] for begin, n in zip(clips.begin, clips.length, strict=True)]
    n_frames = sum(map(len, parts))
    mean = np.sum([part.sum(axis=0) for part in parts], axis=0) / n_frames
    squares = [((part - mean) ** 2).sum(axis=0) for part in parts]
    return np.asarray(np.sum(squares, axis=0) / n_frames)


def log_ratios(models: WordHMMs, clips: Clips) -> Floats:
    """Return rho (2.1) of each clip and speaker, (C, R): log P(clip | speaker) - log P(clip | world)."""
    found = word_hmm.log_likelihoods(models, clips)
    return np.ascontiguousarray(found[:, :-1] - found[:, -1:])
