"""Plot of a calibrated rig: its cameras and the points they were calibrated from, in top and side view."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cospeech.data.arrays import Floats
from cospeech.geometry.camera import Camera

INK, BLUE, FAINT = "#22262b", "#2278b5", "#7b828c"
SIDES = (
    ("From above", 0, 2, "x, to the actor's left (m)", "z, ahead (m)"),
    ("From the side", 2, 1, "z, ahead (m)", "y, up (m)"),
)
RAY_M = 0.6
SAME_M = 0.2
"""Cameras that appear closer to each other than this share a label."""


def draw(cameras: Sequence[Camera], points_m: Floats) -> Figure:
    """Return a figure of the cameras and points (N, 3); NaN points are skipped."""
    figure = Figure(figsize=(9.2, 3.6), layout="compressed")
    FigureCanvasAgg(figure)
    for panel, (title, across, up, label_across, label_up) in zip(figure.subplots(1, 2), SIDES, strict=True):
        panel.plot(points_m[:, across], points_m[:, up], ".", color=FAINT, markersize=2, zorder=1)
        for camera in cameras:
            place = camera.place_m
            ray = np.array([place, place + RAY_M * camera.rotation[2]])
            panel.plot(ray[:, across], ray[:, up], color=BLUE, linewidth=1.5)
            panel.plot(place[across], place[up], "s", color=BLUE, markersize=6)
            near = [other.name for other in cameras if np.abs(other.place_m - place)[[across, up]].max() < SAME_M]
            if camera.name == near[0]:
                panel.annotate(
                    ", ".join(near), (place[across], place[up]), xytext=(6, 6), textcoords="offset points", color=INK,
                    bbox={"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1},
                )  # fmt: skip
        panel.margins(0.08, 0.12)
        panel.set(title=title, xlabel=label_across, ylabel=label_up)
        panel.set_aspect("equal")
        panel.spines[["top", "right"]].set_visible(False)
    return figure


def save(figure: Figure, path: str | Path) -> None:
    """Write the figure as PNG; the same figure gives the same bytes."""
    figure.savefig(path, dpi=130, metadata={"Software": None})
