"""Drawing a body: a camera that sees all of a record, the body's colours, one figure after another.

The camera stands still. It is placed so far away that whatever the body does in any frame, turning and walking
included, stays inside its part of the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats, Image
from cospeech.motion import skeleton
from cospeech.rendering import body, picture, raster

LENS = 3.4
"""Focal length in heights of the picture: a long lens, as for portraits."""

ELEVATION_DEG = 9.0
MARGIN = 0.015
"""What stays free at each edge, in heights of the picture."""

VIEWS_DEG = (0.0, 62.0)
"""The two sides that a figure is seen from: turned from the front toward the body's left."""

COLOURS = {
    "skin": (226, 190, 164),
    "hair": (74, 62, 60),
    "shirt": (214, 217, 222),
    "trousers": (96, 106, 124),
    "shoe": (62, 66, 76),
    "left_arm": picture.gesture_colour("left"),
    "right_arm": picture.gesture_colour("right"),
}
"""The paints in full light; the arms stand out, in the colours of left and right gestures."""


@dataclass(frozen=True)
class Pose:
    """A moving body: orientation (T, J, 3, 3) and place (T, J, 3) of its joints' frames, metres."""

    turned: Floats
    placed: Floats

    def __len__(self) -> int:
        return len(self.placed)


@dataclass(frozen=True)
class Camera:
    """A still camera.

    ``axes`` (3, 3) has the rows right, up and toward the camera; ``target`` (3,) is what it looks at, ``distance``
    metres away; ``focal`` and ``centre`` are in pixels of the picture, ``box`` is left, top, right, bottom.
    """

    axes: Floats
    target: Floats
    distance: float
    focal: float
    centre: tuple[float, float]
    box: tuple[int, int, int, int]

    def moved(self, right: int, down: int = 0) -> Camera:
        """Return this camera with its part of the picture moved by whole pixels."""
        left, top, end, bottom = self.box
        box = (left + right, top + down, end + right, bottom + down)
        return replace(self, centre=(self.centre[0] + right, self.centre[1] + down), box=box)

    def project(self, points_m: Floats) -> Floats:
        """Return the pixels (..., 2) of points (..., 3)."""
        seen = (points_m - self.target) @ self.axes.T
        scale = self.focal / (self.distance - seen[..., 2])
        return np.stack([self.centre[0] + scale * seen[..., 0], self.centre[1] - scale * seen[..., 1]], axis=-1)


def pose(motion: pd.DataFrame) -> Pose:
    """Return the moving body of a motion table."""
    turned, placed = skeleton.chain(
        motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float), skeleton.angles(motion)
    )
    return Pose(turned, placed)


def cameras(points_m: Floats, box: tuple[int, int, int, int], views_deg: Sequence[float] = VIEWS_DEG) -> list[Camera]:
    """Return one camera a view, side by side in ``box`` and all at one distance, that have all points in view.

    Parameters
    ----------
    points_m : (n, 3) everything that is to be seen, by all cameras alike.
    box : left, top, right, bottom in the picture, pixels; each view gets the share that its width needs.
    views_deg : direction of each camera, turned from the front toward the body's left.
    """
    tilt = np.radians(ELEVATION_DEG)
    left, top, right, bottom = box
    focal = LENS * (bottom - top)
    axes, seen = [], []
    for angle in np.radians(np.asarray(views_deg)):
        toward = np.array([np.sin(angle) * np.cos(tilt), np.sin(tilt), np.cos(angle) * np.cos(tilt)])
        across = np.array([np.cos(angle), 0.0, -np.sin(angle)])
        axes.append(np.stack([across, np.cross(toward, across), toward]))
        seen.append(points_m @ axes[-1].T)
    middle = [(points.min(axis=0) + points.max(axis=0)) / 2 for points in seen]
    widths = np.array([np.ptp(points[:, 0]) for points in seen])
    ends = np.round(left + (right - left) * np.append(0, np.cumsum(widths / widths.sum()))).astype(int)
    distance = 0.0
    for points, centre, start, end in zip(seen, middle, ends, ends[1:], strict=False):
        room = np.array([end - start, bottom - top]) / 2 - MARGIN * (bottom - top)
        off = np.abs(points - centre)[:, :2]
        distance = max(distance, float((points[:, 2] - centre[2] + (focal * off / room).max(axis=1)).max()))
    return [
        Camera(
            turn,
            centre @ turn,
            distance,
            focal,
            ((start + end) / 2, (top + bottom) / 2),
            (int(start), top, int(end), bottom),
        )
        for turn, centre, start, end in zip(axes, middle, ends, ends[1:], strict=False)
    ]


