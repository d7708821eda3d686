"""Random subunits: whenever one is over, another one follows (the control of the surveys, Levine 2009, 6.1)."""

from __future__ import annotations

from cospeech.synthesis.bodylanguage.model import Model, from_tables, to_tables, train
from cospeech.synthesis.bodylanguage.player import Player, end, step
from cospeech.synthesis.live import Stream

__all__ = ["end", "from_tables", "start", "step", "to_tables", "train"]


def start(model: Model, stream: Stream, seed: int) -> Player:
    """Return the state before anything is heard."""
    return Player(model, stream, seed, by_model=False, at_syllables=False)
