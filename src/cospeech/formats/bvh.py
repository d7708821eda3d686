"""BVH files, the motion format that animation programs have in common.

We write metres, y up, and the rotation order of our skeleton. The offset of the root is zero and its channels hold
the position of the hips, so that programs that add the offset to the channels agree with those that do not. We read
any hierarchy with one root and any order of channels. The format does not state unit and up axis: the user declares
them. Where a file contradicts itself and its meaning is clear nevertheless, we read it and say so in the notes.
"""

from __future__ import annotations

import io
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.data import frame_rates, tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import foreign
from cospeech.geometry import rotation
from cospeech.motion import skeleton

LARGEST = 1e9
"""Largest absolute value of an offset or a channel; larger ones are errors of the file."""

STILL = 0.05
"""Largest range of a joint's position channels, relative to its bone, at which they count as constant."""

CHUNK = 1024
"""Frames that are converted to numbers at once, to save memory."""


@dataclass(frozen=True)
class Clip:
    """Motion of any skeleton, in its own unit and axes.

    Attributes
    ----------
    names : (J,) joints, parents first.
    parents : (J,) index of the parent of each joint, -1 for the root.
    rotations : (T, J, 3, 3) rotation of each joint in the frame of its parent.
    places : by index of a joint, its positions (T, 3) in the frame of its parent; the root and all joints that move.
    fps : frames per second.
    offsets : (J, 3) position of each joint in the frame of its parent at zero angles, or None if unknown.
    tips : by index of a joint, the end (3,) of a bone that has no further joint.
    notes : how the file was interpreted where it contradicts itself.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    rotations: Floats
    places: dict[int, Floats]
    fps: float
    offsets: Floats | None = None
    tips: dict[int, Floats] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def write(motion: pd.DataFrame, path: str | Path, fps: float | None = None) -> None:
    """Write a motion table as BVH: the joints and offsets of ``skeleton.BODY``, metres, y up, order XZY.

    ``fps`` is the frame rate; by default it is read from the motion, which must then have a frame.
    """
    fps = skeleton.frame_rate(motion) if fps is None else fps
    hips = motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float) + skeleton.OFFSET_M["hips"]
    names = skeleton.JOINTS
    parents = [-1 if joint.parent is None else names.index(joint.parent) for joint in skeleton.BODY]
    offsets = np.array([joint.offset_m for joint in skeleton.BODY])
    offsets[0] = 0.0
    tips = {names.index(name): np.array(tip) for name, tip in skeleton.TIPS_M.items()}
    order = _depth_first(parents)
    turns = skeleton.angles(motion)[:, order][:, :, [0, 2, 1]]  # the order of the channels: X, Z, Y
    _write(path, _hierarchy(names, parents, offsets, tips), hips, turns, fps)


def write_clip(clip: Clip, path: str | Path) -> None:
    """Write motion of any skeleton as BVH, in the unit and axes of the clip, with the rotation order XZY.

    Joints other than the root must be at their offsets.
    """
    if clip.offsets is None or set(clip.places) != {0}:
        raise ValueError("a clip without offsets, or with joints that move away from them, has no BVH hierarchy")
    offsets = clip.offsets.copy()
    offsets[0] = 0.0
    turns = rotation.to_euler(skeleton.EULER_ORDER, clip.rotations[:, _depth_first(clip.parents)])
    turns = np.unwrap(turns, axis=0, period=360.0)
    _write(path, _hierarchy(clip.names, clip.parents, offsets, clip.tips), clip.places[0], turns, clip.fps)


def _write(path: str | Path, hierarchy: list[str], root: Floats, turns: Floats, fps: float) -> None:
    """Write a BVH file of root positions (T, 3) and the angles (T, J, 3) of joints in the order of the hierarchy."""
    values = np.column_stack([root, turns.reshape(len(turns), 3 * turns.shape[1])])
    values = np.round(values, 6) + 0.0  # no "-0.000000"
    with tables.replacing(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(["HIERARCHY", *hierarchy, "MOTION", f"Frames: {len(values)}"]))
        file.write(f"\nFrame Time: {1 / fps:.10f}\n")
        np.savetxt(file, values, fmt="%.6f", newline="\n")


def _depth_first(parents: Sequence[int], joint: int = 0) -> list[int]:
    """Return a joint and its descendants in the order of a BVH hierarchy."""
    children = [child for child, parent in enumerate(parents) if parent == joint]
    return [joint, *itertools.chain.from_iterable(_depth_first(parents, child) for child in children)]


def _hierarchy(
    names: Sequence[str],
    parents: Sequence[int],
    offsets: Floats,
    tips: Mapping[int, Floats],
    joint: int = 0,
    depth: int = 0,
) -> list[str]:
    """Return the lines of a joint and its descendants."""
    pad, inner = "  " * depth, "  " * (depth + 1)
    is_root = parents[joint] < 0
    turns = " ".join(f"{axis}rotation" for axis in skeleton.EULER_ORDER)
    channels = f"6 Xposition Yposition Zposition {turns}" if is_root else f"3 {turns}"
    lines = [f"{pad}{'ROOT' if is_root else 'JOINT'} {names[joint]}", f"{pad}{{"]
    lines += [f"{inner}{_offset(offsets[joint])}", f"{inner}CHANNELS {channels}"]
    for child, parent in enumerate(parents):
        if parent == joint:
            lines += _hierarchy(names, parents, offsets, tips, child, depth + 1)
    if joint in tips:
        lines += [f"{inner}End Site", f"{inner}{{", f"{inner}  {_offset(tips[joint])}", f"{inner}}}"]
    return [*lines, f"{pad}}}"]


def _offset(offset: Floats) -> str:
    return "OFFSET " + " ".join(f"{value:.6f}" for value in offset)


def read(path: str | Path) -> Clip:
    """Read a BVH file.

    The rotation order of each joint is that of its CHANNELS line. Joints without position channels are at their
    offsets. A joint whose offset is zero and whose position channels are constant has these as its offset.

    Raises
    ------
    UserError : if the file is missing, empty, truncated, malformed or too large; with the line number if it is known.
    """
    content = foreign.read_bytes(path)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        content = foreign.decode(content, path).encode()
    if not content.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"HIERARCHY"):
        raise UserError(f"{path}: is not a BVH file (it does not begin with HIERARCHY); name a BVH file")
    if b"\n" not in content:
        content = content.replace(b"\r", b"\n")
    file = io.BytesIO(content)
    tree = _Tree(str(path))
    hierarchy: list[bytes] = []
    for line in file:
        if line.split() == [b"MOTION"]:
            break
        hierarchy.append(line)
    else:
        raise UserError(f"{path}: has no MOTION section; the file is truncated: copy or export it again")
    for number, text in enumerate(foreign.decode(b"".join(hierarchy), path).split("\n"), start=1):
        tree.take(text, number)
    tree.close()
    values, fps, notes = _motion(file, len(tree.names), len(tree.channels), str(path))
    return _clip(tree, values, fps, notes)


class _Tree:
    """The hierarchy as its lines are read: joints, offsets, and the joint of each channel."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: dict[int, Floats] = {}
        self.tips: dict[int, Floats] = {}
        self.channels: list[tuple[int, str]] = []
        self.with_channels: set[int] = set()
        self.open: list[int] = []
        self.announced: int | None = None
        self.in_tip = False

    def take(self, line: str, number: int) -> None:
        """Process one line."""
        words = line.split()
        if len(words) > 1 and words[-1] == "{" and words[0] in ("ROOT", "JOINT", "End"):
            self.take(" ".join(words[:-1]), number)
            words = ["{"]
        place = f"{self.where}: line {number}"
        match words:
            case [] | ["HIERARCHY"]:
                return
            case ["ROOT" | "JOINT" as kind, _, *_]:
                if (kind == "ROOT") != (not self.names) or (kind == "JOINT" and not self.open):
                    raise UserError(f"{place}: {kind} is out of place; a skeleton has one ROOT")
                self.announced = len(self.names)
                self.names.append(foreign.normalised(" ".join(words[1:])))
                foreign.check_joint_frames(len(self.names), 0, self.where)
                self.parents.append(self.open[-1] if self.open else -1)
            case ["End", *_] if self.open:
                self.in_tip = True
            case ["{"]:
                if not self.in_tip:
                    if self.announced is None:
                        raise UserError(f"{place}: a brace opens without a joint; export the file again")
                    self.open.append(self.announced)
                    self.announced = None
            case ["}"]:
                if self.in_tip:
                    self.in_tip = False
                elif self.open:
                    self.open.pop()
                else:
                    raise UserError(f"{place}: a closing brace has no opening one; export the file again")
            case ["OFFSET", *numbers] if self.open:
                (self.tips if self.in_tip else self.offsets)[self.open[-1]] = _triple(numbers, place)
            case ["CHANNELS", count, *channels] if self.open and not self.in_tip:
                self._declare(count, channels, place)
            case _:
                raise UserError(f"{place}: '{' '.join(words)[:40]}' does not belong here; export it again")

    def _declare(self, count: str, channels: list[str], place: str) -> None:
        if count != str(len(channels)):
            raise UserError(
                f"{place}: CHANNELS announces {count[:20]} and names {len(channels)}; export the file again"
            )
        if self.open[-1] in self.with_channels:
            raise UserError(f"{place}: a second CHANNELS of '{self.names[self.open[-1]]}'; export the file again")
        known = {f"{axis}{kind}" for axis in "xyz" for kind in ("position", "rotation")}
        lower = [channel.lower() for channel in channels]
        if not set(lower) <= known or len(set(lower)) < len(lower):
            raise UserError(f"{place}: '{' '.join(channels)[:60]}' are not BVH channels; export the file again")
        self.with_channels.add(self.open[-1])
        self.channels += [(self.open[-1], channel) for channel in lower]

    def close(self) -> None:
        """Check that the hierarchy is complete."""
        if self.open or self.in_tip or not self.names or len(self.offsets) < len(self.names):
            raise UserError(f"{self.where}: the hierarchy is truncated; copy or export the file again")


