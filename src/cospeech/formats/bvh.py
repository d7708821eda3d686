"""BVH files, the motion format that animation programs have in common.

We write metres, y up, and the rotation order of our skeleton. The offset of the root is zero and its channels hold
the position of the hips, so that programs that add the offset to the channels agree with those that do not. We read
any hierarchy with one root and any order of channels. The format does not state unit and up axis: the user declares
them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.data import tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry import rotation
from cospeech.motion import skeleton

SNAP = 1e-4
"""A frame time within this relative distance of 1/N is a rounded 1/N, such as the common 0.033333."""


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
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    rotations: Floats
    places: dict[int, Floats]
    fps: float
    offsets: Floats | None = None
    tips: dict[int, Floats] = field(default_factory=dict)


def write(motion: pd.DataFrame, path: str | Path, fps: float | None = None) -> None:
    """Write a motion table as BVH: the joints and offsets of ``skeleton.BODY``, metres, y up, order XZY.

    ``fps`` is the frame rate; by default it is read from the motion, which must then have a frame.
    """
    fps = skeleton.frame_rate(motion) if fps is None else fps
    hips = motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float) + skeleton.OFFSET_M["hips"]
    order: list[str] = []
    hierarchy = _block("hips", 0, order)
    joints = [skeleton.JOINTS.index(name) for name in order]
    turns = skeleton.angles(motion)[:, joints][:, :, [0, 2, 1]]  # the order of the channels: X, Z, Y
    values = np.column_stack([hips, turns.reshape(len(motion), 3 * len(order))])
    values = np.round(values, 6) + 0.0  # no "-0.000000"
    with tables.replacing(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(["HIERARCHY", *hierarchy, "MOTION", f"Frames: {len(values)}"]))
        file.write(f"\nFrame Time: {1 / fps:.10f}\n")
        np.savetxt(file, values, fmt="%.6f", newline="\n")


def _block(name: str, depth: int, order: list[str]) -> list[str]:
    """Return the lines of joint ``name`` and its descendants; append the joints to ``order`` as in the file."""
    order.append(name)
    pad, inner = "  " * depth, "  " * (depth + 1)
    is_root = skeleton.PARENT[name] is None
    offset = np.zeros(3) if is_root else skeleton.OFFSET_M[name]
    turns = " ".join(f"{axis}rotation" for axis in skeleton.EULER_ORDER)
    channels = f"6 Xposition Yposition Zposition {turns}" if is_root else f"3 {turns}"
    lines = [f"{pad}{'ROOT' if is_root else 'JOINT'} {name}", f"{pad}{{", f"{inner}{_offset(offset)}"]
    lines.append(f"{inner}CHANNELS {channels}")
    for child in skeleton.BODY:
        if child.parent == name:
            lines += _block(child.name, depth + 1, order)
    if name in skeleton.TIPS_M:
        tip = _offset(np.array(skeleton.TIPS_M[name]))
        lines += [f"{inner}End Site", f"{inner}{{", f"{inner}  {tip}", f"{inner}}}"]
    return [*lines, f"{pad}}}"]


def _offset(offset: Floats) -> str:
    return "OFFSET " + " ".join(f"{value:.6f}" for value in offset)


def read(path: str | Path) -> Clip:
    """Read a BVH file.

    The rotation order of each joint is that of its CHANNELS line. Joints without position channels are at their
    offsets.

    Raises
    ------
    UserError : if the file is missing, empty, truncated or malformed; with the line number if it is known.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    lines = text.splitlines()
    if not text.strip() or text.split(maxsplit=1)[0] != "HIERARCHY":
        raise UserError(f"{path}: is not a BVH file (it does not begin with HIERARCHY); name a BVH file")
    part = next((number for number, line in enumerate(lines) if line.split() == ["MOTION"]), None)
    if part is None:
        raise UserError(f"{path}: has no MOTION section; the file is truncated: copy or export it again")
    tree = _Tree(str(path))
    for number, line in enumerate(lines[:part], start=1):
        tree.take(line, number)
    tree.close()
    values, fps = _motion(lines[part + 1 :], len(tree.channels), str(path))
    return _clip(tree, values, fps)


