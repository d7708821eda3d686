"""Parallel HMMs with named branches and features: conversion to and from tables, decoding, training history."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import parallel
from cospeech.markov.parallel import Clamp, ParallelHMM


class LabelledHMM(NamedTuple):
    """A parallel HMM with a label for each branch and a name for each feature."""

    hmm: ParallelHMM
    labels: tuple[str, ...]
    features: tuple[str, ...]


def to_table(model: LabelledHMM) -> pd.DataFrame:
    """Return the model as a table of schema ``hmm_model``: one row per branch, state and feature."""
    branch, state, feature = (index.ravel() for index in np.indices(model.hmm.mean.shape))
    return pd.DataFrame(
        {
            "branch": np.array(model.labels, dtype=object)[branch],
            "state": state,
            "entry_probability": model.hmm.entry[branch],
            "stay_probability": model.hmm.stay[branch, state],
            "feature": np.array(model.features, dtype=object)[feature],
            "mean": model.hmm.mean.ravel(),
            "variance": model.hmm.variance.ravel(),
        }
    )


def from_table(table: pd.DataFrame) -> LabelledHMM:
    """Return the model stored in a table of schema ``hmm_model``."""
    labels, features = tuple(dict.fromkeys(table["branch"])), tuple(dict.fromkeys(table["feature"]))
    shape = (len(labels), int(table["state"].max()) + 1, len(features))
    if len(table) != np.prod(shape):
        raise UserError(
            f"a model of {shape[0]} branches, {shape[1]} states and {shape[2]} features needs {np.prod(shape)} rows, "
            f"but its table has {len(table)}; train it again"
        )
    entry, stay, mean, variance = (
        table[name].to_numpy(dtype=float).reshape(shape)
        for name in ("entry_probability", "stay_probability", "mean", "variance")
    )
    return LabelledHMM(ParallelHMM(entry[:, 0, 0], stay[:, :, 0], mean, variance), labels, features)


def feature_matrix(table: pd.DataFrame, features: tuple[str, ...]) -> Floats:
    """Return the ``features`` of a table as an array (T, D)."""
    return np.ascontiguousarray(table[list(features)].to_numpy(dtype=float))


def phrases(
    model: LabelledHMM,
    record: str,
    table: pd.DataFrame,
    fps: float,
    clamp: Clamp | None = None,
    merged: tuple[str, ...] = (),
) -> pd.DataFrame:
    """Return the segments (schema ``segments``) of the most likely path through the features of a record.

    Each pass through a branch is a segment, except that consecutive passes of a class in ``merged`` form one segment.
    """
    path = parallel.decode(model.hmm, feature_matrix(table, model.features), clamp)
    labels = np.array(model.labels, dtype=object)[path.branch]
    return segments.from_labels(record, labels, fps, path.begins & ~np.isin(labels.astype(str), merged))


def fit_table(fit: parallel.Fit, sequences: list[Floats], restart: int) -> pd.DataFrame:
    """Return the training history of one restart (schema ``hmm_fit``), with the fitness in the last row."""
    paths = [parallel.decode(fit.model, frames) for frames in sequences]
    used = np.unique(np.concatenate([path.branch for path in paths]))
    alpha = parallel.alpha(fit.log_likelihoods[-1], sum(len(frames) for frames in sequences))
    n_rows = len(fit.log_likelihoods)
    last = np.arange(n_rows) == n_rows - 1
    return pd.DataFrame(
        {
            "restart": restart,
            "iteration": np.arange(n_rows),
            "log_likelihood": fit.log_likelihoods,
            "alpha": np.where(last, alpha, np.nan),
            "beta": np.where(last, parallel.beta(fit.model, sequences, paths), np.nan),
            "unused_branches": np.where(last, len(fit.model.entry) - len(used), np.nan),
        }
    )
