"""Motion of any of the known makings becomes a motion table; the file's suffix says which making."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.corpus import retarget, user_tables
from cospeech.errors import UserError
from cospeech.formats import bvh, smplx
from cospeech.motion import skeleton

SOURCES = {".bvh": "bvh", ".npz": "smplx", ".parquet": "table", ".csv": "table"}
"""What a file is, by its suffix, in the words of ``motion_source``."""


class Motion(NamedTuple):
    """A motion table, what it came from, and notes on what was done to it."""

    table: pd.DataFrame
    source: str
    notes: list[str]

    @property
    def fps(self) -> float:
        """Frames a second."""
        return skeleton.frame_rate(self.table)

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return len(self.table) / self.fps


def read(
    path: str | Path, declared: retarget.Declaration, start_s: float = 0.0, end_s: float | None = None
) -> Motion:
    """Read a motion file, or its excerpt from ``start_s`` to ``end_s``: the frames whose centres lie in it.

    Raises
    ------
    UserError : a file of no known making, or damaged; NaN; unknown joints; an excerpt beyond the end.
    """
    source = SOURCES.get(Path(path).suffix.lower())
    if source is None:
        raise UserError(f"{path}: motion comes as {', '.join(SOURCES)}; convert it to one of them")
    if source == "table":
        table, notes = user_tables.motion(path)
        rate = skeleton.frame_rate(table)
        first, last = _excerpt(path, len(table), rate, start_s, end_s)
        root = table[list(skeleton.ROOT_COLUMNS)].to_numpy()[first:last]
        return Motion(skeleton.motion_table(root, skeleton.angles(table)[first:last], rate), source, notes)
    if source == "smplx" and declared.zero != "t_pose":
        raise UserError(f"{path}: SMPL-X stands in a T-pose at zero angles; set corpus.motion.zero to t_pose")
    clip = bvh.read(path) if source == "bvh" else smplx.read(path)
    first, last = _excerpt(path, len(clip.rotations), clip.fps, start_s, end_s)
    places = {joint: place[first:last] for joint, place in clip.places.items()}
    part = bvh.Clip(clip.names, clip.parents, clip.rotations[first:last], places, clip.fps, clip.offsets, clip.tips)
    table, notes = retarget.motion_table(part, declared, str(path))
    return Motion(table, source, notes)


def _excerpt(path: str | Path, n_frames: int, fps: float, start_s: float, end_s: float | None) -> tuple[int, int]:
    first = int(np.ceil(start_s * fps - 0.5 - 1e-6))
    last = n_frames if end_s is None else int(np.ceil(end_s * fps - 0.5 - 1e-6))
    if last > n_frames or first >= last:
        raise UserError(
            f"{path}: lasts {n_frames / fps:.3f} s, so no excerpt from {start_s} s to {end_s or 'its end'} is in it; "
            "correct start_s and end_s"
        )
    return first, last
