"""The model of controls that estimate nothing: the gesture phrases of the training records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from cospeech.synthesis.interface import Training

Pool = Mapping[str, pd.DataFrame]
"""Segment table of each training record, on the prosody frame."""


def train(training: Training, settings: Mapping[str, Any]) -> Pool:
    """Return the gesture phrases of the training records."""
    return training.gestures


def to_tables(model: Pool) -> dict[str, pd.DataFrame]:
    """Return the phrases as one segment table."""
    return {"pool": pd.concat(model.values(), ignore_index=True)}


def from_tables(tables: Mapping[str, pd.DataFrame]) -> Pool:
    """Return the phrases of a segment table by record."""
    return {str(name): table.reset_index(drop=True) for name, table in tables["pool"].groupby("record", sort=False)}