def _triple(numbers: list[str], place: str) -> Floats:
    try:
        values = np.array(numbers, dtype=float)
    except ValueError:
        values = np.empty(0)
    if values.shape != (3,) or not (np.abs(values) < LARGEST).all():
        raise UserError(f"{place}: OFFSET needs three numbers; export the file again")
    return values


def _motion(file: io.BytesIO, n_joints: int, n_channels: int, where: str) -> tuple[Floats, float, list[str]]:
    """Return the channel values (T, C), the frame rate and notes of the lines after MOTION."""
    filled = (line for line in file if line.strip())
    frames_line, time_line = (next(filled, b"").decode(errors="replace").split(":") for _ in range(2))
    n_frames = frames_line[1].strip() if frames_line[0].strip().lower() == "frames" and len(frames_line) == 2 else ""
    n_frames = n_frames.removesuffix(".0")
    if not n_frames.isdecimal() or time_line[0].lower().split() != ["frame", "time"] or len(time_line) != 2:
        raise UserError(f"{where}: no 'Frames:' and 'Frame Time:' after MOTION; export it again")
    fps, notes = frame_rates.from_frame_time(time_line[1], where)
    announced = int(n_frames[:18])
    chunks: list[Floats] = []
    rows: list[list[bytes]] = []
    count = 0
    for line in filled:
        row = line.split()
        if len(row) != n_channels:
            if count == announced > 0:
                text = line.decode(errors="replace").strip()[:40]
                raise UserError(f"{where}: '{text}' follows the last frame; remove what is not part of the motion")
            hint = "export the file again" if file.read().strip() else "the file is truncated: copy it again"
            raise UserError(f"{where}: frame {count} has {len(row)} of {n_channels} values; {hint}")
        count += 1
        rows.append(row)
        if len(rows) == CHUNK:
            foreign.check_joint_frames(n_joints, count, where)
            chunks.append(_numbers(rows, n_channels, count - len(rows), where))
            rows = []
    if count < announced or count == 0:
        raise UserError(
            f"{where}: announces {announced} frames and holds {count}: empty or truncated; copy or export it again"
        )
    if count > announced + 1:
        raise UserError(f"{where}: announces {announced} frames and holds more, {count}; correct 'Frames:'")
    if count > announced:
        notes = [*notes, f"the file holds one frame more than the {announced} that it announces; all were read"]
    foreign.check_joint_frames(n_joints, count, where)
    return np.concatenate([*chunks, _numbers(rows, n_channels, count - len(rows), where)]), fps, notes


