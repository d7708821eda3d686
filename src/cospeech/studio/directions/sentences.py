"""What the speaker says: answers of a few sentences, some of which give directions.

Several other words sound like the keywords: lights, bright, night, street, lift and late.
"""

from __future__ import annotations

import re

import numpy as np

KEYWORDS = ("left", "right", "straight")

SENTENCES_PER_ANSWER = (3, 5)
"""Range of the number of sentences of an answer."""

DIRECTIONS_SHARE = 0.45
"""Share of sentences that contain a keyword."""

DIRECTIONS = (
    "Take a {side} at the {place}.",
    "Turn {side} at the second {crossing}.",
    "Go straight past the {place}.",
    "Keep going straight until you see the {place}.",
    "The {place} is on your {side}.",
    "Take a {side} and go straight down that street.",
    "You will find it on the {side} hand side, next to the {place}.",
    "Walk straight across the {crossing} and turn {side}.",
)
OTHERS = (
    "You will pass a small {place} and a big red house.",
    "It takes about ten minutes if you walk.",
    "There is a bright yellow sign above the door.",
    "Wait at the lights, and then cross the street.",
    "The {place} is not open late at night.",
    "Go down to the {crossing} and look for the {place}.",
    "Take the lift to the second floor.",
    "No, you do not need to take the bus.",
    "I usually stop at the {place} on my way home.",
    "The building has a green roof, and a clock above the gate.",
    "Ask somebody at the {place} if you cannot find it.",
    "After the {crossing} the road goes up a little.",
)
PLACES = ("bank", "library", "station", "museum", "garden", "bakery", "church", "theatre", "market", "bridge")
CROSSINGS = ("corner", "traffic lights", "roundabout", "crossing", "fountain")
WEAK = frozenset((
    "a", "about", "above", "across", "after", "and", "at", "cannot", "do", "down", "for", "go", "going",
    "has", "i", "if", "in", "is", "it", "keep", "my", "need", "next", "no", "not", "of", "off", "on", "open",
    "past", "somebody", "that", "the", "then", "there", "to", "until", "up", "will", "you", "your",
))  # fmt: skip
"""Words that carry no pitch accent."""


def answer(rng: np.random.Generator) -> list[str]:
    """Return the sentences of an answer."""
    number = int(rng.integers(SENTENCES_PER_ANSWER[0], SENTENCES_PER_ANSWER[1] + 1))
    return [_sentence(rng) for _ in range(number)]


def _sentence(rng: np.random.Generator) -> str:
    forms = DIRECTIONS if rng.random() < DIRECTIONS_SHARE else OTHERS
    return forms[rng.integers(len(forms))].format(
        side=("left", "right")[rng.integers(2)],
        place=PLACES[rng.integers(len(PLACES))],
        crossing=CROSSINGS[rng.integers(len(CROSSINGS))],
    )


def plain(word: str) -> str:
    """Return a word in lower case, without punctuation."""
    return re.sub(r"[^a-z']", "", word.lower())
