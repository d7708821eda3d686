"""Markers that another system measured, C3D or TRC, become a ``markers_3d`` table under our names and axes.

What it did not see is filled as after our own tracker, see ``sights.filled``.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.capture.tracking import detections
from cospeech.data import trajectories
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import c3d, trc
from cospeech.motion.markers import NAMES

READERS: dict[str, Callable[[str | Path], trajectories.Trajectories]] = {".c3d": c3d.read, ".trc": trc.read}
"""How a file is read, by its suffix."""

DIRECTIONS = {f"{sign}{axis}": number * np.eye(3)["xyz".index(axis)] for sign, number in (("", 1.0), ("-", -1.0))
              for axis in "xyz"}  # fmt: skip
"""The file's axes by name."""


def read(path: str | Path, names: Mapping[str, str], up: str, facing: str, longest_hidden_s: float) -> pd.DataFrame:
    """Return the ``markers_3d`` table of a C3D or TRC file: all of ``markers.NAMES``, lost where ``names`` has none.

    Parameters
    ----------
    names : the marker map: our name (``cospeech.markers``) of each marker, and the file's.
    up, facing : which of the file's axes points up, and which to where the actor faces: x, y, z, -x, -y or -z.
    longest_hidden_s : a longer gap stays lost, unless a rigid part carries its marker.

    Raises
    ------
    UserError : a file of no known making, or damaged; a mapped marker that the file lacks or never sees; axes that
        are no frame.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise UserError(f"{path}: markers come as {', '.join(READERS)}; convert it to one of them")
    held = reader(path)
    turn = axes(up, facing)
    places = np.full((len(held.places_m), len(NAMES), 3), np.nan)
    for ours, theirs in names.items():
        if theirs not in held.names:
            near = difflib.get_close_matches(theirs, held.names, n=1, cutoff=0.0)
            raise UserError(f"{path}: has no marker '{theirs}' (mapped to {ours}); did you mean '{near[0]}'?")
        place = held.places_m[:, held.names.index(theirs)]
        if np.isnan(place).all():
            raise UserError(
                f"{path}: marker '{theirs}' (mapped to {ours}) is never seen; map another one, or leave it out of "
                "corpus.markers.names"
            )
        places[:, NAMES.index(ours)] = place @ turn.T
    sd_m = np.full(places.shape[:2], detections.SIGHT_SD_M)
    filled, status = detections.filled(places, sd_m, held.fps, longest_hidden_s)
    return trajectories.to_table(filled, NAMES, held.fps).assign(status=detections.named(detections.STATUSES, status))


def axes(up: str, facing: str) -> Floats:
    """Return the rotation (3, 3) from a file's axes to ours: x to the actor's left, y up, z to where he faces.

    Raises
    ------
    UserError : where a name is no axis, or both lie along one.
    """
    for name in (up, facing):
        if name not in DIRECTIONS:
            raise UserError(f"markers: '{name}' is no axis; up and facing are one of {', '.join(DIRECTIONS)}")
    left = np.cross(DIRECTIONS[up], DIRECTIONS[facing])
    if not left.any():
        raise UserError(f"markers: up is '{up}' and facing '{facing}'; they must lie along different axes")
    return np.stack([left, DIRECTIONS[up], DIRECTIONS[facing]])
