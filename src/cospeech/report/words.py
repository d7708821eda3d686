"""How the report names and writes things: gestures, measures, scenarios, numbers."""

from __future__ import annotations

from typing import NamedTuple


class Gesture(NamedTuple):
    """A gesture class of Özkul 2012, Table 4.1."""

    number: str
    title: str
    details: str


GESTURES = {
    "raise_both": Gesture("g1", "both raised", "both hands rise at the same time"),
    "rest": Gesture("g2", "rest", "the actor stands with the hands down"),
    "left": Gesture("g3", "left hand", "only the left hand rises"),
    "perpendicular": Gesture("g4", "perpendicular", "one hand moves vertically, the other horizontally"),
    "contact": Gesture("g5", "contact", "the hands touch"),
    "open": Gesture("g6", "arms open", "the arms move backward"),
    "right": Gesture("g7", "right hand", "only the right hand rises"),
}


class Measure(NamedTuple):
    """A score as the report calls it; ``better`` is more, less, or near 1."""

    title: str
    unit: str
    better: str
    meaning: str


MEASURES = {
    "S": Measure("S", "", "more", "similarity of the histograms of phrase durations (cosine, eqs. 7.1 and 7.3)"),
    "D": Measure(
        "D", "s", "less", "mean distance of synthesised boundaries to the nearest actual one (eqs. 7.2 and 7.4)"
    ),
    "boundary_f1": Measure(
        "boundary F1", "", "more", "synthesised and actual boundaries matched one to one within the tolerance"
    ),
    "phrase_ratio": Measure(
        "phrase ratio", "", "near 1", "number of synthesised phrases divided by that of actual ones"
    ),
    "frames_right": Measure("frames correct", "", "more", "share of frames with the correct gesture"),
    "kappa": Measure("kappa", "", "more", "agreement of the frames beyond chance (Cohen)"),
    "hand_speed_r": Measure(
        "hand speed r", "", "more", "correlation of the hands' speed with that of the recorded hands"
    ),
    "beat_alignment": Measure(
        "beat alignment",
        "",
        "more",
        "nearness of syllables to beats of the hands, beyond that of the same beats at other times",
    ),
    "frechet_distance": Measure(
        "Fréchet distance", "", "less", "between the features of hand motion in windows of the two motions"
    ),
}

HEAD_MEASURES = {
    "normalised": Measure(
        "normalised distance",
        "",
        "less",
        "squared distance divided by the squared sum of the angles, mean (eq. 4.20)",
    ),
    "normalised_sums": Measure("normalised, sums", "", "less", "the sums of these divided by each other"),
    "mahalanobis": Measure(
        "Mahalanobis distance", "", "less", "distance in units of the spread of the head (eq. 4.21)"
    ),
    "euclidean": Measure("Euclidean distance", "°", "less", "mean distance of the angles in degrees"),
    "speed_correlation": Measure(
        "correlation of speeds", "", "more", "that of the angular speeds of the made and of the recorded head"
    ),
}

SCENARIOS = {
    "memory": "telling a memory",
    "documentary": "retelling a documentary",
    "fairy_tale": "retelling a fairy tale",
    "agent": "conversation with an agent",
    "watch_and_tell": "watch and tell",
}

MONOLOGUES = ("memory", "documentary", "fairy_tale")
"""The scenarios with a single speaker (Özkul 2012, 3.2)."""

ROLES = {
    "system": "driven by the record's own speech",
    "wrong speech": "the same system driven by the wrong speech",
    "control": "controls without speech",
    "ceiling": "ceilings, which know what no system may know",
}


def gesture(label: str) -> str:
    """Return the name of a gesture class for a reader."""
    return GESTURES[label].title if label in GESTURES else label.replace("_", " ")


def scenario(name: str) -> str:
    """Return the name of a scenario for a reader."""
    return SCENARIOS.get(name, name.replace("_", " "))


def seconds(value: float) -> str:
    """Return a bin width or duration in s, or in ms below a tenth of a second."""
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


def head_measure(name: str) -> str:
    """Return the heading of a measure of heads, with its unit."""
    known = HEAD_MEASURES[name]
    return f"{known.title} ({known.unit})" if known.unit else known.title


def number(value: float, signed: bool = False) -> str:
    """Return a score with two decimals, or three if two would show 0; a dash where it is undefined."""
    if value != value:
        return "–"
    digits = 3 if value != 0 and round(value, 2) == 0 else 2
    text = f"{value + 0.0:{'+' if signed else ''}.{digits}f}"
    return text.replace("-", "−")


def joined(parts: list[str], last: str = "and") -> str:
    """Return an enumeration: ``a``, ``a and b``, or ``a, b and c``."""
    return f" {last} ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
