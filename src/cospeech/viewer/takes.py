"""What the viewer shows, packed for its page.

A *take* is what happens in one stretch of time: one sound, curves of the voice, and any number of bodies that move to
it. Numbers that vary over time are packed as compressed integers, so that a minute of motion takes about 60 kB.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.glb_mesh import Mesh
from cospeech.motion.body import Body
from cospeech.motion.library import Poses

TURN = 32767
"""Quaternions are rounded to this fraction of 1, which turns a body part by at most 0.004 degrees."""

LENGTH_M = 1e-4
"""Positions of the root are rounded to this length."""

LOST = -(2**31)
"""Stands for the coordinates of a lost marker."""

LARGEST_M = 1e5
"""Positions beyond this distance from the origin cannot be shown."""

CURVE_LEVELS = 1000
"""Curves are rounded to this fraction of their range."""


@dataclass(frozen=True)
class Articulated:
    """The motion of a body of rigid bones: its poses in T frames."""

    body: Body
    poses: Poses

    @property
    def n_frames(self) -> int:
        """The number T of frames."""
        return len(self.poses.root_m)


@dataclass(frozen=True)
class Free:
    """The motion of joints that may move away from one another, or of markers, in T frames.

    Attributes
    ----------
    joints : (J,) names.
    parents : (J,) index of the joint to which a bone is drawn, -1 for none; parents come first.
    places_m : (T, J, 3) positions in the world in metres; NaN where a marker is lost.
    turns : (T, J, 4) orientations in the world, quaternions w, x, y, z; None if they are not known.
    """

    joints: tuple[str, ...]
    parents: tuple[int, ...]
    places_m: Floats
    turns: Floats | None = None

    @property
    def n_frames(self) -> int:
        """The number T of frames."""
        return len(self.places_m)


@dataclass(frozen=True)
class Version:
    """One body that moves.

    Attributes
    ----------
    title : name that the viewer shows.
    motion, fps : its motion, and the frame rate.
    phrases : its gesture phrases, with the columns start_s, end_s and label; None if they are not known.
    skinned : whether the body is drawn with the surface of the standard body.
    mesh : a surface of its own, or None; a body without any surface is drawn as bones.
    shown : whether it is visible at the start.
    head : title of the system that moves its head, if that is another one than moves the body.
    """

    title: str
    motion: Articulated | Free
    fps: float
    phrases: pd.DataFrame | None = None
    skinned: bool = False
    mesh: Mesh | None = None
    shown: bool = True
    head: str | None = None


@dataclass(frozen=True)
class Take:
    """What happens in one stretch of time.

    Attributes
    ----------
    title : name that the viewer shows.
    versions : the bodies.
    sound : an MP4 file with the sound, or None.
    sound_s : duration of the sound in seconds.
    curves : values at equal distances in time, by title, such as the pitch in Hz; NaN where there is none.
    curve_s : distance of the values of the curves in seconds.
    """

    title: str
    versions: Sequence[Version]
    sound: bytes | None = None
    sound_s: float = 0.0
    curves: Mapping[str, Floats] = field(default_factory=dict)
    curve_s: float = 0.025


def packed(take: Take, meshes: Sequence[Mesh] = ()) -> dict[str, Any]:
    """Return a take as the viewer reads it: numbers, words, and base64.

    Parameters
    ----------
    meshes : surfaces that the page has in addition to that of the standard body (see ``page.stage``).

    Raises
    ------
    UserError : if a version has no frame, or is farther than 100 km from the origin.
    """
    empty = next((version for version in take.versions if version.motion.n_frames == 0), None)
    if empty is not None:
        raise UserError(f"{take.title}: {empty.title}: contains no frame; name a file with motion")
    longest_s = max(version.motion.n_frames / version.fps for version in take.versions)
    return {
        "title": take.title,
        "duration": max(longest_s, take.sound_s),
        "sound": base64.b64encode(take.sound).decode() if take.sound else None,
        "curves": [{"title": title, **_curve(values)} for title, values in take.curves.items()],
        "curveStep": take.curve_s,
        "versions": [_version(version, take.title, meshes) for version in take.versions],
    }


def _version(version: Version, where: str, meshes: Sequence[Mesh]) -> dict[str, Any]:
    motion = version.motion
    moved = motion.poses.root_m if isinstance(motion, Articulated) else motion.places_m
    if not np.nanmax(np.abs(moved), initial=0.0) < LARGEST_M:
        raise UserError(f"{where}: {version.title}: is farther than 100 km from the origin; check its unit of length")
    return {
        "title": version.title,
        "fps": version.fps,
        "frames": motion.n_frames,
        "phrases": _phrases(version.phrases),
        "surface": _surface(version, meshes),
        "shown": version.shown,
        "head": version.head,
        **(_articulated(motion) if isinstance(motion, Articulated) else _free(motion)),
    }


def _surface(version: Version, meshes: Sequence[Mesh]) -> int | None:
    """Return the number of a version's surface on the page: 0 is that of the standard body, others are ``meshes``."""
    if version.mesh is not None:
        return 1 + next(number for number, mesh in enumerate(meshes) if mesh is version.mesh)
    return 0 if version.skinned else None


