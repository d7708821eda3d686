"""Import of markers measured by another system (C3D, TRC) as a ``markers_3d`` table with our names and axes.

Gaps are filled as for our own tracker, see ``detections.fill_gaps``.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.capture.fitting import stance
from cospeech.capture.fitting.body_model import OPTIONAL
from cospeech.capture.fitting.static_pose import static_pose
from cospeech.capture.tracking import detections
from cospeech.data import trajectories
from cospeech.errors import UserError
from cospeech.formats import c3d, foreign, trc
from cospeech.geometry import axes
from cospeech.motion.markers import NAMES

Reader = Callable[[str | Path, str | float | None], trajectories.Trajectories]
READERS: dict[str, Reader] = {".c3d": c3d.read, ".trc": trc.read}
"""Reader of each file format, by suffix."""

DECLARED = "corpus.markers"
"""The section of the configuration that declares the axes."""


def read(
    path: str | Path,
    names: Mapping[str, str],
    up: str,
    facing: str,
    longest_hidden_s: float,
    static: tuple[str, float] | None = None,
    unit: str | float | None = None,
    report: Callable[[str], None] | None = None,
) -> pd.DataFrame:
    """Return the ``markers_3d`` table of a C3D or TRC file, with all of ``markers.NAMES``.

    Markers that ``names`` does not map are lost.

    Parameters
    ----------
    names : marker map from our names (``markers.NAMES``) to those of the file.
    up, facing : the axis of the file that points up, and the one in which the actor faces: x, y, z, -x, -y or -z.
    longest_hidden_s : longest gap to fill, unless a rigid body part determines the position.
    static : pose (see ``stance``) and duration in seconds of the static pose, for a range-of-motion take. Only such a
        take is checked here against unit, axes, names and pose; for a record, see ``check``.
    unit : unit of the positions, as in ``units.METRES`` or in metres; None: as the file says.
    report : receives the notes on how the file was interpreted.

    Raises
    ------
    UserError : if the format is unknown or the file is damaged, if a mapped marker is missing, ambiguous or never
        visible, if the axes do not define a frame, or if a range-of-motion take contradicts the unit, axes, names or
        static pose.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise UserError(f"{path}: unknown marker file format; convert it to one of {', '.join(READERS)}")
    held = reader(path, unit)
    if report:
        for note in held.notes:
            report(f"{path}: {note}")
    turn = axes.world_rotation(up, facing, DECLARED)
    for ours, theirs in names.items():
        first = next(other for other, marker in names.items() if marker == theirs)
        if first != ours:
            raise UserError(
                f"corpus.markers.names: '{theirs}' is mapped to both {first} and {ours}; correct one of them"
            )
    places = np.full((len(held.places_m), len(NAMES), 3), np.nan)
    for ours, theirs in ((ours, foreign.normalised(theirs)) for ours, theirs in names.items()):
        if held.names.count(theirs) > 1:
            raise UserError(
                f"{path}: {held.names.count(theirs)} markers are called '{theirs}' (mapped to {ours}); give each its "
                "own name"
            )
        if theirs not in held.names:
            near = difflib.get_close_matches(theirs, held.names, n=1, cutoff=0.0)
            raise UserError(f"{path}: no marker '{theirs}' (mapped to {ours}); did you mean '{near[0]}'?")
        place = held.places_m[:, held.names.index(theirs)]
        if np.isnan(place).all():
            raise UserError(
                f"{path}: marker '{theirs}' (mapped to {ours}) is never visible; map a different one, or remove it "
                "from corpus.markers.names"
            )
        places[:, NAMES.index(ours)] = place @ turn.T
    if static is not None:
        stance.check_unit(places, str(path))
        stance.check_axes(places, turn, str(path))
        pose, seconds = static
        still = static_pose(places, NAMES, held.fps, seconds, OPTIONAL)
        stance.check_static(still, pose, turn, str(path))
    sd_m = np.full(places.shape[:2], detections.DETECTION_SD_M)
    filled, status = detections.fill_gaps(places, sd_m, held.fps, longest_hidden_s)
    return trajectories.to_table(filled, NAMES, held.fps).assign(
        status=detections.label_column(detections.STATUSES, status)
    )


def check(table: pd.DataFrame, up: str, facing: str, where: str) -> None:
    """Raise UserError if the markers of a record contradict the declared unit, axes or names.

    A file is read whatever its markers show; this is checked before a body model is fitted to them.

    Parameters
    ----------
    table : ``markers_3d`` table of the record.
    up, facing : as in ``read``.
    where : name of the file for error messages.
    """
    places = trajectories.to_array(table, NAMES)
    stance.check_unit(places, where)
    stance.check_axes(places, axes.world_rotation(up, facing, DECLARED), where)
