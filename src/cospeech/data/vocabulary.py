"""Names that data, methods and figures share: gesture classes and their colours, prosody clusters, scenarios."""

from __future__ import annotations

GESTURES = ("raise_both", "rest", "left", "perpendicular", "contact", "open", "right")
"""The gesture phrase classes g1 to g7, in the order of Özkul 2012, Table 4.1."""

GESTURE_COLOURS = {
    "raise_both": "#783e8d",
    "rest": "#b4bac2",
    "left": "#37a4e7",
    "perpendicular": "#266d5e",
    "contact": "#ee9073",
    "open": "#d6ba3d",
    "right": "#be4b1a",
}
"""The colour of each of them, in figures and in videos. Any two are at least 25 apart in CIELAB, also as seen by
colour-blind readers."""

MORE_COLOURS = ("#5c6bc0", "#8d9440", "#c2649a", "#4a7f9c", "#9c6b4f", "#3f9142", "#7d7d2a", "#b08fd8")

SCENARIOS = ("memory", "documentary", "fairy_tale", "watch_and_tell")
"""The scenarios of Özkul 2012, 3.2, in which one person speaks or tells what they watched."""


def gesture_colour(label: str) -> str:
    """Return the colour of a gesture class; for a class that is not in ``GESTURES`` it depends on the name alone."""
    return GESTURE_COLOURS.get(label, MORE_COLOURS[sum(label.encode()) % len(MORE_COLOURS)])


def prosody_labels(clusters: int) -> tuple[str, ...]:
    """Return the names p1 ... pM of the prosody clusters."""
    return tuple(f"p{m}" for m in range(1, clusters + 1))
