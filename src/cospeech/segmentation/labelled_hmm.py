"""A trained parallel HMM as tables, and back: the room keeps no other form of a model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import parallel
from cospeech.markov.parallel import Clamp, ParallelHMM


class Labelled(NamedTuple):
    """A parallel HMM whose branches and features have names."""

    hmm: ParallelHMM
    labels: tuple[str, ...]
    features: tuple[str, ...]


def to_table(model: Labelled) -> pd.DataFrame:
    """Return the model as a table of schema ``hmm_model``: one row a branch, state and feature."""
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


def from_table(table: pd.DataFrame) -> Labelled:
    """Return the model of a table of schema ``hmm_model``."""
    labels, features = tuple(dict.fromkeys(table["branch"])), tuple(dict.fromkeys(table["feature"]))
    shape = (len(labels), int(table["state"].max()) + 1, len(features))
    if len(table) != np.prod(shape):
        raise UserError(
            f"a model of {shape[0]} branches, {shape[1]} states and {shape[2]} features has not {len(table)} rows"
        )
    entry, stay, mean, variance = (
        table[name].to_numpy(dtype=float).reshape(shape)
        for name in ("entry_probability", "stay_probability", "mean", "variance")
    )
    return Labelled(ParallelHMM(entry[:, 0, 0], stay[:, :, 0], mean, variance), labels, features)


def frames_of(table: pd.DataFrame, features: tuple[str, ...]) -> Floats:
    """Return the features of a table as (T, D)."""
    return np.ascontiguousarray(table[list(features)].to_numpy(dtype=float))


def phrases(
    model: Labelled,
    record: str,
    table: pd.DataFrame,
    fps: float,
    clamp: Clamp | None = None,
    lasting: tuple[str, ...] = (),
) -> pd.DataFrame:
    """Return the segments (schema ``segments``) of the most likely path through a record's features.

    Each pass through a branch is a segment, but for the classes in ``lasting``: their passes in succession are one.
    """
    path = parallel.decode(model.hmm, frames_of(table, model.features), clamp)
    labels = np.array(model.labels, dtype=object)[path.branch]
    return segments.from_labels(record, labels, fps, path.begins & ~np.isin(labels.astype(str), lasting))


def fit_rows(fit: parallel.Fit, sequences: list[Floats], restart: int) -> pd.DataFrame:
    """Return the training of one restart as rows of schema ``hmm_fit``, its fitness on the last of them."""
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