def _articulated(motion: Articulated) -> dict[str, Any]:
    return {
        "joints": list(motion.body.joints),
        "parents": motion.body.parents.tolist(),
        "offsets": np.round(motion.body.offsets_m, 6).ravel().tolist(),
        "root": _integers(_lengths(motion.poses.root_m), np.int32),
        "turns": _integers(_turns(motion.poses.rotations), np.int16),
    }


def _free(motion: Free) -> dict[str, Any]:
    still = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (motion.n_frames, len(motion.joints), 4))
    return {
        "joints": list(motion.joints),
        "parents": list(motion.parents),
        "places": _integers(_lengths(motion.places_m.reshape(motion.n_frames, -1)), np.int32),
        "turns": _integers(_turns(still if motion.turns is None else motion.turns), np.int16),
    }


def _lengths(metres: Floats) -> Floats:
    return np.where(np.isnan(metres), LOST, np.round(metres / LENGTH_M))


def _turns(rotations: Floats) -> Floats:
    """Return quaternions (T, J, 4) as whole numbers (T, 4 J)."""
    return np.round(_continuous(rotations).reshape(len(rotations), -1) * TURN)


def _phrases(phrases: pd.DataFrame | None) -> list[list[Any]] | None:
    if phrases is None:
        return None
    columns = (phrases[name].tolist() for name in ("start_s", "end_s", "label"))
    return [[round(start, 4), round(end, 4), label] for start, end, label in zip(*columns, strict=True)]


def _continuous(rotations: Floats) -> Floats:
    """Return quaternions (T, J, 4) with signs that do not change from frame to frame: differences stay small."""
    flipped = np.sum(rotations[1:] * rotations[:-1], axis=-1) < 0
    signs = np.where(np.cumsum(flipped, axis=0) % 2, -1.0, 1.0)
    return np.concatenate([rotations[:1], rotations[1:] * signs[..., None]])


def _integers(values: Floats, kind: type[np.signedinteger[Any]]) -> str:
    """Return numbers (T, n) as base64: differences along time of each column, as compressed integers."""
    whole = values.astype(kind)
    steps = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))  # wraps around, as does the sum of the viewer
    return base64.b64encode(zlib.compress(steps.T.astype(f"<i{steps.itemsize}").tobytes(), 9)).decode()


def _curve(values: Floats) -> dict[str, Any]:
    """Return a curve: its range, and its values as integers within it, -1 where there is none."""
    known = np.isfinite(values)
    if not known.any():
        return {"low": 0.0, "high": 1.0, "values": [-1] * len(values)}
    low, high = float(values[known].min()), float(values[known].max())
    scaled = (np.where(known, values, low) - low) / max(high - low, 1e-12) * CURVE_LEVELS
    levels = np.where(known, np.round(scaled), -1)
    return {"low": round(low, 3), "high": round(high, 3), "values": levels.astype(int).tolist()}
