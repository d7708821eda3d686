"""The 15 markers of Özkul 2012, Table 2.1: names, colours, and the body parts that they are attached to.

The most active parts have red discs, the others green and white ones (2.4). The exact positions on an actor are
estimated during capture, and chosen by the virtual studio.
"""

from __future__ import annotations

from typing import NamedTuple


class Marker(NamedTuple):
    """One marker: its name in tables, its colour, and the joint whose body part it is attached to."""

    name: str
    colour: str
    joint: str


RADIUS_M = 0.02

COLOURS = {"red": (200, 30, 40), "green": (40, 175, 70), "white": (235, 235, 230)}
"""Red, green and blue of each colour under full illumination."""

MARKERS = (
    Marker("head_left", "green", "head"),
    Marker("head_right", "green", "head"),
    Marker("head_front", "white", "head"),
    Marker("chest", "white", "chest"),
    Marker("back", "white", "chest"),
    Marker("left_shoulder", "green", "chest"),
    Marker("right_shoulder", "green", "chest"),
    Marker("left_elbow", "green", "left_arm"),
    Marker("right_elbow", "green", "right_arm"),
    Marker("left_hand", "red", "left_hand"),
    Marker("right_hand", "red", "right_hand"),
    Marker("left_leg", "white", "left_thigh"),
    Marker("right_leg", "white", "right_thigh"),
    Marker("left_foot", "green", "left_foot"),
    Marker("right_foot", "green", "right_foot"),
)

NAMES = tuple(marker.name for marker in MARKERS)
