"""Read motion files of every supported format as motion tables; the file name suffix selects the format."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.corpus import retarget, user_tables
from cospeech.errors import UserError
from cospeech.formats import bvh, smplx
from cospeech.geometry import rotation
from cospeech.motion import skeleton

SOURCES = {".bvh": "bvh", ".npz": "smplx", ".parquet": "table", ".csv": "table"}
"""Value of ``motion_source`` by file name suffix."""

SMALLEST_DEG, N_MOVING = 0.5, 4
"""Rotation beyond which a joint moves, and the number of joints that move when a person speaks."""


class Motion(NamedTuple):
    """A motion table, the kind of file it was read from, and notes on how it was converted."""

    table: pd.DataFrame
    source: str
    notes: list[str]

    @property
    def fps(self) -> float:
        """Frame rate in frames per second."""
        return skeleton.frame_rate(self.table)

    @property
    def duration_s(self) -> float:
        """Duration in seconds."""
        return len(self.table) / self.fps


def read(
    path: str | Path, conventions: retarget.MotionConventions, start_s: float = 0.0, end_s: float | None = None
) -> Motion:
    """Read a motion file, or the frames whose centres lie between ``start_s`` and ``end_s``.

    Raises
    ------
    UserError
        If the format is not supported, or if the file is damaged, contains NaN, has unknown joints or ends before the
        excerpt does.
    """
    source = SOURCES.get(Path(path).suffix.lower())
    if source is None:
        raise UserError(f"{path}: unknown motion format; convert it to one of {', '.join(SOURCES)}")
    if source == "table":
        table, notes = user_tables.motion(path)
        rate = skeleton.frame_rate(table)
        first, last = _excerpt_frames(path, len(table), rate, start_s, end_s)
        root = table[list(skeleton.ROOT_COLUMNS)].to_numpy()[first:last]
        return Motion(skeleton.motion_table(root, skeleton.angles(table)[first:last], rate), source, notes)
    if source == "smplx" and conventions.zero != "t_pose":
        raise UserError(f"{path}: SMPL-X is in a T-pose at zero angles; set corpus.motion.zero to t_pose")
    clip = bvh.read(path) if source == "bvh" else smplx.read(path)
    if source == "bvh":
        _check_degrees(clip, path)
    first, last = _excerpt_frames(path, len(clip.rotations), clip.fps, start_s, end_s)
    places = {joint: place[first:last] for joint, place in clip.places.items()}
    part = dataclasses.replace(clip, rotations=clip.rotations[first:last], places=places)
    table, notes = retarget.motion_table(part, conventions, str(path))
    return Motion(table, source, [*clip.notes, *notes])


def _check_degrees(clip: bvh.Clip, path: str | Path) -> None:
    """Raise UserError if a body moves as little as one whose angles are in radians, which BVH has in degrees."""
    largest_deg = rotation.angles_deg(clip.rotations).max(axis=0)
    if (largest_deg > SMALLEST_DEG).sum() >= N_MOVING and largest_deg.max() < np.pi:
        raise UserError(
            f"{path}: no joint turns by more than {largest_deg.max():.2g} degrees, so the angles seem to be in "
            "radians; export it in degrees"
        )


def _excerpt_frames(
    path: str | Path, n_frames: int, fps: float, start_s: float, end_s: float | None
) -> tuple[int, int]:
    first = int(np.ceil(start_s * fps - 0.5 - 1e-6))
    last = n_frames if end_s is None else int(np.ceil(end_s * fps - 0.5 - 1e-6))
    if last > n_frames or first >= last:
        raise UserError(
            f"{path}: lasts {n_frames / fps:.3f} s and does not contain the excerpt from {start_s} s to "
            f"{end_s or 'its end'}; correct start_s and end_s"
        )
    return first, last
