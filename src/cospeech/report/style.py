"""How every figure looks, and how it is written as the same bytes each time."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterable
from typing import Any, Literal

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.data import tables, vocabulary

matplotlib.use("Agg")

INK = "#22262b"
"""Text and axes; the page replaces it by its own text colour."""
FAINT = "#7b828c"
"""Secondary text, controls, references."""
GRID = "#dfe3e8"
PAPER = "#fffffe"
"""Background of marks that cover what is below; figures themselves have none in SVG."""

BLUE, VERMILLION, AMBER, GREEN, PURPLE = "#2278b5", "#d55e00", "#e08f00", "#009e73", "#a05fa8"
BROWN, SKY = "#7a4f2b", "#56b4e9"

ROLE_COLOURS = {"system": BLUE, "wrong speech": VERMILLION, "control": FAINT, "ceiling": AMBER}

WIDTH_IN = 9.2
"""Width of a figure that fills the page."""

_RC: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "svg.fonttype": "path",
    "svg.hashsalt": "cospeech",
    "savefig.facecolor": "none",
}


def gesture_colours(labels: Iterable[str]) -> dict[str, str]:
    """Return the colour of each gesture, the same in every figure and video."""
    return {label: vocabulary.gesture_colour(label) for label in labels}


def system_colours(names: Iterable[str]) -> dict[str, str]:
    """Return a colour for each system of a figure; the ninth has that of the first again, and so on."""
    colours = (VERMILLION, BLUE, GREEN, PURPLE, AMBER, FAINT, BROWN, SKY)
    return dict(zip(names, itertools.cycle(colours), strict=False))


def figure(height_in: float, rows: int = 1, columns: int = 1, **keywords: Any) -> tuple[Figure, Any]:
    """Return a new figure of the page's width, and its axes (always a 2-D array)."""
    plt.rcParams.update(_RC)  # type: ignore[arg-type]
    new, axes = plt.subplots(
        rows, columns, figsize=(WIDTH_IN, height_in), layout="constrained", squeeze=False, **keywords
    )
    return new, axes


def ticks_off(axes: Axes, which: Literal["x", "y", "both"] = "both") -> None:
    """Remove the tick marks of an axis but not its labels."""
    axes.tick_params(axis=which, length=0)


def as_svg(drawn: Figure) -> str:
    """Return a figure as the text of an SVG (text as outlines, no background), without a date."""
    plt.rcParams.update(_RC)  # type: ignore[arg-type]
    target = io.StringIO()
    drawn.savefig(target, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(drawn)
    return target.getvalue()


def save(drawn: Figure, svg: str, png: str) -> None:
    """Write a figure as SVG (text as outlines, no background) and as PNG (on white), without a date."""
    plt.rcParams.update(_RC)  # type: ignore[arg-type]
    drawn.draw_without_rendering()  # lay it out once, not for each format
    drawn.set_layout_engine("none")
    with tables.replacing(svg) as temporary:
        drawn.savefig(temporary, format="svg", metadata={"Date": None, "Creator": None})
    with tables.replacing(png) as temporary:
        drawn.savefig(temporary, format="png", dpi=150, facecolor="white", metadata={"Software": None})
    plt.close(drawn)
