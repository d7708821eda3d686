"""The cross table: what each system gains from speech in each world of the studio."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cospeech.report import style, words
from cospeech.report.exhibits.declaration import LEVINE_2009, LEVINE_2010, OZKUL_2012
from cospeech.report.exhibits.run import Drawing, Run
from cospeech.report.page.tables import Table
from cospeech.report.systems import System, driven
from cospeech.workflow.config import ActorWorld, actor_worlds

MEASURES = ("hand_speed_r", "kappa", "boundary_f1", "beat_alignment", "frechet_distance")
"""What the cross table shows: measures that apply to every system, as they need nothing but its motion."""

DRAWN = MEASURES[:-1]
"""The measures in the figure; the Fréchet distance has another scale and stands in the table."""

CEILING = "beat_alignment"
"""The measure in which the recorded motion marks what can be gained; in the others, this is known."""

RECORDED = "recorded motion (value)"
"""Heading of the rows of the table with what the recorded motion itself reaches."""

MOST_COLUMNS = 7
"""Largest number of actors next to one another in the figure."""

ASSUMED_BY = {"phrases": OZKUL_2012, "vigour": LEVINE_2010, "syllables": LEVINE_2009}
"""The document whose systems assume what a world plants."""

PLANTED = {
    "phrases": ("kappa", "boundary_f1"),
    "vigour": ("hand_speed_r",),
    "syllables": ("hand_speed_r", "kappa", "boundary_f1", "beat_alignment"),
}
"""The measures in which a system can gain from speech that tells what a world plants.

