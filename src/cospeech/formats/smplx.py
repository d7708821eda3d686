"""SMPL-X motion in the layout of BEAT2 and AMASS: npz files with ``poses``, ``trans`` and a frame rate."""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from cospeech.data import frame_rates, tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import foreign
from cospeech.formats.bvh import LARGEST, Clip
from cospeech.geometry.rotation import from_vectors

NAMES = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
"""The body joints of SMPL-X in its order; those of jaw, eyes and fingers follow and are not used."""

PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)

RATES = ("mocap_frame_rate", "mocap_framerate")
"""Names of the frame rate in BEAT2 and in AMASS."""

WIDTHS = {66: "the body alone", 72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
"""Columns of ``poses``, three per joint, by body model; the first 22 joints are the same in all of them."""

WIDTH, SHAPES, EXPRESSIONS = 165, 300, 100
"""Columns of ``poses``, and numbers that describe the shape of the body and the face, in BEAT2."""

MAX_FPS = 1000.0

BONES = (("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"), ("right_shoulder", "right_elbow"),
         ("right_elbow", "right_wrist"))  # fmt: skip
"""Bones whose ends would keep their distance if the arrays held positions of joints."""

RIGID, MOVING = 0.01, 0.05
"""Relative variation of a bone's length below which it is rigid, and above which its end moves."""


def read(path: str | Path) -> Clip:
    """Read the body motion of an SMPL-X npz file: rotation vectors in radians, T-pose at zero angles.

    Raises
    ------
    UserError : if the file is missing, damaged or too large, if an array is missing or has a wrong shape, if
        ``poses`` does not hold rotation vectors in radians, or if there is a NaN, with its joint and frame.
    """
    arrays, found = _load(path)
    rate = next((arrays[name] for name in RATES if name in arrays), None)
    if "poses" not in arrays or "trans" not in arrays or rate is None:
        raise UserError(
            f"{path}: SMPL-X motion needs poses, trans and mocap_frame_rate; the file holds {found}; save it in that "
            "layout (poses: the rotation vectors of all joints, pelvis first)"
        )
    poses, trans = arrays["poses"], arrays["trans"]
    if poses.ndim == 3 and poses.shape[2] == 3:
        poses = poses.reshape(len(poses), 3 * poses.shape[1])
    if poses.ndim != 2 or poses.shape[1] not in WIDTHS or trans.shape != (len(poses), 3):
        expected = ", ".join(f"{width} for {model}" for width, model in WIDTHS.items())
        raise UserError(
            f"{path}: poses {poses.shape} and trans {trans.shape} are not (frames, 165) and (frames, 3); "
            f"save three numbers per joint: {expected}"
        )
    if len(poses) == 0:
        raise UserError(f"{path}: holds no frame; name another file, or leave the record out")
    foreign.check_joint_frames(len(NAMES), len(poses), path)
    turns = _numbers(poses[:, : 3 * len(NAMES)], "poses", path).reshape(len(poses), len(NAMES), 3)
    trans, given = _numbers(trans, "trans", path), _numbers(rate, RATES[0], path)
    if given.size != 1 or not 1 <= float(given.reshape(-1)[0]) <= MAX_FPS:
        raise UserError(
            f"{path}: mocap_frame_rate is {_brief(rate)}; it must be one number from 1 to {MAX_FPS:g}, in frames per "
            "second"
        )
    missing = np.argwhere(~np.isfinite(turns).all(axis=2))
    if len(missing):
        frame, joint = missing[0]
        raise UserError(f"{path}: joint '{NAMES[joint]}' is missing (NaN) in frame {frame}; fill or cut the gap")
    if not np.isfinite(trans).all():
        frame = int(np.flatnonzero(~np.isfinite(trans).all(axis=1))[0])
        raise UserError(f"{path}: trans is missing (NaN) in frame {frame}; fill or cut the gap")
    if np.abs(trans).max() > LARGEST:
        raise UserError(f"{path}: trans has the value {np.abs(trans).max():.3g}; correct it, or export it again")
    _check_vectors(turns, path)
    fps, notes = frame_rates.from_rate(float(given.reshape(-1)[0]))
    return Clip(NAMES, PARENTS, from_vectors(turns), {0: trans}, fps, notes=tuple(notes))


def write(path: str | Path, poses: Floats, trans: Floats, fps: float) -> None:
    """Write body motion in the layout of BEAT2, with a neutral shape and face and hands at rest.

    Parameters
    ----------
    poses : (T, 22, 3) rotation vectors in radians of the joints ``NAMES``, in the frame of the parent.
    trans : (T, 3) displacement of the body in metres.
    fps : frames per second; a whole number, as the layout has it, or any other.
    """
    whole = np.zeros((len(poses), WIDTH))
    whole[:, : 3 * len(NAMES)] = poses.reshape(len(poses), -1)
    rate = int(fps) if float(fps).is_integer() else fps
    with tables.replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            betas=np.zeros(SHAPES, dtype=np.float32),
            poses=whole.astype(np.float32),
            expressions=np.zeros((len(poses), EXPRESSIONS)),
            trans=trans.astype(np.float64),
            model=np.array("smplx2020"),
            gender=np.array("neutral"),
            mocap_frame_rate=np.array(rate),
        )


