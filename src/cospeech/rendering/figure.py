"""Drawing of moving bodies: cameras that keep the whole record in view, materials, and the figure of each frame.

The cameras do not move. They are far enough away that the body stays inside its part of the image in all frames, even
if it turns and walks.
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

FOCAL_LENGTH = 3.4
"""Focal length in image heights: a long lens, as used for portraits."""

ELEVATION_DEG = 9.0
MARGIN = 0.015
"""Empty margin at each edge, in image heights."""

PORTRAIT_M, PORTRAIT_TARGET_M = 0.46, (0.0, 1.605, 0.0)
"""Height of a body that a portrait shows, and the point in its middle, in metres."""

VIEWS_DEG = (0.0, 62.0)
"""Directions from which a figure is viewed: angles from the front toward the left of the body."""

COLOURS = {
    "skin": (226, 190, 164),
    "hair": (74, 62, 60),
    "shirt": (214, 217, 222),
    "trousers": (96, 106, 124),
    "shoe": (62, 66, 76),
    "left_arm": picture.gesture_colour("left"),
    "right_arm": picture.gesture_colour("right"),
    "eye": (250, 250, 248),
    "pupil": (52, 44, 42),
    "lips": (186, 118, 108),
}
"""Colours of the materials in full light; the arms have the colours of the gesture classes left and right."""


@dataclass(frozen=True)
class Pose:
    """A moving body: orientations (T, J, 3, 3) and positions (T, J, 3) of its joints' frames, in metres."""

    orientation: Floats
    position: Floats

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Camera:
    """A fixed camera.

    Attributes
    ----------
    axes : (3, 3) with the rows right, up and toward the camera.
    target : (3,) the point that the camera looks at, in metres.
    distance : distance of the camera from its target in metres.
    focal : focal length in pixels.
    centre : image of the target, in pixels.
    box : left, top, right and bottom of the camera's part of the image, in pixels.
    """

    axes: Floats
    target: Floats
    distance: float
    focal: float
    centre: tuple[float, float]
    box: tuple[int, int, int, int]

    def shifted(self, right: int, down: int = 0) -> Camera:
        """Return this camera with its part of the image shifted by whole pixels."""
        left, top, end, bottom = self.box
        box = (left + right, top + down, end + right, bottom + down)
        return replace(self, centre=(self.centre[0] + right, self.centre[1] + down), box=box)

    def project(self, points_m: Floats) -> Floats:
        """Return the pixel coordinates (..., 2) of points (..., 3)."""
        local = (points_m - self.target) @ self.axes.T
        scale = self.focal / (self.distance - local[..., 2])
        return np.stack([self.centre[0] + scale * local[..., 0], self.centre[1] - scale * local[..., 1]], axis=-1)


def pose(motion: pd.DataFrame) -> Pose:
    """Return the orientations and positions of all joints in a motion table."""
    return Pose(*skeleton.chain(motion[list(skeleton.ROOT_COLUMNS)].to_numpy(dtype=float), skeleton.angles(motion)))


def cameras(points_m: Floats, box: tuple[int, int, int, int], views_deg: Sequence[float] = VIEWS_DEG) -> list[Camera]:
    """Return one camera per view, side by side in ``box`` and at the same distance, each with all points in view.

    Parameters
    ----------
    points_m : (n, 3) points that every camera must see.
    box : left, top, right and bottom in pixels; it is divided in proportion to the widths of the views.
    views_deg : directions of the cameras: angles from the front toward the left of the body.
    """
    tilt = np.radians(ELEVATION_DEG)
    left, top, right, bottom = box
    focal = FOCAL_LENGTH * (bottom - top)
    axes, projected = [], []
    for angle in np.radians(np.asarray(views_deg)):
        toward = np.array([np.sin(angle) * np.cos(tilt), np.sin(tilt), np.cos(angle) * np.cos(tilt)])
        across = np.array([np.cos(angle), 0.0, -np.sin(angle)])
        axes.append(np.stack([across, np.cross(toward, across), toward]))
        projected.append(points_m @ axes[-1].T)
    middle = [(points.min(axis=0) + points.max(axis=0)) / 2 for points in projected]
    widths = np.array([np.ptp(points[:, 0]) for points in projected])
    ends = np.round(left + (right - left) * np.append(0, np.cumsum(widths / widths.sum()))).astype(int)
    distance = 0.0
    for points, centre, start, end in zip(projected, middle, ends, ends[1:], strict=False):
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


def portrait(box: tuple[int, int, int, int]) -> Camera:
    """Return a camera in front of the head of a standing body, with its shoulders in view.

    Parameters
    ----------
    box : left, top, right and bottom of the camera's part of the image in pixels.
    """
    left, top, right, bottom = box
    height = bottom - top
    distance = FOCAL_LENGTH * PORTRAIT_M
    return Camera(
        np.eye(3),
        np.array(PORTRAIT_TARGET_M),
        distance,
        FOCAL_LENGTH * height,
        ((left + right) / 2, (top + bottom) / 2),
        box,
    )


