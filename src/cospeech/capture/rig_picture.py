"""A picture of a calibrated rig: its cameras and the points behind them, from above and from the side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cospeech.capture.camera import Camera

Floats = npt.NDArray[np.float64]

INK, BLUE, FAINT = "#22262b", "#2278b5", "#7b828c"
SIDES = (
    ("From above", 0, 2, "x, to the actor's left (m)", "z, ahead (m)"),
    ("From the side", 2, 1, "z, ahead (m)", "y, up (m)"),
)
RAY_M = 0.6
NEAR = 0.08
"""Distance below which a camera hides another, relative to the width of the rig."""


def draw(cameras: Sequence[Camera], points_m: Floats) -> Figure:
    """Return the picture of cameras and points (N, 3), NaN where there is none."""
    figure = Figure(figsize=(9.2, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    for panel, (title, across, up, label_across, label_up) in zip(figure.subplots(1, 2), SIDES, strict=True):
        panel.plot(points_m[:, across], points_m[:, up], ".", color=FAINT, markersize=2, zorder=1)
        flat = np.array([camera.place_m[[across, up]] for camera in cameras])
        near = NEAR * np.ptp(flat, axis=0).max()
        for number, camera in enumerate(cameras):
            place = camera.place_m
            hidden = (np.linalg.norm(flat[:number] - flat[number], axis=1) < near).any()
            ray = np.array([place, place + RAY_M * camera.rotation[2]])
            panel.plot(ray[:, across], ray[:, up], color=BLUE, linewidth=1.5)
            panel.plot(place[across], place[up], "s", color=BLUE, markersize=6)
            beside = (6, -14) if hidden else (6, 6)  # one behind another: their names must not lie on each other
            panel.annotate(
                camera.name, (place[across], place[up]), xytext=beside, textcoords="offset points", color=INK
            )
        panel.set(title=title, xlabel=label_across, ylabel=label_up)
        panel.set_aspect("equal")
        panel.spines[["top", "right"]].set_visible(False)
    return figure


def save(figure: Figure, path: str | Path) -> None:
    """Write the picture as PNG; the same picture gives the same bytes."""
    figure.savefig(path, dpi=130, metadata={"Software": None})
