"""Motion of any body, human or not, as recordings for a motion library: a folder of BVH or GLB files.

All files must be of the same body. The body keeps its own skeleton; only motion of the skeleton of cospeech becomes
motion of ``STANDARD``. Where a file has joints that move along with controls and not with bones, such as the targets
of inverse kinematics, the root is the joint that moves with the most joints below it, and joints that are not below
it are left out.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cospeech.corpus.retarget import AXES, world_positions, world_rotations
from cospeech.data import units
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import bvh, glb
from cospeech.formats.bvh import Clip
from cospeech.geometry import rotation
from cospeech.motion import skeleton
from cospeech.motion.body import STANDARD, Body
from cospeech.motion.library import Poses

STRETCH = 0.05
"""Largest range of the position of a joint in the frame of its parent, relative to its mean distance from it, at
which the bone counts as rigid."""

SAME_BONES = 0.02
"""Largest difference of a bone between files, relative to the sum of all bones, at which the body is the same."""

LIVELY = 0.5
"""End effectors are hands if they move at this share of the speed of the fastest one, or faster."""

LEAST_M_S = 1e-3
"""Slower hands do not move."""

HUMAN_HANDS = ("left_hand", "right_hand")


class Folder(NamedTuple):
    """The recordings in a folder.

    Attributes
    ----------
    body : the body of all recordings.
    recordings : poses by name of the recording: that of the file, followed by that of the animation if a file
        contains several.
    fps : frame rate of all recordings, that of the first file.
    hands : joints that gesture.
    notes : how files were interpreted.
    """

    body: Body
    recordings: dict[str, Poses]
    fps: float
    hands: tuple[str, ...]
    notes: list[str]


class _Moving(NamedTuple):
    """One recording: joints, parents, rigid offsets (J, 3), poses, and frame rate."""

    joints: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Floats
    poses: Poses
    fps: float


def read(folder: Path, unit: str, up: str, hands: Sequence[str] = ()) -> Folder:
    """Read the BVH and GLB files of a folder.

    Parameters
    ----------
    unit, up : of BVH files, which do not state them: a name in ``units.METRES``, and the axis that points up.
    hands : joints that gesture; by default, those of ``STANDARD``, or the end effectors that move fastest.

    Raises
    ------
    UserError : if the folder contains no such file, a file cannot be read or moves another body than the first one, a
        hand is not a joint, or no hand moves.
    """
    if not folder.is_dir():
        raise UserError(f"{folder}: is not a folder; name the folder of the motion files")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in (".bvh", ".glb"))
    if not paths:
        raise UserError(f"{folder}: contains no .bvh and no .glb file; name the folder of the motion files")
    notes: list[str] = []
    clips: dict[str, tuple[Path, Clip]] = {}
    for path in paths:
        for name, clip in _clips(path).items():
            if name in clips:
                raise UserError(f"{path}: there is another recording '{name}'; rename one of the files")
            notes += [f"{path.name}: {note}" for note in clip.notes]
            clips[name] = path, clip
            _check_same_joints(*next(iter(clips.values())), path, clip)
    root, left_out = _root([clip for _, clip in clips.values()])
    if left_out:
        listed = ", ".join(left_out[:5]) + (", ..." if len(left_out) > 5 else "")
        _, clip = next(iter(clips.values()))
        notes.append(f"'{clip.names[root]}' is the root; left out as not below it: {listed}")
    moving = {name: _moving(clip, root, *_frame(path, unit, up), str(path)) for name, (path, clip) in clips.items()}
    for name, one in moving.items():
        _check_same_bones(next(iter(moving.values())), one, paths[0], clips[name][0])
    first = next(iter(moving.values()))
    recordings = {}
    for name, one in moving.items():
        recordings[name] = one.poses
        if one.fps != first.fps:
            n_frames = max(round(len(one.poses.root_m) / one.fps * first.fps), 1)
            positions = (np.arange(n_frames) + 0.5) / first.fps * one.fps - 0.5
            recordings[name] = one.poses.resampled(np.clip(positions, 0.0, len(one.poses.root_m) - 1.0))
            notes.append(f"{name}: resampled from {one.fps:g} to {first.fps:g} frames per second")
    body, recordings = _body(first, recordings)
    chosen = _hands(body, recordings, first.fps, hands, folder)
    return Folder(body, recordings, first.fps, chosen, notes)


def rigid(path: Path, unit: str, up: str) -> dict[str, tuple[Body, Poses, float]]:
    """Return the body, the poses and the frame rate of each recording in a BVH or GLB file, by name.

    Parameters
    ----------
    unit, up : of a BVH file, as for ``read``.

    Raises
    ------
    UserError : if the file cannot be read, or bones that carry other bones change their length.
    """
    found = {}
    for name, clip in _clips(path).items():
        one = _moving(clip, 0, *_frame(path, unit, up), str(path))
        found[name] = Body(one.joints, np.array(one.parents), one.offsets), one.poses, one.fps
    return found


def places(folder: Folder, name: str) -> Floats:
    """Return the positions of the hands of a recording relative to the root in metres, (T, H, 3), in world axes."""
    _, placed = folder.body.world(folder.recordings[name].root_m, folder.recordings[name].rotations)
    indices = [folder.body.joints.index(hand) for hand in folder.hands]
    return placed[:, indices] - placed[:, :1]


def reach_m(body: Body, hands: Sequence[str]) -> float:
    """Return the mean length in metres of the chains of bones from the root to the hands."""
    lengths = []
    for hand in hands:
        joint, length = body.joints.index(hand), 0.0
        while body.parents[joint] >= 0:
            length += float(np.linalg.norm(body.offsets_m[joint]))
            joint = int(body.parents[joint])
        lengths.append(length)
    return float(np.mean(lengths))


def _clips(path: Path) -> dict[str, Clip]:
    if path.suffix.lower() == ".bvh":
        return {path.stem: bvh.read(path)}
    found = glb.read(path)
    return {path.stem if len(found) == 1 else f"{path.stem}.{name}": clip for name, clip in found.items()}


def _frame(path: Path, unit: str, up: str) -> tuple[float, Floats]:
    """Return the length in metres of the unit of a file, and the rotation (3, 3) from its axes to ours."""
    return (1.0, np.eye(3)) if path.suffix.lower() == ".glb" else (units.METRES[unit], AXES[up])


def _loose(clip: Clip) -> list[int]:
    """Return the joints other than the first whose position in the frame of the parent changes."""
    return [
        joint
        for joint, place in clip.places.items()
        if joint > 0 and np.ptp(place, axis=0).max() > STRETCH * np.linalg.norm(place.mean(axis=0))
    ]


def _root(clips: Sequence[Clip]) -> tuple[int, list[str]]:
    """Return the root of the body, and the joints that are not below it."""
    names, parents = clips[0].names, clips[0].parents
    below = {joint: _below(parents, joint) for joint in {0}.union(*map(_loose, clips))}
    root = max(below, key=lambda joint: (joint > 0, len(below[joint]), -joint))
    if len(below[root]) < len(names) / 2:
        root = 0
    return root, [name for joint, name in enumerate(names) if joint != root and joint not in below[root]]


def _moving(clip: Clip, root: int, metres: float, axes: Floats, where: str) -> _Moving:
    """Return the recording of a clip with rigid bones, from a root on."""
    world = world_rotations(clip)
    placed = world_positions(clip, world)
    kept = [root, *_below(clip.parents, root)]
    index = {joint: place for place, joint in enumerate(kept)}
    bent = [joint for joint in _loose(clip) if joint in kept[1:] and _below(clip.parents, joint)]
    if bent:
        raise UserError(
            f"{where}: joint '{clip.names[bent[0]]}' moves away from its parent and carries other joints; bones must "
            "be rigid: export the motion as rotations"
        )
    local = clip.rotations[:, kept].copy()
    local[:, 0] = axes @ world[:, root]
    rest = np.zeros((len(clip.names), 3)) if clip.offsets is None else clip.offsets
    offsets = np.array([clip.places[joint].mean(axis=0) if joint in clip.places else rest[joint] for joint in kept])
    offsets[0] = 0.0
    poses = Poses(np.ascontiguousarray(placed[root] @ axes.T * metres), rotation.to_quaternions(local))
    names = tuple(clip.names[joint] for joint in kept)
    parents = tuple(-1 if joint == root else index[clip.parents[joint]] for joint in kept)
    return _Moving(names, parents, offsets * metres, poses, clip.fps)


def _below(parents: tuple[int, ...], top: int) -> list[int]:
    found = {top}
    for joint, parent in enumerate(parents):
        if parent in found:
            found.add(joint)
    return sorted(found - {top})


def _check_same_joints(path: Path, first: Clip, other: Path, one: Clip) -> None:
    """Raise UserError if two clips do not have the same joints."""
    if first.names != one.names or first.parents != one.parents:
        differing = [name for name in one.names if name not in first.names]
        differing += [name for name in first.names if name not in one.names]
        what = f"joint '{differing[0]}' is only in one of them" if differing else "their joints have another order"
        raise UserError(f"{other}: has another skeleton than {path.name} ({what}); put it into a folder of its own")


def _check_same_bones(first: _Moving, one: _Moving, path: Path, other: Path) -> None:
    """Raise UserError if the bones of two recordings have other lengths."""
    apart = np.linalg.norm(first.offsets - one.offsets, axis=1)
    if apart.max(initial=0.0) > SAME_BONES * np.linalg.norm(first.offsets, axis=1).sum():
        joint = first.joints[int(apart.argmax())]
        raise UserError(
            f"{other}: the bone of joint '{joint}' differs from that in {path.name} by {apart.max():.3g} m; all "
            "files must be of the same body: put this one into a folder of its own"
        )


def _body(first: _Moving, recordings: dict[str, Poses]) -> tuple[Body, dict[str, Poses]]:
    """Return the body and its poses; those of the skeleton of cospeech are in its order and relative to its hips."""
    same = set(first.joints) == set(STANDARD.joints)
    if same:
        order = [first.joints.index(name) for name in STANDARD.joints]
        offsets = np.array([first.offsets[joint] for joint in order])
        same = bool(np.abs(offsets[1:] - STANDARD.offsets_m[1:]).max() < 1e-3)
    if not same:
        return Body(first.joints, np.array(first.parents), first.offsets), recordings
    hips = skeleton.OFFSET_M["hips"]
    return STANDARD, {
        name: Poses(poses.root_m - hips, np.ascontiguousarray(poses.rotations[:, order]))
        for name, poses in recordings.items()
    }


def _hands(
    body: Body, recordings: dict[str, Poses], fps: float, wanted: Sequence[str], folder: Path
) -> tuple[str, ...]:
    """Return the joints that gesture."""
    for name in wanted:
        if name not in body.joints:
            near = difflib.get_close_matches(name, body.joints, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(body.joints[:30])}"
            raise UserError(f"--hands: the motion in {folder} has no joint '{name}'; {hint}")
    ends = [joint for joint in range(1, len(body.joints)) if joint not in body.parents]
    candidates = [body.joints.index(name) for name in (wanted or (HUMAN_HANDS if body is STANDARD else ()))] or ends
    total, n_frames = np.zeros(len(candidates)), 0
    for poses in recordings.values():
        _, placed = body.world(poses.root_m, poses.rotations)
        moved = np.diff(placed[:, candidates] - placed[:, :1], axis=0)
        total += np.linalg.norm(moved, axis=2).sum(axis=0)
        n_frames += len(moved)
    speeds = total / max(n_frames, 1) * fps
    if len(speeds) == 0 or speeds.max() < LEAST_M_S:
        raise UserError(
            f"{folder}: no hand moves in any file; give motion, or name the joints that move with --hands"
        )
    if wanted or body is STANDARD:
        return tuple(body.joints[joint] for joint in candidates)
    fast = speeds >= LIVELY * speeds.max()
    return tuple(body.joints[joint] for joint, chosen in zip(candidates, fast, strict=True) if chosen)
