"""From selected units to motion: templates are stretched to their phrases, joined, smoothed, and put on the body.

Stretching and bridging interpolate rotations along the shortest arc (spherical linear interpolation), which is not
affected by the jump from 180 to -180 degrees and the gimbal lock of Euler angles. The joined motion is converted to
continuous Euler angles, to which the filters of figure 6.3 are applied.

Instead of a filter, the velocity-preserving blending of Levine 2009 can be chosen (``VELOCITY_PRESERVING``). It is
not the default. It was made for segments that begin and end slowly, and many gesture phrases do not. On the eight
records of the demo, with the system hsmm_weighted, the accelerations at 57 % of the joins stay within those of the
recorded motion (``joins_within`` in the table ``motion_quality``), compared with 98 % for the exponential filter and
34 % for no filter. And since a unit may end before the arms have reached its poses, the gesture class that is
recognised in the motion is the planned one in 86 % of the frames, compared with 92 %.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry import rotation
from cospeech.motion import euler, library, skeleton, smoothing
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses
from cospeech.motion.unit_selection import Templates

VELOCITY_PRESERVING = "velocity_preserving"
"""The name that selects blending in place of a filter (see ``blending``)."""

SYNTHESISED = (*skeleton.ARM_JOINTS, "left_hand", "right_hand")
"""The joints that are synthesised; all others keep the motion of the record (chapter 6, end)."""


def interpolate(rotations: Floats, positions: Floats) -> Floats:
    """Return rotation matrices (m, J, 3, 3) interpolated between those of n frames, along the shortest arc.

    Parameters
    ----------
    rotations : (n, J, 3, 3).
    positions : (m,) fractional frame numbers from 0 to n - 1.
    """
    before = np.clip(np.floor(positions).astype(int), 0, len(rotations) - 1)
    after = np.minimum(before + 1, len(rotations) - 1)
    start = rotations[before].reshape(-1, 3, 3)
    turn = rotation.to_vectors(np.swapaxes(start, -1, -2) @ rotations[after].reshape(-1, 3, 3))
    share = np.repeat(positions - before, rotations.shape[1])
    part = rotation.from_vectors(share[:, None] * turn)
    return (start @ part).reshape(len(positions), *rotations.shape[1:])


def stretch(rotations: Floats, n_frames: int) -> Floats:
    """Return a template (n, J, 3, 3) resampled to ``n_frames`` frames, from its first pose to its last.

    A single frame is the middle of the template.
    """
    middle = (len(rotations) - 1) / 2
    positions = np.linspace(0, len(rotations) - 1, n_frames) if n_frames > 1 else np.array([middle])
    return interpolate(rotations, positions)


def join(units: pd.DataFrame, pool: Templates, motions: Mapping[str, pd.DataFrame], n_frames: int) -> Floats:
    """Return the continuous Euler angles (T, J, 3) in degrees of the synthesised joints, before smoothing.

    Phrases without a template are interpolated between the last pose before and the first pose after them. At the
    ends of the record, the nearest pose is held.
    """
    return euler.follow(skeleton.euler(_played(units, pool, motions, n_frames)[0]))


def _played(
    units: pd.DataFrame, pool: Templates, motions: Mapping[str, pd.DataFrame], n_frames: int
) -> tuple[Floats, Floats]:
    """Return the rotations (T, J, 3, 3) of the synthesised joints, and those one frame earlier in the recordings.

    What precedes a template in its recording is not shown, but says how fast the template begins.
    """
    recorded = {
        record: skeleton.rotations(skeleton.angles(motion, SYNTHESISED)) for record, motion in motions.items()
    }
    spans = pool.table.set_index(["record", "segment"])[["first_frame", "end_frame"]]
    shown = units[units["template_record"].notna()]
    joined = np.zeros((n_frames, len(SYNTHESISED), 3, 3))
    earlier = np.zeros_like(joined)
    filled = np.zeros(n_frames, dtype=bool)
    for record, segment, start, stop in zip(
        shown["template_record"], shown["template_segment"], shown["start_frame"], shown["end_frame"], strict=True
    ):
        first, end = spans.loc[(record, segment)]
        joined[start:stop] = stretch(recorded[record][first:end], stop - start)
        earlier[start + 1 : stop] = joined[start : stop - 1]
        pace = (end - 1 - first) / (stop - start - 1) if stop - start > 1 else 1.0
        earlier[start] = interpolate(recorded[record], np.array([max(first - pace, 0.0)]))[0]
        filled[start:stop] = True
    joined = _bridge(joined, filled)
    bridged = np.flatnonzero(~filled)
    earlier[bridged] = joined[np.maximum(bridged - 1, 0)]
    return joined, earlier


def _bridge(rotations: Floats, filled: npt.NDArray[np.bool_]) -> Floats:
    known = np.flatnonzero(filled)
    positions = np.interp(np.arange(len(filled)), known, np.arange(len(known)))
    return interpolate(rotations[known], positions)


def boundaries(units: pd.DataFrame) -> npt.NDArray[np.int64]:
    """Return the first frames of all phrases except the first, where one unit meets the next."""
    starts = units.loc[units["start_frame"] < units["end_frame"], "start_frame"].to_numpy(dtype=np.int64)
    return np.unique(starts[starts > 0])


def motion(
    units: pd.DataFrame,
    pool: Templates,
    motions: Mapping[str, pd.DataFrame],
    own: pd.DataFrame,
    filter: str,
    window: int,
) -> pd.DataFrame:
    """Return the motion table of a synthesised record: arms and hands from units, all other joints as recorded.

    Parameters
    ----------
    units : table of schema ``units``.
    pool : the templates that the units refer to.
    motions : motion tables of the training records.
    own : motion table of the record itself, for hips, spine, head and legs.
    filter, window : smoothing around phrase boundaries, see ``smoothing.smooth``, or ``VELOCITY_PRESERVING``, which
        needs no window.
    """
    if filter == VELOCITY_PRESERVING:
        joined = blended(units, pool, motions, own)
    else:
        angles = join(units, pool, motions, len(own))
        joined = smoothing.around_boundaries(angles, boundaries(units), filter, window)
    made = own.copy()
    made[skeleton.angle_columns(SYNTHESISED)] = joined.reshape(len(own), -1)
    return made


def blended(units: pd.DataFrame, pool: Templates, motions: Mapping[str, pd.DataFrame], own: pd.DataFrame) -> Floats:
    """Return the continuous Euler angles (T, J, 3) in degrees of the synthesised joints, with units blended.

    Each unit begins in the pose that the last one ended in, and the joints turn toward its poses as fast as it moves
    itself (see ``blending``). The parameters are those of ``motion``.
    """
    from cospeech.motion.blending import Blender  # compiled, and needed only here

    body = library.from_motion(own)
    joints = [skeleton.JOINTS.index(name) for name in SYNTHESISED]
    before = np.maximum(np.arange(-1, len(own) - 1), 0)
    whole = []
    for kept, rotations in zip((body, body.at(before)), _played(units, pool, motions, len(own)), strict=True):
        turned = kept.rotations.copy()
        turned[:, joints] = rotation.to_quaternions(rotations)
        whole.append(Poses(kept.root_m, turned))
    shown = Blender(STANDARD).steps(*whole)
    return euler.follow(skeleton.euler(rotation.from_quaternions(shown.rotations[:, joints])))


def trial(
    angles_deg: Floats, starts: npt.NDArray[np.int64], window: int, fps: float, reach_s: float = 1.0
) -> pd.DataFrame:
    """Return the joint angle with the largest jump at a phrase boundary, smoothed by each filter (figure 6.3).

    Parameters
    ----------
    angles_deg : (T, J, 3) joined angles of the synthesised joints before smoothing.
    starts : first frames of the phrases after a boundary.
    window, fps : length of the filters in frames, and frames per second.
    reach_s : time to show on either side of the boundary.

    Returns
    -------
    Columns filter, window, joint, axis, frame, time_s, angle_deg, boundary_s; no rows if there is no boundary.
    """
    columns = ["filter", "window", "joint", "axis", "frame", "time_s", "angle_deg", "boundary_s"]
    if len(starts) == 0:
        return pd.DataFrame(columns=columns)
    jump = np.abs(angles_deg[starts] - angles_deg[starts - 1])
    place, joint, axis = np.unravel_index(int(np.argmax(jump)), jump.shape)
    boundary = int(starts[place])
    reach = round(reach_s * fps)
    frames = np.arange(max(boundary - reach, 0), min(boundary + reach, len(angles_deg)))
    parts = []
    for name in smoothing.FILTERS:
        smoothed = smoothing.around_boundaries(angles_deg[:, joint, axis], starts, name, window)
        part = pd.DataFrame({"frame": frames, "time_s": (frames + 0.5) / fps, "angle_deg": smoothed[frames]})
        parts.append(part.assign(filter=name))
    table = pd.concat(parts, ignore_index=True)
    table["joint"], table["axis"] = SYNTHESISED[joint], "xyz"[axis]
    table["window"], table["boundary_s"] = window, boundary / fps
    return table[columns]
