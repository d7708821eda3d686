"""Recordings of live motion, as BVH, as a table or as text, that lose nothing.

Each frame is appended at once to a file next to the recording, ``<name>.recording``. When the recording ends, the BVH
or the table is written from this file, exactly as for the same motion made from a whole record. If the program is
killed, the file remains with all frames shown until then, and ``recover`` completes the recording.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import bvh
from cospeech.geometry import rotation
from cospeech.motion import head as head_motion
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD, Body
from cospeech.motion.library import Poses
from cospeech.synthesis import live
from cospeech.workflow.job import settings_hash

ENDS = (".bvh", ".parquet", ".csv")
"""The ends of the names of recordings, which state their format: BVH, or a table, as Parquet or as text."""

END = ".recording"
"""Added to the name of a recording while it grows."""

FORMAT = "cospeech recording 2"

Note = Callable[[str], None]


class Recorder:
    """Records frames.

    Parameters
    ----------
    path : the recording, ``.bvh``, ``.parquet`` or ``.csv``.
    body : the body that moves; None: a head alone, whose frames are angles (3,) in degrees.
    fps : frame rate.
    card : card of the model, for the origin of a table.
    overwrite : whether an existing recording is replaced.
    note : says in one line that the recording stops early.

    Raises
    ------
    UserError : if the file cannot be written, exists already, or is being recorded.
    """

    in_real_time = False

    def __init__(
        self, path: Path, body: Body | None, fps: float, card: Mapping[str, Any], overwrite: bool, note: Note
    ) -> None:
        check(path, overwrite)
        self._path, self._growing, self._note = path, path.with_name(path.name + END), note
        head = {
            "format": FORMAT,
            "fps": fps,
            "corpus": card["corpus"],
            "config_hash": settings_hash(dict(card)),
            "body": None
            if body is None
            else {
                "joints": body.joints,
                "parents": body.parents.tolist(),
                "offsets_m": body.offsets_m.tolist(),
            },
        }
        try:
            self._file = os.open(self._growing, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except FileExistsError as error:
            raise UserError(
                f"{self._growing}: belongs to a recording that runs or was interrupted; complete it with "
                f"'cospeech live --recover {self._growing}', or delete it"
            ) from error
        except OSError as error:
            raise UserError(f"{path}: cannot be written ({error.strerror}); name another file") from error
        self._n_shown = 0
        self._stopped = False
        os.write(self._file, json.dumps(head).encode() + b"\n")

    def show(self, frame: int, time_s: float, pose: Floats) -> None:
        """Append a frame; see ``outputs.Output``."""
        if self._stopped:
            return
        try:
            os.write(self._file, np.ascontiguousarray(pose, dtype="<f8").tobytes())
            self._n_shown += 1
        except OSError as error:
            self._stopped = True
            self._note(f"{self._path}: recording stops after {self._n_shown} frames ({error.strerror})")

    def close(self) -> None:
        """Complete the recording; there is none if no frame was shown."""
        os.close(self._file)
        if self._n_shown:
            complete(self._growing, self._path)
        else:
            self._growing.unlink()


def check(path: Path, overwrite: bool) -> None:
    """Raise UserError if a recording cannot have this name."""
    if path.suffix not in ENDS:
        ends = f"{', '.join(ENDS[:-1])} or {ENDS[-1]}"
        raise UserError(f"{path}: the name of a recording ends in {ends}; name another file")
    if path.is_dir():
        raise UserError(f"{path}: is a folder; name a file in it")
    if path.exists() and not overwrite:
        raise UserError(f"{path}: already exists; replace it with --overwrite, or name another file")
    if not path.parent.is_dir():
        raise UserError(f"{path}: the folder {path.parent} does not exist; create it, or name another file")


class _Grown(NamedTuple):
    """The content of a growing recording: its head, and its frames (n, 3 + 4 J), or (n, 3) of a head alone."""

    head: dict[str, Any]
    frames: Floats


def recover(growing: Path, overwrite: bool) -> Path:
    """Complete a recording that was interrupted, and return its path.

    Parameters
    ----------
    growing : the file that remains of it, such as ``<name>.bvh.recording``.
    overwrite : whether an existing recording is replaced.

    Raises
    ------
    UserError : if the file is not that of a recording, holds no frame, or the recording exists already.
    """
    if growing.suffix != END:
        raise UserError(f"{growing}: the name of an interrupted recording ends in {END}; correct it")
    path = growing.with_suffix("")
    check(path, overwrite)
    complete(growing, path)
    return path


def complete(growing: Path, path: Path) -> None:
    """Write the frames of a growing recording to ``path``, and remove what has grown.

    Raises
    ------
    UserError : if it is not a recording, holds no frame, or cannot be written. What has grown remains then.
    """
    head, frames = _read(growing)
    fps = float(head["fps"])
    try:
        if path.suffix == ".bvh":
            _write_bvh(frames, head["body"], fps, path)
        else:
            table, schema = _table(frames, head["body"], fps, path.stem)
            if path.suffix == ".csv":
                table.to_csv(path, index=False, lineterminator="\n", float_format="%.6f")
            else:
                tables.write(table, path, schema, corpus=head["corpus"], config_hash=head["config_hash"])
    except (OSError, UserError) as error:
        reason = getattr(error, "strerror", None) or error
        raise UserError(
            f"{path}: cannot be written ({reason}); its frames are in {growing}: complete it with "
            f"'cospeech live --recover {growing}'"
        ) from error
    growing.unlink()


def _write_bvh(frames: Floats, moved: dict[str, Any] | None, fps: float, path: Path) -> None:
    """Write frames as BVH, in metres; the bones of another body end at its outermost joints."""
    if moved is None:
        bvh.write(head_motion.moved(skeleton.standing(len(frames), fps), live.head_table(frames, fps)), path)
        return
    body = _body(moved)
    if body.joints == STANDARD.joints:
        bvh.write(live.motion_table([frames], fps), path)
        return
    poses = Poses.from_frames(frames)
    outermost = set(range(len(body.joints))) - set(body.parents.tolist())
    clip = bvh.Clip(
        body.joints,
        tuple(body.parents.tolist()),
        rotation.from_quaternions(poses.rotations),
        {0: poses.root_m + body.offsets_m[0]},
        fps,
        body.offsets_m,
        {joint: np.zeros(3) for joint in sorted(outermost)},
    )
    bvh.write_clip(clip, path)


def _table(frames: Floats, moved: dict[str, Any] | None, fps: float, record: str) -> tuple[pd.DataFrame, str]:
    """Return frames as a table, and the name of its schema: ``motion``, ``poses`` of another body, or ``head``."""
    if moved is None:
        return live.head_table(frames, fps), "head"
    body = _body(moved)
    if body.joints == STANDARD.joints:
        return live.motion_table([frames], fps), "motion"
    return library.to_tables({record: Poses.from_frames(frames)}, body, fps)[1], "poses"


def _body(moved: dict[str, Any]) -> Body:
    return Body(tuple(moved["joints"]), np.array(moved["parents"]), np.array(moved["offsets_m"]))


def _read(growing: Path) -> _Grown:
    """Return what has been recorded; a frame that was cut while it was written is left out."""
    try:
        content = growing.read_bytes()
    except OSError as error:
        raise UserError(f"{growing}: cannot be read ({error.strerror}); correct the path") from error
    line, _, rest = content.partition(b"\n")
    try:
        head = json.loads(line)
        known = head["format"] == FORMAT
        width = 3 if head["body"] is None else 3 + 4 * len(head["body"]["joints"])
    except (ValueError, KeyError, TypeError):
        known = False
    if not known:
        raise UserError(f"{growing}: is not an interrupted recording of this version of cospeech; name another file")
    n_frames = len(rest) // (8 * width)
    if n_frames == 0:
        raise UserError(f"{growing}: holds no frame; delete it")
    return _Grown(head, np.frombuffer(rest, "<f8", n_frames * width).reshape(n_frames, width).astype(float))
