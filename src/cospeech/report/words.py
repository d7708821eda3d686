"""How the report calls things: gestures, measures, scenarios, quantities."""

from __future__ import annotations

from typing import NamedTuple


class Gesture(NamedTuple):
    """A gesture class of Özkul 2012, Table 4.1, in few words."""

    number: str
    title: str
    details: str


GESTURES = {
    "raise_both": Gesture("g1", "both raised", "both hands go up at the same time"),
    "rest": Gesture("g2", "rest", "the actor stands by, hands down"),
    "left": Gesture("g3", "left hand", "only the left hand goes up"),
    "perpendicular": Gesture("g4", "perpendicular", "one hand moves up and down, the other sideways"),
    "contact": Gesture("g5", "contact", "the hands touch one another"),
    "open": Gesture("g6", "arms open", "the arms stretch backward"),
    "right": Gesture("g7", "right hand", "only the right hand goes up"),
}


class Measure(NamedTuple):
    """A score as the report calls it; ``better`` is more, less, or near 1."""

    title: str
    unit: str
    better: str
    meaning: str


MEASURES = {
    "S": Measure("S", "", "more", "how alike the histograms of phrase durations are (cosine, eq. 7.1 and 7.3)"),
    "D": Measure(
        "D", "s", "less", "how far synthesised boundaries lie from the nearest actual one (eq. 7.2 and 7.4)"
    ),
    "boundary_f1": Measure("boundary F1", "", "more", "boundaries found, one to one, within the tolerance"),
    "phrase_ratio": Measure("phrase ratio", "", "near 1", "synthesised phrases for each actual one"),
    "frames_right": Measure("frames right", "", "more", "share of frames with the right gesture"),
    "kappa": Measure("kappa", "", "more", "frames right beyond what chance gives (Cohen)"),
}

SCENARIOS = {
    "memory": "telling a memory",
    "documentary": "retelling a documentary",
    "fairy_tale": "retelling a fairy tale",
    "agent": "conversation with an agent",
    "watch_and_tell": "watch and tell",
}

MONOLOGUES = ("memory", "documentary", "fairy_tale")
"""The scenarios of one speaker alone (Özkul 2012, 3.2)."""

ROLES = {
    "system": "driven by the record's own speech",
    "wrong speech": "the same decoder under the wrong speech",
    "control": "controls without speech",
    "ceiling": "ceilings: know what no system may know",
}


def gesture(label: str) -> str:
    """Return the name of a gesture class for a reader."""
    return GESTURES[label].title if label in GESTURES else label.replace("_", " ")


def scenario(name: str) -> str:
    """Return the name of a scenario for a reader."""
    return SCENARIOS.get(name, name.replace("_", " "))


def seconds(value: float) -> str:
    """Return a bin width or duration in the unit a reader likes: ms below a tenth of a second."""
    return f"{1000 * value:g} ms" if value < 0.1 else f"{value:g} s"


def counted(number: int, thing: str) -> str:
    """Return a number of things, ``1 actor`` or ``2 actors``."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def measure(name: str, bin_s: float | None = None) -> str:
    """Return the heading of a measure, with its unit and the bin width of S."""
    known = MEASURES[name]
    if bin_s is not None and bin_s == bin_s:
        return f"{known.title} ({seconds(bin_s)} bins)"
    return f"{known.title} ({known.unit})" if known.unit else known.title