def floor_height(bodies: Sequence[Pose]) -> float:
    """Return the height of the floor in metres: the lowest position of a sole in any frame."""
    soles = []
    for moving in bodies:
        for name in ("left_foot", "right_foot"):
            index = skeleton.JOINTS.index(name)
            for corner in ((0.0, -0.07, -0.04), (0.0, -0.07, 0.18)):
                soles.append(
                    (moving.position[:, index] + moving.orientation[:, index] @ np.array(corner))[:, 1].min()
                )
    return float(min(soles))


def colour_ramps() -> npt.NDArray[np.float32]:
    """Return 256 colours per material (256 * materials, 3), from bluish shade through full light to a highlight."""
    level = np.linspace(0, 1, 256)[:, None]
    ramps = []
    for material in body.MATERIALS:
        full = (np.array(COLOURS[material]) / 255) ** 2.2
        shade = full * np.array([0.16, 0.17, 0.24]) + 0.004
        bright = full + (1 - full) * 0.30
        lower = shade + (full - shade) * np.clip(level / 0.78, 0, 1)
        colour = lower + (bright - full) * np.clip((level - 0.78) / 0.22, 0, 1)
        ramps.append(np.round(255 * colour ** (1 / 2.2)))
    return np.concatenate(ramps).astype(np.float32)


class Painter:
    """The mesh and colours of the body. ``detail`` sets the resolution of the mesh: 1 for videos, 3 for stills."""

    def __init__(self, detail: int = 1) -> None:
        self.mesh = body.mesh(detail)
        self.hull = body.hull(self.mesh)
        self.colours = colour_ramps()
        self.rest = skeleton.chain(np.zeros((1, 3)), np.zeros((1, len(skeleton.JOINTS), 3)))[1][0]

    def extent(self, bodies: Sequence[Pose]) -> Floats:
        """Return points (n, 3) whose convex hull contains the bodies in all frames."""
        corners = [
            moving.position[:, :, None] + np.einsum("tjab,jcb->tjca", moving.orientation, self.hull)
            for moving in bodies
        ]
        return np.concatenate([points.reshape(-1, 3) for points in corners])

    def figure(self, moving: Pose, camera: Camera, floor_m: float) -> Figure:
        """Return the view of a moving body by one camera, with the floor at height ``floor_m`` in metres."""
        rotation = camera.axes @ moving.orientation
        shift = (moving.position - camera.target) @ camera.axes.T - np.einsum("tjab,jb->tja", rotation, self.rest)
        return Figure(
            self, camera, rotation.astype(np.float32), shift.astype(np.float32), shadows(moving, camera, floor_m)
        )


@dataclass(frozen=True)
class Figure:
    """A moving body seen by one camera: rotations (T, J, 3, 3) and shifts (T, J, 3) of the joints, and shadows."""

    painter: Painter
    camera: Camera
    rotation: npt.NDArray[np.float32]
    shift: npt.NDArray[np.float32]
    shadows: npt.NDArray[np.float32]

    def draw(self, image: Image, frame: int) -> None:
        """Draw the body of one frame and its shadow on the floor into ``image`` (H, W, 3), in place."""
        camera, painter = self.camera, self.painter
        box = np.array(camera.box, dtype=np.int64)
        lens = np.array([camera.distance, camera.focal, *camera.centre], dtype=np.float32)
        raster.shade_floor(image, box, self.shadows[frame])
        raster.draw_body(image, box, *painter.mesh, self.rotation[frame], self.shift[frame], lens, painter.colours)


SHADOWS = (
    ("hips", 0.55, 0.34),
    ("chest", 0.40, 0.14),
    ("left_foot", 0.17, 0.52),
    ("right_foot", 0.17, 0.52),
)
"""Joints that cast a shadow, with its size in metres and its strength."""


def shadows(moving: Pose, camera: Camera, floor_m: float) -> npt.NDArray[np.float32]:
    """Return the soft shadows vertically below the body (T, n, 5), in the format of ``raster.shade_floor``."""
    spots = []
    for name, size_m, strength in SHADOWS:
        index = skeleton.JOINTS.index(name)
        point = moving.position[:, index]
        if name.endswith("foot"):
            point = point + 0.4 * moving.orientation[:, index] @ np.array(skeleton.TIPS_M[name])
        height = np.maximum(point[:, 1] - floor_m, 0.0)
        on_floor = np.column_stack([point[:, 0], np.full(len(point), floor_m), point[:, 2]])
        width = (size_m + 0.1 * height) * camera.focal / camera.distance
        flat = width * max(float(camera.axes[2, 1]), 0.05)
        spots.append(np.column_stack([camera.project(on_floor), width, flat, strength / (1 + height)]))
    return np.stack(spots, axis=1).astype(np.float32)