In the world ``phrases``, speech tells which class of gesture is made, and when it changes. In the world ``vigour``,
it tells how vigorously the hands move, but the form of a gesture is independent of it. In the world ``syllables``, it
tells both when strokes end and which comes next.
"""


def draw(run: Run, differences: pd.DataFrame, scores: pd.DataFrame, studio: dict[str, Any]) -> Drawing:
    """Draw the advantage of each system over itself driven by the same speech at a shift, for each actor.

    Parameters
    ----------
    differences, scores : the tables ``differences`` and ``record_scores``.
    studio : the section ``studio`` of the configuration.
    """
    numbers = cells(run, differences, scores, actor_worlds(studio))
    return Drawing(numbers, figure(numbers))


def cells(run: Run, differences: pd.DataFrame, scores: pd.DataFrame, worlds: dict[str, ActorWorld]) -> pd.DataFrame:
    """Return the cells of the cross table on the interior of records.

    The control is the strictest one of a system, which is driven by the record's own speech at a shift. Phrases are
    those seen in the motion of both; where the control has no motion, they are the planned ones.

    Returns
    -------
    One row per system, actor and measure with the columns system, title, actor, world, coupling, measure, phrases,
    advantage, low, high, p_value, n (records), recorded, expected and found. An advantage in the Fréchet distance is
    a smaller distance. ``recorded`` is the mean that the recorded motion itself reaches. ``expected`` is ``gain``
    where the system assumes what the actor's world plants and the measure shows it, ``none`` where the coupling is
    0, and otherwise ``open``. ``found`` is ``gain`` or ``loss`` where the whole interval is on one side of 0,
    ``none`` where it contains 0, and ``unknown`` where there is no interval.
    """
    interior = differences[differences["part"] == "interior"]
    reached = recorded(scores)
    rows = []
    for system in driven(run.systems):
        own = interior[(interior["system"] == system.name) & interior["other"].isin(system.controls[-1:])]
        seen = own[own["phrases"] == "seen"]
        chosen = seen if len(seen) else own
        for actor, world in worlds.items():
            for measure in MEASURES:
                at = chosen[(chosen["actor"] == actor) & (chosen["measure"] == measure)]
                if len(at):
                    rows.append(_cell(system, actor, world, measure, at.iloc[0], reached.get((actor, measure))))
    columns = ["system", "title", "actor", "world", "coupling", "measure", "phrases",
               "advantage", "low", "high", "p_value", "n", "recorded", "expected", "found"]  # fmt: skip
    return pd.DataFrame(rows, columns=columns)


def recorded(scores: pd.DataFrame) -> dict[tuple[str, str], float]:
    """Return the mean of what the recorded motion reaches on the interior of records, by actor and measure."""
    known = scores[(scores["part"] == "interior") & scores["recorded"].notna()]
    of_record = known.drop_duplicates(["actor", "record", "measure"])
    means = of_record.groupby(["actor", "measure"])["recorded"].mean()
    return {(actor, measure): float(value) for (actor, measure), value in zip(means.index, means, strict=True)}


def _cell(
    system: System, actor: str, world: ActorWorld, measure: str, row: pd.Series, reached: float | None
) -> dict[str, Any]:
    coupled = world.coupling > 0.0 or any(world.couplings.values())
    assumed = ASSUMED_BY.get(world.world)
    gains = assumed is not None and system.source.startswith(assumed) and measure in PLANTED[world.world]
    less = words.MEASURES[measure].better == "less"
    low, high = (-row["high"], -row["low"]) if less else (row["low"], row["high"])
    return {
        "system": system.name,
        "title": system.title,
        "actor": actor,
        "world": world.world,
        "coupling": world.coupling,
        "measure": measure,
        "phrases": row["phrases"],
        "advantage": -row["difference"] if less else row["difference"],
        "low": low,
        "high": high,
        "p_value": row["p_value"],
        "n": row["n"],
        "recorded": reached,
        "expected": "none" if not coupled else "gain" if gains else "open",
        "found": "unknown" if pd.isna(low) else "gain" if low > 0.0 else "loss" if high < 0.0 else "none",
    }


def table(run: Run, numbers: pd.DataFrame) -> Table:
    """Return the cross table for the page; an asterisk marks intervals that exclude 0."""
    actors = numbers.drop_duplicates("actor")
    rows = _recorded_rows(numbers, list(actors["actor"]))
    for (system, measure), group in numbers.groupby(["system", "measure"], sort=False):
        own = group.set_index("actor")
        found = [_text(own.loc[actor]) if actor in own.index else "–" for actor in actors["actor"]]
        rows.append([run.titles[str(system)], words.MEASURES[str(measure)].title, *found])
    return Table.of(["system", "measure", *_headings(actors)], rows, words=(1,))


def _recorded_rows(numbers: pd.DataFrame, actors: list[str]) -> list[list[str]]:
    """Return what the recorded motion reaches in the measures where this is not known beforehand."""
    rows = []
    for measure in (CEILING, "frechet_distance"):
        own = numbers[(numbers["measure"] == measure) & numbers["recorded"].notna()]
        reached = own.drop_duplicates("actor").set_index("actor")["recorded"]
        if len(reached):
            found = [words.number(reached[actor]) if actor in reached.index else "–" for actor in actors]
            rows.append([RECORDED, words.MEASURES[measure].title, *found])
    return rows


def _headings(actors: pd.DataFrame) -> list[str]:
    return [
        f"{actor}: world {world}, coupling {coupling:g}"
        for actor, world, coupling in zip(actors["actor"], actors["world"], actors["coupling"], strict=True)
    ]


def _text(cell: pd.Series) -> str:
    if pd.isna(cell["low"]):
        return words.number(cell["advantage"], signed=True)
    low, high = (words.number(cell[name], signed=True) for name in ("low", "high"))
    mark = "*" if cell["found"] in ("gain", "loss") else ""
    return f"{words.number(cell['advantage'], signed=True)}{mark} ({low} to {high})"


def figure(numbers: pd.DataFrame) -> Figure:
    """Draw one panel per system and actor, in it one interval per measure, filled where it excludes 0.

    If there are many actors, the rows of all systems are repeated for the next ``MOST_COLUMNS`` of them.
    """
    titles = numbers.drop_duplicates("system")[["system", "title"]]
    actors = numbers.drop_duplicates("actor")
    n_systems, n_columns = max(1, len(titles)), min(max(1, len(actors)), MOST_COLUMNS)
    n_blocks = max(1, math.ceil(len(actors) / n_columns))
    n_rows = n_systems * n_blocks
    drawn, axes = style.figure(0.3 + 0.5 * n_blocks + 0.85 * n_rows, n_rows, n_columns, sharex=True, sharey=True)
    axes[0, 0].set_xlim(_range(numbers[numbers["measure"].isin(DRAWN)]))
    for panel in axes.flat:  # with many panels, rescaling shared axes after every mark would take minutes
        panel.set_autoscale_on(False)
    for place, (actor, world, coupling) in enumerate(
        zip(actors["actor"], actors["world"], actors["coupling"], strict=True)
    ):
        first, column = n_systems * (place // n_columns), place % n_columns
        for row, system in enumerate(titles["system"]):
            own = numbers[(numbers["system"] == system) & (numbers["actor"] == actor)]
            _panel(axes[first + row, column], own)
        axes[first, column].set_title(f"{world},\ncoupling {coupling:g}")
    for row in range(n_rows):
        title = textwrap.fill(titles["title"].iloc[row % n_systems], 12) if len(titles) else ""
        axes[row, 0].set_ylabel(title, rotation=0, ha="right", va="center", fontweight="bold")
    for column in range((len(actors) - 1) % n_columns + 1, n_columns):
        axes[n_rows - n_systems - 1, column].tick_params(labelbottom=True)
        for row in range(n_rows - n_systems, n_rows):
            axes[row, column].axis("off")
    axes[0, 0].set_yticks(range(len(DRAWN)), [words.MEASURES[name].title for name in DRAWN])
    axes[0, 0].set_ylim(len(DRAWN) - 0.4, -0.6)
    label = "advantage over the same system driven by the same speech at a shift"
    if numbers.loc[numbers["measure"] == CEILING, "recorded"].notna().any():
        label = f"{label}  ( | : recorded motion)"
    drawn.supxlabel(label, fontsize=9)
    return drawn


def _range(drawn: pd.DataFrame) -> tuple[float, float]:
    """Return the ends of the horizontal axis: they enclose all marks and 0."""
    marks = np.append(drawn[["low", "high", "advantage"]].to_numpy(dtype=float), 0.0)
    marks = np.append(marks, drawn.loc[drawn["measure"] == CEILING, "recorded"].to_numpy(dtype=float))
    low, high = float(np.nanmin(marks)), float(np.nanmax(marks))
    margin = 0.05 * ((high - low) or 1.0)
    return low - margin, high + margin


def _panel(axes: Axes, own: pd.DataFrame) -> None:
    own = own[own["measure"].isin(DRAWN)]
    places = [DRAWN.index(measure) for measure in own["measure"]]
    colours = [{"gain": style.BLUE, "loss": style.VERMILLION}.get(found, style.FAINT) for found in own["found"]]
    inside = np.where(own["found"].isin(["gain", "loss"]), colours, style.PAPER)
    axes.hlines(places, own["low"], own["high"], colors=colours, lw=1.6)
    axes.scatter(own["advantage"], places, s=20, facecolors=inside.tolist(), edgecolors=colours, zorder=3)
    for value in own.loc[own["measure"] == CEILING, "recorded"].dropna():
        axes.plot(value, DRAWN.index(CEILING), marker="|", ms=9, mew=1.4, color=style.INK)
    axes.axvline(0, color=style.INK, lw=0.8)
    axes.grid(axis="x")
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
