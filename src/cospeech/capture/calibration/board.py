"""Calibration from films of a ChArUco board, whose known size sets the metric scale.

The intrinsics of each camera are estimated from the board corners (Z. Zhang, A flexible new technique for camera
calibration, PAMI 2000). Cameras are then linked through the board poses that two of them saw at the same time, and
the poses of cameras and boards are refined together by bundle adjustment, with each board rigid.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd

from cospeech.capture.calibration import bundle_adjustment, robust_bundle, world_frame
from cospeech.data.arrays import Flags, Floats, Plane
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera
from cospeech.geometry.rigid import Similarity
from cospeech.geometry.rotation import angles_deg, from_vectors, to_vectors

INCH_M = 0.0254
LEAST_CORNERS = 6
"""Minimum number of corners for the pose of a board to be used."""
LEAST_BOARDS = 8
"""Minimum number of board poses for the intrinsics of a camera."""
LEAST_SHARED = 4
"""Minimum number of board poses that two cameras must share to be linked."""
LEAST_AGREEING = 40
"""Minimum number of corners in which a camera must agree with the others."""
WIDE = 0.005
"""Initial outlier threshold, relative to the image diagonal."""
FEW = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
"""Square pixels and only k1 and k2: boards that cover part of the image determine no more."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board: numbers of squares, side lengths of squares and markers, and whether it is white on black."""

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str
    inverted: bool = False

    @property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """The same board as an OpenCV object."""
        markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, markers)

    @property
    def corners_m(self) -> Floats:
        """The inner corners (K, 3) in the frame of the board, metres."""
        return np.asarray(self.charuco.getChessboardCorners(), dtype=float)


