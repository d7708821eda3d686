"""Figures as elements of the page."""

from __future__ import annotations

import re

THEMED = {"#22262b": "var(--ink)", "#7b828c": "var(--faint)", "#dfe3e8": "var(--grid)", "#fffffe": "var(--paper)"}
"""Colours of the figures that follow the page from light to dark."""


def inline(text: str, name: str, label: str) -> str:
    """Return an SVG file as an element of the page, with the theme's colours and ids of its own.

    Parameters
    ----------
    text : content of the file.
    name : of the exhibit; prefix of the ids.
    label : what a screen reader says.
    """
    body = text[text.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'href="#', f'href="#{name}-', body)
    body = body.replace("url(#", f"url(#{name}-")
    for colour, variable in THEMED.items():
        body = body.replace(colour, variable)
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    return f'{head} role="img" aria-label="{label}">{rest}'