class _Tree:
    """The hierarchy as its lines are read: joints, offsets, and the joint of each channel."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: dict[int, Floats] = {}
        self.tips: dict[int, Floats] = {}
        self.channels: list[tuple[int, str]] = []
        self.open: list[int] = []
        self.announced: int | None = None
        self.in_tip = False

    def take(self, line: str, number: int) -> None:
        """Process one line."""
        words = line.split()
        place = f"{self.where}: line {number}"
        match words:
            case [] | ["HIERARCHY"]:
                return
            case ["ROOT" | "JOINT" as kind, _, *_]:
                if (kind == "ROOT") != (not self.names) or (kind == "JOINT" and not self.open):
                    raise UserError(f"{place}: {kind} is out of place; a skeleton has one ROOT")
                name = " ".join(words[1:])
                if name in self.names:
                    raise UserError(f"{place}: a second joint is called '{name}'; give each joint its own name")
                self.announced = len(self.names)
                self.names.append(name)
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
        if any(joint == self.open[-1] for joint, _ in self.channels):
            raise UserError(f"{place}: a second CHANNELS of '{self.names[self.open[-1]]}'; export the file again")
        known = {f"{axis}{kind}" for axis in "xyz" for kind in ("position", "rotation")}
        lower = [channel.lower() for channel in channels]
        if not set(lower) <= known or len(set(lower)) < len(lower):
            raise UserError(f"{place}: '{' '.join(channels)[:60]}' are not BVH channels; export the file again")
        self.channels += [(self.open[-1], channel) for channel in lower]

    def close(self) -> None:
        """Check that the hierarchy is complete."""
        if self.open or not self.names or len(self.offsets) < len(self.names):
            raise UserError(f"{self.where}: the hierarchy is truncated; copy or export the file again")


def _triple(numbers: list[str], place: str) -> Floats:
    try:
        values = np.array(numbers, dtype=float)
    except ValueError:
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise UserError(f"{place}: OFFSET needs three numbers; export the file again")
    return values


def _motion(lines: list[str], n_channels: int, where: str) -> tuple[Floats, float]:
    """Return the channel values (T, C) and the frame rate of the lines after MOTION."""
    filled = [line for line in lines if line.strip()]
    try:
        frames_line, time_line = filled[0].split(":"), filled[1].split(":")
        if frames_line[0].strip() != "Frames" or time_line[0].split() != ["Frame", "Time"]:
            raise ValueError
        n_frames, frame_s = int(frames_line[1]), float(time_line[1])
    except (IndexError, ValueError):
        raise UserError(f"{where}: no 'Frames:' and 'Frame Time:' after MOTION; export it again") from None
    if not 0.001 <= frame_s <= 1.0:
        raise UserError(f"{where}: a frame time of {frame_s} s; BVH needs seconds per frame, such as 0.05")
    rows = [line.split() for line in filled[2:]]
    if len(rows) != n_frames or n_frames == 0:
        raise UserError(
            f"{where}: announces {n_frames} frames and holds {len(rows)}: empty or truncated; copy it again"
        )
    for frame, row in enumerate(rows):
        if len(row) != n_channels:
            raise UserError(f"{where}: frame {frame} has {len(row)} of {n_channels} values; copy the file again")
    try:
        values = np.array(rows, dtype=float)
    except ValueError as error:
        raise UserError(f"{where}: the motion has values that are not numbers ({str(error)[:60]})") from None
    rate = round(1 / frame_s)
    return values, float(rate) if abs(rate * frame_s - 1) < SNAP else 1 / frame_s


def _clip(tree: _Tree, values: Floats, fps: float) -> Clip:
    missing = np.argwhere(~np.isfinite(values))
    if len(missing):
        frame, column = missing[0]
        joint = tree.names[tree.channels[column][0]]
        raise UserError(f"{tree.where}: joint '{joint}' is missing (NaN) in frame {frame}; fill or cut the gap")
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
    return Clip(tuple(tree.names), tuple(tree.parents), rotations, places, fps, offsets, tree.tips)