def _numbers(rows: list[list[bytes]], n_channels: int, first: int, where: str) -> Floats:
    """Return the values (T, C) of consecutive frames from ``first`` on."""
    words = itertools.chain.from_iterable(rows)
    try:
        return np.fromiter(map(float, words), float, len(rows) * n_channels).reshape(len(rows), n_channels)
    except ValueError:
        for frame, row in enumerate(rows, start=first):
            for word in row:
                try:
                    float(word)
                except ValueError:
                    text = word.decode(errors="replace")[:20]
                    hint = "write decimal points" if "," in text else "correct it, or export the file again"
                    raise UserError(f"{where}: frame {frame}: '{text}' is not a number; {hint}") from None
        raise


def _clip(tree: _Tree, values: Floats, fps: float, notes: list[str]) -> Clip:
    missing = np.argwhere(~np.isfinite(values))
    if len(missing):
        frame, column = missing[0]
        joint = tree.names[tree.channels[column][0]]
        raise UserError(f"{tree.where}: joint '{joint}' is missing (NaN) in frame {frame}; fill or cut the gap")
    if np.abs(values).max(initial=0.0) > LARGEST:
        frame, column = np.argwhere(np.abs(values) > LARGEST)[0]
        joint = tree.names[tree.channels[column][0]]
        raise UserError(
            f"{tree.where}: joint '{joint}' has the value {values[frame, column]:g} in frame {frame}; correct it"
        )
    offsets = np.array([tree.offsets[joint] for joint in range(len(tree.names))])
    rotations = np.broadcast_to(np.eye(3), (len(values), len(tree.names), 3, 3)).copy()
    places = {0: np.tile(offsets[0], (len(values), 1))}
    turns: dict[int, list[int]] = {}
    for column, (joint, channel) in enumerate(tree.channels):
        if channel.endswith("rotation"):
            turns.setdefault(joint, []).append(column)
        else:
            place = places.setdefault(joint, np.tile(offsets[joint], (len(values), 1)))
            place[:, "xyz".index(channel[0])] = values[:, column]
    for joint, columns in turns.items():
        order = "".join(tree.channels[column][1][0].upper() for column in columns)
        rotations[:, joint] = rotation.from_euler(order, values[:, columns])
    unused = [joint for joint, place in places.items() if joint > 0 and offsets[joint].any() and not place.any()]
    for joint in unused:
        del places[joint]  # a bone without length: the channels are relative to the offset
    if unused:
        notes = [*notes, f"position channels of {len(unused)} joints are zero; their offsets were used"]
    offsets, read = _offsets_from_channels(offsets, places, tree.where)
    if read:
        notes = [*notes, f"offsets of {read} joints, zero in the file, read from their position channels"]
    return Clip(tuple(tree.names), tuple(tree.parents), rotations, places, fps, offsets, tree.tips, tuple(notes))


def _offsets_from_channels(offsets: Floats, places: dict[int, Floats], where: str) -> tuple[Floats, int]:
    """Return the offsets with those that are zero replaced by constant position channels, and how many were."""
    offsets, read = offsets.copy(), 0
    for joint, place in places.items():
        middle = (place.min(axis=0) + place.max(axis=0)) / 2
        moves = np.linalg.norm(np.ptp(place, axis=0)) > STILL * np.linalg.norm(middle)
        if joint > 0 and not offsets[joint].any() and middle.any() and not moves:
            offsets[joint], read = middle, read + 1
    if len(offsets) > 1 and not offsets[1:].any():
        raise UserError(
            f"{where}: the offsets of all joints are zero, so the bones have no lengths; export it with its rest pose"
        )
    return offsets, read
