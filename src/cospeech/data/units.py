"""Units of length of motion and marker files, in metres."""

from __future__ import annotations

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254}

SPELLINGS = {
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    "inches": "in",
}
"""Other names of units in files."""


def stated_metres(unit: str) -> float | None:
    """Return the length in metres of a unit as it is written in a file, None if it is unknown."""
    name = unit.strip().lower()
    return METRES.get(SPELLINGS.get(name, name))


def metres_per_unit(unit: str | float) -> float:
    """Return the length in metres of a unit: a name in ``METRES``, or the number of metres itself."""
    return METRES[unit] if isinstance(unit, str) else float(unit)


def label(unit: str | float) -> str:
    """Return a unit as it is named in messages."""
    return unit if isinstance(unit, str) else f"{unit:g} m"


def replaced(stated: str, declared: str | float) -> list[str]:
    """Return a note if a declared unit contradicts the one that a file states."""
    if stated_metres(stated) == metres_per_unit(declared):
        return []
    return [f"unit '{stated[:20]}' of the file replaced by the declared {label(declared)}"]