def floor_height(bodies: Sequence[Pose]) -> float:
    """Return the height of the floor: the lowest that a sole comes to."""
    soles = []
    for moving in bodies:
        for name in ("left_foot", "right_foot"):
            index = skeleton.JOINTS.index(name)
            for corner in ((0.0, -0.07, -0.04), (0.0, -0.07, 0.18)):
                soles.append((moving.placed[:, index] + moving.turned[:, index] @ np.array(corner))[:, 1].min())
    return float(min(soles))


def tones() -> npt.NDArray[np.float32]:
    """Return 256 colours of every paint (256 * paints, 3), from deep bluish shade over full light to a highlight."""
    level = np.linspace(0, 1, 256)[:, None]
    made = []
    for paint in body.PAINTS:
        full = (np.array(COLOURS[paint]) / 255) ** 2.2
        shade = full * np.array([0.16, 0.17, 0.24]) + 0.004
        bright = full + (1 - full) * 0.30
        lower = shade + (full - shade) * np.clip(level / 0.78, 0, 1)
        colour = lower + (bright - full) * np.clip((level - 0.78) / 0.22, 0, 1)
        made.append(np.round(255 * colour ** (1 / 2.2)))
    return np.concatenate(made).astype(np.float32)


class Painter:
    """The body's surface and colours. ``detail`` is the fineness of the surface: 1 for video, 3 for stills."""

    def __init__(self, detail: int = 1) -> None:
        self.mesh = body.mesh(detail)
        self.hull = body.hull(self.mesh)
        self.tones = tones()
        self.rest = skeleton.chain(np.zeros((1, 3)), np.zeros((1, len(skeleton.JOINTS), 3)))[1][0]

    def extent(self, bodies: Sequence[Pose]) -> Floats:
        """Return points (n, 3) whose convex hull holds the bodies in all their frames."""
        corners = [
            moving.placed[:, :, None] + np.einsum("tjab,jcb->tjca", moving.turned, self.hull) for moving in bodies
        ]
        return np.concatenate([found.reshape(-1, 3) for found in corners])

    def figure(self, moving: Pose, camera: Camera, floor_m: float) -> Figure:
        """Return a moving body as one camera sees it, standing on a floor at height ``floor_m``."""
        turn = camera.axes @ moving.turned
        shift = (moving.placed - camera.target) @ camera.axes.T - np.einsum("tjab,jb->tja", turn, self.rest)
        return Figure(
            self, camera, turn.astype(np.float32), shift.astype(np.float32), shadows(moving, camera, floor_m)
        )


@dataclass(frozen=True)
class Figure:
    """A moving body seen by one camera: each joint's turn (T, J, 3, 3) and shift (T, J, 3), and the shadows."""

    painter: Painter
    camera: Camera
    turn: npt.NDArray[np.float32]
    shift: npt.NDArray[np.float32]
    spots: npt.NDArray[np.float32]

    def draw(self, image: Image, frame: int) -> None:
        """Draw the body of one frame, with its shadow on the floor, into ``image`` (H, W, 3), in place."""
        camera, painter = self.camera, self.painter
        box = np.array(camera.box, dtype=np.int64)
        lens = np.array([camera.distance, camera.focal, *camera.centre], dtype=np.float32)
        raster.shade_floor(image, box, self.spots[frame])
        raster.draw_body(image, box, *painter.mesh, self.turn[frame], self.shift[frame], lens, painter.tones)


SHADOWS = (
    ("hips", 0.55, 0.34),
    ("chest", 0.40, 0.14),
    ("left_foot", 0.17, 0.52),
    ("right_foot", 0.17, 0.52),
)
"""What throws a shadow: joint, size in metres, strength."""


def shadows(moving: Pose, camera: Camera, floor_m: float) -> npt.NDArray[np.float32]:
    """Return the soft shadows straight below the body (T, n, 5), each as ``raster.shade_floor`` takes it."""
    spots = []
    for name, size_m, strength in SHADOWS:
        index = skeleton.JOINTS.index(name)
        point = moving.placed[:, index]
        if name.endswith("foot"):
            point = point + 0.4 * moving.turned[:, index] @ np.array(skeleton.TIPS_M[name])
        height = np.maximum(point[:, 1] - floor_m, 0.0)
        on_floor = np.column_stack([point[:, 0], np.full(len(point), floor_m), point[:, 2]])
        width = (size_m + 0.1 * height) * camera.focal / camera.distance
        flat = width * max(float(camera.axes[2, 1]), 0.05)
        spots.append(np.column_stack([camera.project(on_floor), width, flat, strength / (1 + height)]))
    return np.stack(spots, axis=1).astype(np.float32)