def _check_vectors(turns: Floats, path: str | Path) -> None:
    """Raise UserError if ``turns`` (T, J, 3) are not rotation vectors in radians: degrees, or positions of joints."""
    longest = np.linalg.norm(np.clip(turns, -LARGEST, LARGEST), axis=2)  # larger squares could overflow
    frame, joint = np.unravel_index(int(longest.argmax()), longest.shape)
    if longest[frame, joint] > 2 * math.pi:
        raise UserError(
            f"{path}: joint '{NAMES[joint]}' turns by {longest[frame, joint]:.3g} rad in frame {frame}, more than a "
            "full turn, so poses seems to be in degrees; convert it to radians"
        )
    rigid = []
    for joint_name, child_name in BONES:
        bone = turns[:, NAMES.index(child_name)] - turns[:, NAMES.index(joint_name)]
        length = np.linalg.norm(bone, axis=1)
        moves = np.linalg.norm(bone.std(axis=0)) > MOVING * length.mean()
        rigid.append(moves and length.std() < RIGID * length.mean())
    if all(rigid):
        raise UserError(
            f"{path}: poses seems to hold positions of joints, as neighbouring joints keep their distance; save the "
            "rotation vectors of the joints"
        )


def _load(path: str | Path) -> tuple[dict[str, np.ndarray], str]:
    """Return the arrays that are needed, and the names of all arrays in the file."""
    content = foreign.read_bytes(path)
    if content.startswith(b"\x93NUMPY"):
        raise UserError(f"{path}: holds one bare array; save poses, trans and mocap_frame_rate with numpy.savez")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {item.filename.removesuffix(".npy"): item for item in archive.infolist()}
            needed = [name for name in ("poses", "trans", *RATES) if name in members]
            foreign.check_unpacked(
                sum(members[name].file_size for name in needed),
                sum(members[name].compress_size for name in needed),
                str(path),
            )
            arrays = {name: _array(archive.read(members[name]), name, path) for name in needed}
    except (zipfile.BadZipFile, zlib.error, EOFError) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged or not an npz archive ({reason}); copy or export it again") from error
    except (NotImplementedError, RuntimeError, ValueError, OSError) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: cannot be unpacked ({reason}); save it with numpy.savez") from error
    return arrays, ", ".join(sorted(members))[:200] or "nothing"


def _array(content: bytes, name: str, path: str | Path) -> np.ndarray:
    """Return the array that one member of the archive holds in the npy format; objects are never unpickled."""
    file = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(file)
        reader: Any = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, by_column, dtype = reader(file)
    except Exception as error:  # the header is parsed as Python code, which raises errors of many types
        raise UserError(f"{path}: {name} is not an array; save the file with numpy.savez") from error
    if dtype.hasobject:
        raise UserError(f"{path}: {name} holds Python objects and must hold numbers; export it again")
    count = math.prod(shape)
    if any(size < 0 for size in shape) or count * dtype.itemsize > len(content) - file.tell():
        raise UserError(f"{path}: {name} announces an array of shape {_brief(shape)} and is shorter; export it again")
    array = np.frombuffer(content, dtype, count, file.tell())
    return array.reshape(shape, order="F" if by_column else "C")


def _numbers(array: np.ndarray, name: str, path: str | Path) -> Floats:
    if array.dtype.kind not in "iuf":
        raise UserError(f"{path}: {name} has the type {array.dtype} and must hold numbers; export it again")
    with np.errstate(all="ignore"):  # long doubles that are too large become infinite
        return array.astype(float)


def _brief(value: object) -> str:
    return " ".join(str(value).split())[:40]
