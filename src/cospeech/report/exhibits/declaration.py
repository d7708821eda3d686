"""What an exhibit declares about itself. Nothing here loads pandas or matplotlib, as the Snakefile imports it."""

from __future__ import annotations

import importlib
import itertools
import string
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

PACKAGE = "cospeech.report.exhibits"

OZKUL_2012 = "Özkul 2012"
"""S. Özkul, "Speech Driven Upper Body Gesture Analysis and Synthesis", Koç University, 2012."""

LEVINE_2010 = "Levine et al. 2010"
"""S. Levine, P. Krähenbühl, S. Thrun and V. Koltun, "Gesture Controllers", ACM Trans. Graph. 29 (4), 2010."""

LEVINE_2009 = "Levine 2009"
"""S. Levine, "Body Language Animation Synthesis from Prosody", honors thesis, Stanford University, 2009."""

SARGIN_2006 = "Sargin 2006"
"""M. E. Sargin, "Audio-Visual Correlation Modeling for Speaker Identification and Synthesis", Koç Univ., 2006."""

Names = Mapping[str, Sequence[Any]]
"""What the placeholders of a source's path may stand for."""


@dataclass(frozen=True)
class Source:
    """One kind of artifact that exhibits are made from.

    Attributes
    ----------
    path : below the run's results. A placeholder stands for each of its ``Names`` in turn.
    schema : of the table; None for a picture.
    """

    path: str
    schema: str | None = None

    @property
    def placeholders(self) -> list[str]:
        """The placeholders of the path, in order: ``system`` for ``{system.name}`` and ``{system.variant}``."""
        found = (name for _, name, _, _ in string.Formatter().parse(self.path) if name)
        return list(dict.fromkeys(name.partition(".")[0] for name in found))

    def paths(self, names: Names) -> list[str]:
        """Return the path of every file, the last placeholder changing fastest."""
        combined = itertools.product(*(names[name] for name in self.placeholders))
        return [self.path.format(**dict(zip(self.placeholders, values, strict=True))) for values in combined]


@dataclass(frozen=True)
class Section:
    """A section of the page; its opening paragraphs are ``reports/template/sections/<anchor>.html.jinja``, if any."""

    anchor: str
    title: str
    short: str


@dataclass(frozen=True)
class Condition:
    """What a run must have for some exhibits.

    Attributes
    ----------
    name : under which an exhibit names it in ``needs``.
    absent : the clause that the page prints where the run does not meet it.
    also : what else is missing then, apart from exhibits.
    """

    name: str
    absent: str
    also: str = ""


@dataclass(frozen=True)
class Exhibit:
    """One figure or table of the report.

    Functions are named ``module:function``, in this package, and imported only by the job that calls them.

    Attributes
    ----------
    name : of its files, and of its caption ``reports/template/captions/<name>.rst``.
    section : anchor of the section in which the page shows it.
    draw : ``(run, **sources, **settings) -> Drawing``.
    document : whose exhibit it reproduces; None for our own.
    figure : whether it is drawn, as SVG and PNG.
    numbers : whether its numbers are written, as CSV.
    sources : by argument of ``draw``, the name of a source.
    settings : by argument of ``draw``, a setting in the configuration, as ``speech.voiced_gain``.
    needs : names of the conditions under which a run has it.
    show : ``(run, numbers) -> object`` that the page renders next to the picture, or None.
    template : with which the page renders it; below ``reports/template``.
    published : its key in ``reports/template/published.yaml``, where ``compare`` needs one.
    compare : ``(run, numbers, facts) -> list of Pair``: the published values next to ours, or None.
    """

    name: str
    section: str
    draw: str
    document: str | None = None
    figure: bool = True
    numbers: bool = True
    sources: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    show: str | None = None
    template: str = "table.html.jinja"
    published: str | None = None
    compare: str | None = None

    @property
    def figures(self) -> list[str]:
        """Its pictures, below the run's reports."""
        return [f"figures/{self.name}.{kind}" for kind in ("svg", "png")] if self.figure else []

    @property
    def tables(self) -> list[str]:
        """Its table of numbers, below the run's reports."""
        return [f"tables/{self.name}.csv"] if self.numbers else []

    @property
    def files(self) -> list[str]:
        """All its files, below the run's reports."""
        return [*self.figures, *self.tables]


class Absent(NamedTuple):
    """What a run does not show, and why."""

    reason: str
    names: list[str]


def load(function: str) -> Any:
    """Import and return a function that is named ``module:function``."""
    module, _, name = function.partition(":")
    return getattr(importlib.import_module(f"{PACKAGE}.{module}"), name)


def modules(exhibits: Iterable[Exhibit]) -> list[str]:
    """Return the modules with the functions of some exhibits, by import path."""
    functions = (name for exhibit in exhibits for name in (exhibit.draw, exhibit.show, exhibit.compare) if name)
    return sorted({f"{PACKAGE}.{function.partition(':')[0]}" for function in functions})


def setting(config: Mapping[str, Any], path: str) -> Any:
    """Return a setting, named as ``speech.voiced_gain``."""
    found: Any = config
    for key in path.split("."):
        found = found[key]
    return found
