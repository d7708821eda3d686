"""SMPL-X motion in the layout of BEAT2 and AMASS: npz files with ``poses``, ``trans`` and a frame rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cospeech.errors import UserError
from cospeech.formats.bvh import Clip
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


def read(path: str | Path) -> Clip:
    """Read the body motion of an SMPL-X npz file: rotation vectors in radians, T-pose at zero angles.

    Raises
    ------
    UserError : if the file is missing or damaged, if an array is missing or has a wrong shape, or if there is a NaN,
        with its joint and frame.
    """
    arrays = _load(path)
    rate = next((arrays[name] for name in RATES if name in arrays), None)
    if "poses" not in arrays or "trans" not in arrays or rate is None:
        found = ", ".join(sorted(arrays)) or "nothing"
        raise UserError(f"{path}: SMPL-X motion needs poses, trans and mocap_frame_rate; the file holds {found}")
    poses, trans = (_numbers(arrays[name], name, path) for name in ("poses", "trans"))
    fps = _numbers(rate, "mocap_frame_rate", path)
    if poses.ndim != 2 or poses.shape[1] % 3 or poses.shape[1] < 3 * len(NAMES) or trans.shape != (len(poses), 3):
        raise UserError(
            f"{path}: poses {poses.shape} and trans {trans.shape} are not (frames, 165) and (frames, 3); "
            "name a file in the SMPL-X layout"
        )
    if len(poses) == 0:
        raise UserError(f"{path}: holds no frame; name another file, or leave the record out")
    if fps.size != 1 or not 1 <= float(fps.reshape(-1)[0]) <= 1000:
        raise UserError(f"{path}: mocap_frame_rate is {rate}; it must be one number, in frames per second")
    turns = poses[:, : 3 * len(NAMES)].reshape(len(poses), len(NAMES), 3)
    missing = np.argwhere(~np.isfinite(turns).all(axis=2))
    if len(missing):
        frame, joint = missing[0]
        raise UserError(f"{path}: joint '{NAMES[joint]}' is missing (NaN) in frame {frame}; fill or cut the gap")
    if not np.isfinite(trans).all():
        frame = int(np.flatnonzero(~np.isfinite(trans).all(axis=1))[0])
        raise UserError(f"{path}: trans is missing (NaN) in frame {frame}; fill or cut the gap")
    rotations = from_vectors(turns)
    return Clip(NAMES, PARENTS, rotations, {0: trans}, float(fps.reshape(-1)[0]))


def _load(path: str | Path) -> dict[str, np.ndarray]:
    try:
        with Path(path).open("rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("one bare array")
            with archive:
                return {name: archive[name] for name in archive.files if name in ("poses", "trans", *RATES)}
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; correct the path") from error
    except Exception as error:  # damaged archives raise errors of zip, zlib or the array format
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged or not an npz archive ({reason}); copy or export it again") from error


def _numbers(array: np.ndarray, name: str, path: str | Path) -> np.ndarray:
    if not np.issubdtype(array.dtype, np.number) or np.iscomplexobj(array):
        raise UserError(f"{path}: {name} has the type {array.dtype} and must hold numbers; export it again")
    return array.astype(float)
