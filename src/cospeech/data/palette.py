"""The colour of each gesture class, in figures and videos alike."""

from __future__ import annotations

GESTURE_COLOURS = {
    "raise_both": "#783e8d",
    "rest": "#b4bac2",
    "left": "#37a4e7",
    "perpendicular": "#266d5e",
    "contact": "#ee9073",
    "open": "#d6ba3d",
    "right": "#be4b1a",
}
"""The classes of Özkul 2012, Table 4.1. Any two lie at least 25 apart in CIELAB, for colour-blind eyes as well."""

MORE_COLOURS = ("#5c6bc0", "#8d9440", "#c2649a", "#4a7f9c", "#9c6b4f", "#3f9142", "#7d7d2a", "#b08fd8")


def gesture_colour(label: str) -> str:
    """Return the colour of a gesture class; a class that Table 4.1 does not know gets one by its letters."""
    return GESTURE_COLOURS.get(label, MORE_COLOURS[sum(label.encode()) % len(MORE_COLOURS)])
