"""What the annotation files of all formats have in common: tiers of labelled intervals."""

from __future__ import annotations

from typing import NamedTuple


class Interval(NamedTuple):
    """A labelled interval in seconds; ``place`` says where it stands in its file, for messages."""

    start_s: float
    end_s: float
    label: str
    place: str
