"""Any motion file as something that the viewer can show, whatever its skeleton.

Motion of the skeleton of cospeech, and of SMPL-X, is shown as a body, and that of a GLB file with the file's own
surface; other skeletons are shown as bones, and markers as points.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from cospeech.corpus import motion as motion_files
from cospeech.corpus import retarget
from cospeech.data import units
from cospeech.data.arrays import Floats
from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import bvh, c3d, glb, glb_mesh, trc
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD
from cospeech.viewer.takes import Articulated, Free, Version

UP = {".bvh": "y", ".glb": "y", ".trc": "y", ".c3d": "z"}
"""The axis that points up in files of a kind, unless the user says otherwise."""

SUFFIXES = (*UP, *motion_files.SOURCES)


def read(path: Path, unit: str | None = None, up: str | None = None) -> list[Version]:
    """Return what moves in a file: one version, or one for each animation of a GLB file.

    Parameters
    ----------
    unit : unit of length of a BVH file, or of a C3D file that does not state it; by default, BVH files are in metres.
    up : axis of the file that points up, y or z; by default that of ``UP``.

    Raises
    ------
    UserError : if the file cannot be read, or is of an unknown kind.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        raise UserError(f"{path}: is no motion file; the viewer shows {', '.join(sorted(set(SUFFIXES)))}")
    axes = retarget.AXES[up or UP.get(kind, "y")]
    if kind in (".c3d", ".trc"):
        return [_markers(path, c3d.read(path, unit) if kind == ".c3d" else trc.read(path, unit), axes)]
    if kind == ".glb":
        clips, mesh = glb.read(path), glb_mesh.read(path)
        return [
            replace(_bones(name if len(clips) > 1 else path.stem, clip, 1.0, axes), mesh=mesh)
            for name, clip in clips.items()
        ]
    if kind == ".bvh":
        clip = bvh.read(path)
        metres = units.METRES[unit or "m"]
        return [_standard_clip(path.stem, clip) if _is_standard(clip) else _bones(path.stem, clip, metres, axes)]
    conventions = retarget.MotionConventions("y", "m", "smplx", "t_pose")
    table = motion_files.read(path, conventions).table
    moving = Articulated(STANDARD, library.from_motion(table))
    return [Version(path.stem, moving, skeleton.frame_rate(table), skinned=True)]


def _is_standard(clip: Clip) -> bool:
    """Return whether a clip is one that cospeech wrote: its joints, with its bones."""
    if set(clip.names) != set(skeleton.JOINTS) or clip.offsets is None:
        return False
    known = {name: offset for name, offset in zip(clip.names, clip.offsets, strict=True) if name != "hips"}
    return all(np.allclose(offset, skeleton.OFFSET_M[name], atol=1e-4) for name, offset in known.items())


def _standard_clip(title: str, clip: Clip) -> Version:
    order = [clip.names.index(name) for name in skeleton.JOINTS]
    poses = library.Poses(
        clip.places[0] - skeleton.OFFSET_M["hips"], rotation.to_quaternions(clip.rotations[:, order])
    )
    return Version(title, Articulated(STANDARD, poses), clip.fps, skinned=True)


def _bones(title: str, clip: Clip, metres: float, axes: Floats) -> Version:
    """Return a clip as joints in the world, with the far ends of bones that have no further joint."""
    world = retarget.world_rotations(clip)
    places = np.stack(retarget.world_positions(clip, world), axis=1)
    names, parents = list(clip.names), list(clip.parents)
    for joint, tip in clip.tips.items():
        places = np.concatenate([places, (places[:, joint] + world[:, joint] @ tip)[:, None]], axis=1)
        world = np.concatenate([world, world[:, joint][:, None]], axis=1)
        names.append(f"{clip.names[joint]} end")
        parents.append(joint)
    moved = Free(tuple(names), tuple(parents), metres * places @ axes.T, rotation.to_quaternions(axes @ world))
    return Version(title, moved, clip.fps)


def _markers(path: Path, markers: Trajectories, axes: Floats) -> Version:
    moved = Free(tuple(markers.names), (-1,) * len(markers.names), markers.places_m @ axes.T)
    return Version(path.stem, moved, markers.fps)
