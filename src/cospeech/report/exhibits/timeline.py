"""One record from its speech to its gestures: the first figure that a reader should understand."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from cospeech.report import style, words
from cospeech.report.exhibits.run import Drawing, Run

LONGEST_S = 60.0
"""Only the middle of a longer record is shown, for this long."""


def draw(
    run: Run,
    prosody: pd.DataFrame,
    clusters: pd.DataFrame,
    actual: pd.DataFrame,
    synthesised: dict[str, pd.DataFrame],
    labels: list[str],
    voiced_gain: float,
) -> Drawing:
    """Draw one record from its speech to its gestures.

    Parameters
    ----------
    prosody : the prosody frames of the record.
    clusters : the prosody segments of all records of its fold.
    actual, synthesised : the gesture segments of the record; those of each system.
    labels : the gesture classes.
    voiced_gain : pitch is drawn where its gain is above this.
    """
    record = actual["record"].iloc[0]
    sequences = {"actual": actual} | {run.titles[system]: table for system, table in synthesised.items()}
    table = strips(clusters[clusters["record"] == record], sequences)
    return Drawing(table, figure(prosody, table, labels, voiced_gain))


def window(duration_s: float) -> tuple[float, float]:
    """Return start and end of what the figure shows of a record, in seconds."""
    start = max(0.0, (duration_s - LONGEST_S) / 2)
    return start, min(duration_s, start + LONGEST_S)


def strips(clusters: pd.DataFrame, sequences: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the segments of all strips as one table: strip, start_s, end_s, label.

    Parameters
    ----------
    clusters : the prosody segments of the record.
    sequences : its gesture segments, by name from top to bottom.
    """
    named = {"prosody clusters": clusters, **sequences}
    columns = ["start_s", "end_s", "label"]
    return pd.concat([table[columns].assign(strip=name) for name, table in named.items()], ignore_index=True)[
        ["strip", *columns]
    ]


def figure(prosody: pd.DataFrame, table: pd.DataFrame, labels: list[str], voiced_gain: float) -> Figure:
    """Draw intensity and pitch of a record above strips of its prosody clusters and gesture phrases.

    Parameters
    ----------
    prosody : the prosody frames of the record.
    table : from ``strips``.
    labels : the gesture classes.
    voiced_gain : pitch is drawn where its gain is above this.
    """
    low, high = window(float(table["end_s"].max()))
    names = list(dict.fromkeys(table["strip"]))
    heights = [1.5, *[0.42] * len(names)]
    drawn, axes = style.figure(
        0.75 + 0.62 * sum(heights), len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights, "hspace": 0}
    )
    _speech(axes[0, 0], prosody[prosody["time_s"].between(low, high)], voiced_gain)
    colours = style.gesture_colours(labels)
    for panel, name in zip(axes[1:, 0], names, strict=True):
        _strip(panel, table[table["strip"] == name], name, colours, low, high)
    axes[-1, 0].spines["bottom"].set_visible(True)
    axes[-1, 0].tick_params(axis="x", length=3)
    axes[-1, 0].set_xlabel("time (s)")
    axes[0, 0].set_xlim(low, high)
    handles = [Patch(color=colours[label], label=words.gesture(label)) for label in labels]
    drawn.legend(handles=handles, loc="outside lower center", ncols=min(7, len(labels)), handlelength=1.0)
    return drawn


def _speech(axes: Axes, prosody: pd.DataFrame, voiced_gain: float) -> None:
    time_s = prosody["time_s"].to_numpy()
    intensity = prosody["intensity"].to_numpy()
    axes.fill_between(time_s, intensity.min(), intensity, color=style.BLUE, alpha=0.22, lw=0)
    axes.set_ylabel("intensity\n(standardised)", color=style.BLUE, fontsize=8)
    axes.yaxis.set_major_locator(MaxNLocator(4, prune="lower"))  # the lowest would lie over the strip below
    axes.spines["bottom"].set_visible(False)
    axes.tick_params(axis="x", length=0, labelbottom=False)
    if prosody["lag_s"].notna().any():
        pitch, unit = 1.0 / prosody["lag_s"].to_numpy(dtype=float), "pitch (Hz)"
    else:
        pitch, unit = -1000.0 * prosody["pitch_lag"].to_numpy(dtype=float), "pitch\n(-lag, ms)"
    voiced = prosody["pitch_gain"].to_numpy() > voiced_gain
    right = axes.twinx()
    right.plot(time_s[voiced], pitch[voiced], ls="none", marker=".", ms=2.2, color=style.VERMILLION)
    right.yaxis.set_major_locator(MaxNLocator(4, prune="lower"))
    right.set_ylabel(unit, color=style.VERMILLION, fontsize=8)
    right.spines["right"].set_visible(True)
    right.spines["bottom"].set_visible(False)
    right.tick_params(axis="x", length=0)


def _strip(axes: Axes, table: pd.DataFrame, name: str, colours: dict[str, str], low: float, high: float) -> None:
    shown = table[(table["end_s"] > low) & (table["start_s"] < high)]
    start, end = shown["start_s"].clip(lower=low).to_numpy(), shown["end_s"].clip(upper=high).to_numpy()
    labels = shown["label"].to_numpy(dtype=object)
    known = labels[0] in colours
    spans = list(zip(start, end - start, strict=True))
    if known:
        axes.broken_barh(spans, (-0.43, 0.86), facecolors=[colours[label] for label in labels], lw=0)
        axes.vlines(start[1:], -0.43, 0.43, color=style.PAPER, lw=0.8)
    else:
        shades = [(*to_rgb(style.FAINT), 0.25 + 0.2 * (place % 2)) for place in range(len(labels))]
        axes.broken_barh(spans, (-0.43, 0.86), facecolors=shades, lw=0)
        for left, width, label in zip(start, end - start, labels, strict=True):
            if width > 0.012 * (high - low):
                number = str(label).removeprefix("p")
                axes.text(left + width / 2, 0, number, ha="center", va="center_baseline", fontsize=6.5)
    axes.set(ylim=(-0.5, 0.5), yticks=[0])
    axes.set_yticklabels([name])
    for side in axes.spines.values():
        side.set_visible(False)
    style.ticks_off(axes)
    axes.tick_params(axis="x", labelbottom=axes.get_subplotspec().is_last_row())  # type: ignore[union-attr]
