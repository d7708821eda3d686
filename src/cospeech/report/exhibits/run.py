"""What a drawing function is given about the run, and what it returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml
from matplotlib.figure import Figure

from cospeech.report import systems
from cospeech.report.systems import Systems

Facts = dict[str, Any]
"""The published facts of one exhibit or subject."""


@dataclass(frozen=True)
class Run:
    """What an exhibit may ask about the run, apart from its sources and settings.

    Attributes
    ----------
    systems : all systems, in the order of every table.
    actors : the actor of each record.
    pictured : names of the systems that figures show.
    in_timeline : names of the systems that are shown for a single record.
    main : clusters and states of the main setting of the prosody clusters.
    published : the published facts, by exhibit or subject.
    heads : the systems that move the head alone, in the order of every table.
    shown_heads : names of those whose heads figures show.
    """

    systems: Systems
    actors: dict[str, str]
    pictured: list[str]
    in_timeline: list[str]
    main: dict[str, int]
    published: dict[str, Facts]
    heads: Systems = field(default_factory=dict)
    shown_heads: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, params: Mapping[str, Any], published: str) -> Run:
        """Return the run that a rule describes to its script; ``published`` is the file of the published facts."""
        return cls(
            systems=systems.from_params(params["systems"]),
            actors=params["actors"],
            pictured=params["pictured"],
            in_timeline=params["in_timeline"],
            main=params["main"],
            published=yaml.safe_load(Path(published).read_text(encoding="utf-8")),
            heads=systems.from_params(params["heads"]),
            shown_heads=params["shown_heads"],
        )

    @property
    def third_party(self) -> list[str]:
        """The systems that other packages brought, and their controls."""
        return [name for name, system in self.systems.items() if system.origin]

    @property
    def titles(self) -> dict[str, str]:
        """The title of each system, and of the actual phrases and the original motion."""
        named = {name: system.title for name, system in self.systems.items()}
        return named | {"actual": "actual", "original": "original"}


class Drawing(NamedTuple):
    """One exhibit: its figure, or a picture that exists already (PNG), and its numbers."""

    numbers: pd.DataFrame | None = None
    figure: Figure | None = None
    picture: bytes | None = None
