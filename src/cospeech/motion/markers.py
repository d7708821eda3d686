"""The 15 markers of Özkul 2012, Table 2.1: names, colours, and the body part that each is fixed to.

Red discs are on the most active parts, green and white ones on the others (2.4). What is known of them before any
film is seen stands here; where exactly they sit on an actor is found by the capture room, and planted by the studio.
"""

from __future__ import annotations

from typing import NamedTuple


class Marker(NamedTuple):
    """One marker: its name in tables, its colour, and the joint whose body part carries it."""

    name: str
    colour: str
    joint: str


RADIUS_M = 0.02

COLOURS = {"red": (200, 30, 40), "green": (40, 175, 70), "white": (235, 235, 230)}
"""Red, green and blue of each colour in full light."""

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
