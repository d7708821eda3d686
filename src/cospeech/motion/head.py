"""The head of a moving body: its angles relative to the trunk, and a body whose head follows given angles.

The angles are those of Sargin 2006, eq. 4.3: R = Rx(x) Ry(y) Rz(z). A positive x nods down, a positive y turns the
head to the person's left, and a positive z tilts it towards the person's right shoulder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats
from cospeech.geometry import rotation
from cospeech.motion import skeleton

EULER_ORDER = "XYZ"
"""Intrinsic order of the angles of the head."""

COLUMNS = ["x_deg", "y_deg", "z_deg"]

JOINTS = ("neck", "head")
"""The joints that turn the head relative to the chest."""


def table(angles_deg: Floats, fps: float) -> pd.DataFrame:
    """Return angles of the head (T, 3) in degrees, x, y and z, as a table (schema ``head``)."""
    n_frames = len(angles_deg)
    values = pd.DataFrame(np.asarray(angles_deg, dtype=float), columns=COLUMNS)
    values.insert(0, "frame", np.arange(n_frames))
    values.insert(1, "time_s", segments.frame_times(n_frames, fps))
    return values


def frame_rate(head: pd.DataFrame) -> float:
    """Return the frame rate of a table of head angles in frames per second, from the time of its first frame."""
    return skeleton.frame_rate(head)


def angles(motion: pd.DataFrame) -> Floats:
    """Return the angles of the head of a motion table relative to its chest, (T, 3) in degrees."""
    neck, head = np.moveaxis(skeleton.rotations(skeleton.angles(motion, JOINTS)), 1, 0)
    return rotation.to_euler(EULER_ORDER, neck @ head)


def of_body(motion: pd.DataFrame) -> pd.DataFrame:
    """Return the angles of the head of a motion table as a table (schema ``head``) at its frame rate."""
    return table(angles(motion), skeleton.frame_rate(motion))


def moved(motion: pd.DataFrame, head: pd.DataFrame) -> pd.DataFrame:
    """Return a motion table whose head has other angles. Neck and head take one half of each rotation.

    Parameters
    ----------
    motion : the motion of the body.
    head : angles of the head (schema ``head``) at any frame rate; see ``at_times``.
    """
    halves = rotation.to_vectors(rotation.from_euler(EULER_ORDER, at_times(head, motion["time_s"].to_numpy()))) / 2
    turned = skeleton.euler(rotation.from_vectors(halves))
    columns = {f"{joint}_{axis}_deg": turned[:, place] for joint in JOINTS for place, axis in enumerate("xyz")}
    return motion.assign(**columns)


def moved_where(
    motions: Sequence[pd.DataFrame], headless: Sequence[bool], head: pd.DataFrame | None
) -> list[pd.DataFrame]:
    """Return motion tables of which those that are ``headless`` and not empty have another head; see ``moved``.

    Parameters
    ----------
    head : angles of the head; None: all keep their own.
    """
    return [
        moved(motion, head) if lacks and head is not None and len(motion) else motion
        for motion, lacks in zip(motions, headless, strict=True)
    ]


def at_times(head: pd.DataFrame, times_s: Floats) -> Floats:
    """Return the angles (n, 3) in degrees at times (n,), interpolated between the frames that have angles.

    Before the first and after the last of them, the angles are those of that frame.
    """
    known = head.dropna(subset=COLUMNS)
    return np.column_stack([np.interp(times_s, known["time_s"], known[name]) for name in COLUMNS])
