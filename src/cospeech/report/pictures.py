"""Exhibits that are pictures already: they are framed, and named, as the others are."""

from __future__ import annotations

import matplotlib.image
import numpy as np
from matplotlib.figure import Figure

from cospeech.report import style


def figure(path: str) -> Figure:
    """Return a figure that holds the picture at ``path`` (PNG), as wide as the page."""
    picture = np.asarray(matplotlib.image.imread(path))
    height, width = picture.shape[:2]
    drawn, axes = style.figure(style.WIDTH_IN * height / width)
    drawn.set_layout_engine("none")
    panel = axes[0, 0]
    panel.set_position((0, 0, 1, 1))
    panel.imshow(picture, aspect="auto", interpolation="none")
    panel.set_axis_off()
    return drawn