def read(path: str | Path) -> Board:
    """Return the board defined in a TOML file of caliscope.

    The keys are columns, rows, dictionary, aruco_scale, inverted, and either square_size_override_cm or the width and
    height of the board with their units.

    Raises
    ------
    UserError : if the file is missing, is not valid TOML, or is incomplete.
    """
    path = Path(path)
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
        columns, rows = int(raw["columns"]), int(raw["rows"])
        unit = {"inch": INCH_M, "cm": 0.01}[raw.get("units", "cm")]
        square = raw.get("square_size_override_cm", 0.0) / 100 or unit * min(
            raw["board_width"] / columns, raw["board_height"] / rows
        )
        dictionary = raw["dictionary"]
        board = Board(columns, rows, square, square * raw["aruco_scale"], dictionary, raw.get("inverted", False))
        if columns < 2 or rows < 2 or not 0 < board.marker_m < square or not hasattr(cv2.aruco, dictionary):
            raise ValueError("invalid sizes or dictionary")
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; set capture.calibration.board to the board definition") from error
    except RecursionError:
        raise UserError(f"{path}: nested too deeply for a board definition; see charuco.toml of caliscope") from None
    except (OSError, tomllib.TOMLDecodeError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: not a valid board definition ({error}); see charuco.toml of caliscope") from error
    return board


def detect(board: Board, pictures: Iterable[Plane]) -> Floats:
    """Return the corners (T, K, 2) in pixels of the board in each luma image (H, W), NaN where not detected."""
    detector = cv2.aruco.CharucoDetector(board.charuco)
    found = []
    for picture in pictures:
        corners, names, _, _ = detector.detectBoard(255 - picture if board.inverted else picture)
        pixels = np.full((len(board.corners_m), 2), np.nan)
        if names is not None and len(names):
            pixels[np.ravel(names)] = corners.reshape(-1, 2)
        found.append(pixels)
    return np.array(found).reshape(-1, len(board.corners_m), 2)


def detections(board: Board, camera: str, pictures: Iterable[Plane]) -> pd.DataFrame:
    """Return the detected corners of one film as rows of the table ``corners``."""
    corners = detect(board, pictures)
    frames, seen = np.nonzero(~np.isnan(corners[..., 0]))
    x, y = corners[frames, seen].T
    return pd.DataFrame({"camera": camera, "frame": frames, "corner": seen, "x_px": x, "y_px": y})


def observations(board: Board, table: pd.DataFrame, names: Sequence[str]) -> Floats:
    """Return a table ``corners`` as pixels (C, T, K, 2), NaN where not detected; frames count from 0."""
    n_frames = int(table["frame"].max()) + 1 if len(table) else 0
    corners = np.full((len(names), n_frames, len(board.corners_m), 2), np.nan)
    rows = pd.Index(names).get_indexer(pd.Index(table["camera"]))
    corners[rows, table["frame"], table["corner"]] = table[["x_px", "y_px"]]
    return corners


def to_world(
    board: Board, cameras: Sequence[Camera], corners_m: Floats, facts: Sequence[Mapping[str, int]]
) -> Similarity:
    """Return the similarity to the world frame in which the board lies face up at the origin.

    Its columns run to the left (x) and its rows ahead (z).

    Parameters
    ----------
    cameras, corners_m : the result of ``calibrate``, corners (T K, 3).
    facts : the ``origin_frame`` in which the board lies at the origin; if empty, the world frame is that of
        ``world_frame.facing_camera``.

    Raises
    ------
    UserError : if the board is not detected in that frame.
    """
    if not facts:
        return world_frame.facing_camera(cameras[0])
    frame = facts[0]["origin_frame"]
    found = corners_m.reshape(-1, len(board.corners_m), 3)
    found = found[frame] if frame < len(found) else np.empty((0, 3))
    seen = ~np.isnan(found[:, 0])
    if seen.sum() < LEAST_CORNERS:
        raise UserError(
            f"calibration: the board is not detected in frame {frame}, the stated origin_frame; state another frame"
        )
    return world_frame.fit(found[seen], board.corners_m[seen][:, [0, 2, 1]])


def calibrate(
    board: Board,
    names: Sequence[str],
    corners: Floats,
    sizes_px: Sequence[tuple[int, int]],
    intrinsics: Sequence[Camera] | None = None,
) -> tuple[list[Camera], Floats, Flags]:
    """Return the cameras, the corners (T K, 3) in metres, and the mask (C, T K) of the observations that were used.

    The frame is close to that of the first camera.

    Parameters
    ----------
    corners : pixels (C, T, K, 2) of K corners in T synchronous images from C cameras, NaN where not detected.
    intrinsics : cameras whose focal length, principal point and distortion are already known; their poses are
        ignored.

    Raises
    ------
    UserError : if a camera saw the board too rarely, or too rarely together with the other cameras.
    """
    if intrinsics is None:
        intrinsics = [calibrate_intrinsics(board, *own) for own in zip(names, sizes_px, corners, strict=True)]
    poses = np.array([_poses(board, camera, own) for camera, own in zip(intrinsics, corners, strict=True)])
    cameras = _join(intrinsics, poses)
    cameras, boards, used = _fit(board, cameras, _board_poses(cameras, poses, corners), corners)
    for name, agreeing in zip(names, used.sum(axis=(1, 2)), strict=True):
        if agreeing < LEAST_AGREEING:
            raise UserError(
                f"calibration: {agreeing} corners of camera {name} agree with the other cameras, but at least "
                f"{LEAST_AGREEING} are needed; start the films at the same time and move the board slowly"
            )
    return cameras, _corners(board, boards).reshape(-1, 3), used.reshape(len(names), -1)


def calibrate_intrinsics(board: Board, name: str, size_px: tuple[int, int], corners: Floats) -> Camera:
    """Return a camera with focal length, principal point, k1 and k2 estimated from its detected corners (T, K, 2).

    Raises
    ------
    UserError : if too few board poses were detected.
    """
    seen = ~np.isnan(corners[..., 0])
    boards = np.flatnonzero(seen.sum(axis=1) >= LEAST_CORNERS)
    if len(boards) < LEAST_BOARDS:
        raise UserError(
            f"calibration: camera {name} saw the board in {len(boards)} frames with {LEAST_CORNERS} corners or more, "
            f"but at least {LEAST_BOARDS} are needed; check the board definition, or film the board again, closer "
            "and tilted"
        )
    objects = [board.corners_m[seen[b]].astype(np.float32) for b in boards]
    pixels = [corners[b][seen[b]].astype(np.float32) for b in boards]
    middle = (np.array(size_px) - 1.0) / 2.0
    start = np.array([[size_px[0], 0.0, middle[0]], [0.0, size_px[0], middle[1]], [0.0, 0.0, 1.0]])
    _, k, lens, _, _ = cv2.calibrateCamera(objects, pixels, size_px, start, np.zeros(5), flags=FEW)
    k1, k2, p1, p2, k3 = lens.ravel()[:5].tolist()
    return Camera(
        name, size_px, (float(k[0, 0]), float(k[1, 1])), (float(k[0, 2]), float(k[1, 2])), (k1, k2, p1, p2, k3)
    )


def _poses(board: Board, camera: Camera, corners: Floats) -> Floats:
    """Return the board poses (T, 4, 4), board to camera, from corners (T, K, 2); NaN where too few are detected."""
    poses = np.full((len(corners), 4, 4), np.nan)
    seen = ~np.isnan(corners[..., 0])
    for b in np.flatnonzero(seen.sum(axis=1) >= LEAST_CORNERS):
        solved, turn, shift = cv2.solvePnP(
            board.corners_m[seen[b]], corners[b][seen[b]], camera.intrinsic, np.array(camera.lens)
        )
        if solved:
            poses[b] = np.eye(4)
            poses[b, :3, :3], poses[b, :3, 3] = from_vectors(turn.ravel().astype(float)), shift.ravel()
    return poses


def _join(cameras: Sequence[Camera], poses: Floats) -> list[Camera]:
    """Return the cameras in the frame of the first one, given board poses (C, T, 4, 4).

    Each camera is linked to the placed camera with which it shares the most boards.
    """
    seen = ~np.isnan(poses[..., 0, 0])
    placed = {0: np.eye(4)}
    while len(placed) < len(cameras):
        shared = {
            (i, j): int((seen[i] & seen[j]).sum()) for i in placed for j in range(len(cameras)) if j not in placed
        }
        (i, j), most = max(shared.items(), key=lambda item: (item[1], item[0]))
        if most < LEAST_SHARED:
            raise UserError(
                f"calibration: camera {cameras[j].name} shares {most} boards with the other cameras, but at least "
                f"{LEAST_SHARED} are needed; show the board to neighbouring cameras at the same time"
            )
        steps = poses[j][seen[i] & seen[j]] @ np.linalg.inv(poses[i][seen[i] & seen[j]])
        placed[j] = _medoid(steps) @ placed[i]
    joined = []
    for number, camera in enumerate(cameras):
        turn, shift = to_vectors(placed[number][:3, :3]), placed[number][:3, 3]
        joined.append(replace(camera, turn=tuple(turn.tolist()), shift_m=tuple(shift.tolist())))
    return joined


def _medoid(steps: Floats) -> Floats:
    """Return the medoid of poses (n, 4, 4): the pose closest to all others in rotation and position."""
    turns = steps[:, :3, :3]
    turned = np.radians(angles_deg(turns[:, None] @ np.swapaxes(turns, 1, 2))).sum(axis=0)
    places = steps[:, :3, 3]
    moved = np.linalg.norm(places[:, None] - places, axis=2).sum(axis=1) / np.linalg.norm(places, axis=1).mean()
    return steps[int(np.argmin(turned + moved))]


def _board_poses(cameras: Sequence[Camera], poses: Floats, corners: Floats) -> Floats:
    """Return the board poses in the world (T, 3, 4), each from the camera that saw the most of its corners."""
    n_seen = np.where(np.isnan(poses[..., 0, 0]), 0, (~np.isnan(corners[..., 0])).sum(axis=2))
    boards = np.full((corners.shape[1], 3, 4), np.nan)
    for b in np.flatnonzero(n_seen.any(axis=0)):
        best = int(np.argmax(n_seen[:, b]))
        boards[b] = (np.linalg.inv(np.vstack([cameras[best].pose, [0, 0, 0, 1]])) @ poses[best, b])[:3]
    return boards


def _corners(board: Board, boards: Floats) -> Floats:
    """Return the corners (T, K, 3) in the world of boards with poses (T, 3, 4)."""
    return np.einsum("tij,kj->tki", boards[:, :, :3], board.corners_m) + boards[:, None, :, 3]


def _fit(
    board: Board, cameras: Sequence[Camera], boards: Floats, corners: Floats
) -> tuple[list[Camera], Floats, Flags]:
    """Return the best-fitting cameras, board poses (T, 3, 4) and mask of used corners (C, T, K).

    The outlier threshold shrinks from round to round as in ``robust_bundle.adjust``. Each board is a rigid body of
    known size with six parameters, however many of its corners are visible. Views of a moving board from cameras that
    are not synchronous disagree, and are rejected like other outliers.
    """
    rig = bundle_adjustment.from_cameras(cameras)
    threshold = WIDE * max(float(np.hypot(*camera.size_px)) for camera in cameras)
    for _ in range(robust_bundle.ROUNDS):
        flat = corners.reshape(len(cameras), -1, 2)
        distances = bundle_adjustment.residuals(rig, _corners(board, boards).reshape(-1, 3), flat).reshape(
            corners.shape[:3]
        )
        used = distances < threshold
        used &= (used.sum(axis=2) >= LEAST_CORNERS)[:, :, None]
        used &= (used.any(axis=2).sum(axis=0) >= 2)[:, None]
        rig, boards = bundle_adjustment.adjust_bodies(rig, boards, board.corners_m, corners, used, free=())
        n_parameters = len(bundle_adjustment.POSE) * (int(used.any(axis=(0, 2)).sum()) + len(cameras))
        threshold = min(threshold, robust_bundle.OUTLYING * robust_bundle.noise_sd(distances[used], n_parameters))
    return bundle_adjustment.to_cameras(rig, cameras), boards, used
