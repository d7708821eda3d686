"""Libraries of motion segments: the recordings they come from, pose by pose, and which segments are neighbours.

A recording is kept whole, since blending needs the frame before a segment, and a cost of transition the segments that
preceded and followed it. Any body can have a library; motion tables are those of ``skeleton``, and other bodies are
stored as tables of the schemas ``body`` and ``poses``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.geometry import rotation
from cospeech.motion import euler, skeleton
from cospeech.motion.body import STANDARD, Body

COLUMNS = ["record", "segment", "start_frame", "end_frame", "fps", "n_frames"]
"""Columns of schema ``library``."""

ROOT_COLUMNS, QUATERNION_COLUMNS = ["x_m", "y_m", "z_m"], ["w", "x", "y", "z"]
"""Columns of schema ``poses``."""


@dataclass(frozen=True, eq=False)
class Poses:
    """T poses of a body of J joints.

    Attributes
    ----------
    root_m : (T, 3) displacement of the root from its offset in metres.
    rotations : (T, J, 4) unit quaternions w, x, y, z of the joints in parent space.
    """

    root_m: Floats
    rotations: Floats

    @property
    def frames(self) -> Floats:
        """The poses as rows (T, 3 + 4 J): root position, then the rotation of each joint."""
        return np.concatenate([self.root_m, self.rotations.reshape(len(self.root_m), -1)], axis=1)

    @classmethod
    def from_frames(cls, frames: Floats) -> Poses:
        """Return the poses in rows (T, 3 + 4 J)."""
        root, rest = np.ascontiguousarray(frames[:, :3]), np.ascontiguousarray(frames[:, 3:])
        return cls(root, rest.reshape(len(frames), -1, 4))

    def at(self, frames: Integers | slice) -> Poses:
        """Return the poses of some frames."""
        return Poses(self.root_m[frames], self.rotations[frames])

    def resampled(self, positions: Floats) -> Poses:
        """Return the poses (m,) at fractional frame numbers, from 0 to T - 1, interpolated along the shortest arc."""
        first = np.clip(np.floor(positions).astype(np.int64), 0, max(len(self.root_m) - 2, 0))
        second = np.minimum(first + 1, len(self.root_m) - 1)
        share = np.clip(positions - first, 0.0, 1.0)
        root = self.root_m[first] + share[:, None] * (self.root_m[second] - self.root_m[first])
        a, b = self.rotations[first], self.rotations[second]
        cosine = (a * b).sum(axis=-1, keepdims=True)
        b = np.where(cosine < 0.0, -b, b)
        # Half the angle between unit vectors, accurate for small angles, too.
        angle = 2.0 * np.arctan2(np.linalg.norm(b - a, axis=-1), np.linalg.norm(b + a, axis=-1))[..., None]
        part = share[:, None, None]
        # The ratio of sines by way of sinc, which is smooth at 0.
        weight = [s * np.sinc(s * angle / np.pi) / np.sinc(angle / np.pi) for s in (1.0 - part, part)]
        between = weight[0] * a + weight[1] * b
        return Poses(root, between / np.linalg.norm(between, axis=-1, keepdims=True))


def from_motion(motion: pd.DataFrame) -> Poses:
    """Return the poses of a motion table (schema ``motion``), on the body ``STANDARD``."""
    root = motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float)
    rotations = rotation.to_quaternions(skeleton.rotations(skeleton.angles(motion)))
    return Poses(np.ascontiguousarray(root), rotations)


def to_motion(poses: Poses, fps: float) -> pd.DataFrame:
    """Return the motion table of poses of the body ``STANDARD``; its angles are continuous in time."""
    angles = euler.least_change(rotation.from_quaternions(poses.rotations))
    return skeleton.motion_table(poses.root_m, angles, fps)


class Library:
    """Motion segments, and the recordings that they are parts of.

    Attributes
    ----------
    body : the body that moves.
    fps : frame rate of all poses.
    table : one row per segment (schema ``library``), sorted by record and time: record, segment, start_frame and
        end_frame in its recording, fps, and n_frames of the recording.
    poses : of all recordings, one after another, (F frames).
    first : by record, the index of its first frame in ``poses``.
    start, end : (N,) first frame of each segment in ``poses``, and first frame after it.
    before : (F,) the frame one earlier in the same recording, for the speed of each frame. The first frame of a
        recording has none; the second one takes its place, at which the speed is the same.
    preceding, following : (N,) the segment that precedes or follows each segment in its recording, -1 if none does.

    Raises
    ------
    UserError : if there is no segment, or a segment is not within a recording.
    """

    def __init__(self, segments: pd.DataFrame, recordings: Mapping[str, Poses], fps: float, body: Body = STANDARD):
        """Collect the segments of recordings.

        Parameters
        ----------
        segments : columns record, start_frame, end_frame, and ``segment`` or ``phase``, the number within the
            record: tables of the schemas ``phases``, ``subunits`` and ``library`` have them.
        recordings : the poses of each record, all at the same rate.
        fps : frame rate of the poses.
        """
        if len(segments) == 0:
            raise UserError("the motion library has no segment; at least one is needed")
        number = "segment" if "segment" in segments.columns else "phase"
        table = segments.rename(columns={number: "segment"})[COLUMNS[:4]]
        table = table.sort_values(["record", "start_frame"], kind="stable", ignore_index=True)
        used = [str(record) for record in dict.fromkeys(table["record"])]
        for record in used:
            _check_recording(record, recordings, body)
        lengths = {record: len(recordings[record].root_m) for record in used}
        table["fps"] = float(fps)
        table["n_frames"] = table["record"].map(lengths).astype(np.int64)
        wrong = (
            (table["start_frame"] < 0)
            | (table["end_frame"] <= table["start_frame"])
            | (table["end_frame"] > table["n_frames"])
        )
        if wrong.any():
            row = table[wrong].iloc[0]
            raise UserError(
                f"segment {row['segment']} of '{row['record']}' covers the frames {row['start_frame']} to "
                f"{row['end_frame']}, but its motion has {row['n_frames']}; segment the motion again"
            )
        offsets = np.concatenate([[0], np.cumsum(list(lengths.values()))])
        self.body, self.fps, self.table = body, float(fps), table
        self.first = dict(zip(used, offsets[:-1].tolist(), strict=True))
        self.poses = Poses(
            np.concatenate([recordings[record].root_m for record in used]),
            np.concatenate([recordings[record].rotations for record in used]),
        )
        begin = table["record"].map(self.first).to_numpy(dtype=np.int64)
        self.start = begin + table["start_frame"].to_numpy(dtype=np.int64)
        self.end = begin + table["end_frame"].to_numpy(dtype=np.int64)
        self.before = np.arange(-1, offsets[-1] - 1)
        for record, length in lengths.items():
            self.before[self.first[record]] += min(2, length)
        together = table["record"].to_numpy()[1:] == table["record"].to_numpy()[:-1]
        rows = np.arange(len(table))
        self.preceding = np.where(np.append(False, together), rows - 1, -1)
        self.following = np.where(np.append(together, False), rows + 1, -1)

    @classmethod
    def of_motions(cls, segments: pd.DataFrame, motions: Mapping[str, pd.DataFrame]) -> Library:
        """Return the library of segments of motion tables, at the frame rate of the first record.

        Motion at another rate is resampled.

        Raises
        ------
        UserError : if there is no segment, or a segment has no motion.
        """
        used = [str(record) for record in sorted(set(segments["record"]))]
        for record in used:
            if record not in motions:
                raise UserError(_missing(record))
        rates = {record: skeleton.frame_rate(motions[record]) for record in used}
        fps = rates[used[0]] if used else 0.0
        parts, recordings = [], {}
        for record in used:
            rows, recordings[record] = _at_rate(
                segments[segments["record"] == record], from_motion(motions[record]), rates[record], fps
            )
            parts.append(rows)
        return cls(pd.concat(parts) if parts else segments, recordings, fps)

    @property
    def recordings(self) -> dict[str, Poses]:
        """The poses of each record."""
        lengths = self.table.groupby("record")["n_frames"].first()
        return {record: self.poses.at(slice(first, first + lengths[record])) for record, first in self.first.items()}

    def at_rate(self, fps: float) -> Library:
        """Return the library resampled to another frame rate; every segment keeps at least one frame."""
        if fps == self.fps:
            return self
        parts, recordings = [], {}
        for record, poses in self.recordings.items():
            rows, recordings[record] = _at_rate(self.table[self.table["record"] == record], poses, self.fps, fps)
            parts.append(rows)
        return Library(pd.concat(parts), recordings, fps, self.body)


def _at_rate(segments: pd.DataFrame, poses: Poses, fps: float, wanted: float) -> tuple[pd.DataFrame, Poses]:
    """Return segments and poses of one record at another frame rate; frame k is at the time (k + 0.5) / fps."""
    if fps == wanted:
        return segments, poses
    n_frames = max(round(len(poses.root_m) / fps * wanted), 1)
    positions = (np.arange(n_frames) + 0.5) / wanted * fps - 0.5
    starts, ends = (np.rint(segments[name] / fps * wanted).astype(np.int64) for name in COLUMNS[2:4])
    starts = np.minimum(starts, n_frames - 1)
    rows = segments.assign(start_frame=starts, end_frame=np.clip(ends, starts + 1, n_frames))
    return rows, poses.resampled(np.clip(positions, 0.0, len(poses.root_m) - 1.0))


def _missing(record: str) -> str:
    return f"the motion library has segments of '{record}', but no motion of it; add the motion or leave them out"


def _check_recording(record: str, recordings: Mapping[str, Poses], body: Body) -> None:
    if record not in recordings or len(recordings[record].root_m) == 0:
        raise UserError(_missing(record))
    n_joints = recordings[record].rotations.shape[1]
    if n_joints != len(body.joints):
        raise UserError(
            f"the motion of '{record}' has {n_joints} joints, but the body of the library has {len(body.joints)}; "
            "all motion of a library must be of the same body"
        )


def to_tables(recordings: Mapping[str, Poses], body: Body, fps: float) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return a body and its poses in recordings as tables of the schemas ``body`` and ``poses``."""
    parts = []
    for record, poses in recordings.items():
        n_frames, n_joints = poses.rotations.shape[:2]
        part = pd.DataFrame({"record": record, "frame": np.repeat(np.arange(n_frames), n_joints)})
        part["time_s"] = (part["frame"] + 0.5) / fps
        part["joint"] = np.tile(np.array(body.joints, dtype=object), n_frames)
        part[QUATERNION_COLUMNS] = poses.rotations.reshape(-1, 4)
        places = np.full((n_frames, n_joints, 3), np.nan)
        places[:, 0] = poses.root_m
        part[ROOT_COLUMNS] = places.reshape(-1, 3)
        parts.append(part)
    return body.to_table(), pd.concat(parts, ignore_index=True)


def from_tables(body_table: pd.DataFrame, poses_table: pd.DataFrame) -> tuple[dict[str, Poses], Body]:
    """Return the poses of each record and the body that ``to_tables`` converted, without loss.

    Raises
    ------
    UserError : if a frame does not have exactly the joints of the body.
    """
    body = Body.from_table(body_table)
    recordings = {}
    for record, rows in poses_table.groupby("record", sort=False):
        n_frames = len(rows) // len(body.joints)
        expected = np.tile(np.array(body.joints, dtype=object), n_frames)
        if len(rows) == 0 or len(rows) != len(expected) or (rows["joint"].to_numpy(dtype=object) != expected).any():
            raise UserError(
                f"the poses of '{record}' do not list the joints of the body in its order in every frame; they and "
                "the body are of different libraries"
            )
        quaternions = rows[QUATERNION_COLUMNS].to_numpy(dtype=float).reshape(n_frames, len(body.joints), 4)
        root = rows[ROOT_COLUMNS].to_numpy(dtype=float)[:: len(body.joints)]
        recordings[str(record)] = Poses(np.ascontiguousarray(root), np.ascontiguousarray(quaternions))
    return recordings, body
