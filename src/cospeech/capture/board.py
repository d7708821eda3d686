"""Calibration from films of a ChArUco board, which brings its own metre.

Each camera is calibrated inside from the board's corners (Z. Zhang, A flexible new technique for camera calibration,
PAMI 2000), cameras are joined over the boards that two of them saw at the same time, and the whole is refined by the
same bundle adjustment as a self-calibration.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.spatial.transform import Rotation

from cospeech.capture import axes
from cospeech.capture.camera import Camera
from cospeech.capture.rounds import rounds
from cospeech.errors import UserError

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Plane = npt.NDArray[np.uint8]

INCH_M = 0.0254
LEAST_CORNERS = 6
"""Fewest corners of a board whose pose is used."""
LEAST_BOARDS = 8
"""Fewest boards that determine the inside of a camera."""
LEAST_SHARED = 4
"""Fewest boards that join two cameras."""
LEAST_HELD = 40
"""Fewest corners of boards held still that a camera shares."""
WIDE = 0.005
"""First outlier threshold, relative to the picture's diagonal."""
STILL = 0.01
"""How far a board may move between two pictures to join cameras, relative to the picture's diagonal."""
FEW = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
"""Square pixels, k1 and k2: what boards in a part of the picture determine."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board: squares across and down, their side and that of a marker, whether printed white on black."""

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str
    inverted: bool = False

    @property
    def made(self) -> cv2.aruco.CharucoBoard:
        """The board as OpenCV knows it."""
        markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, markers)

    @property
    def corners_m(self) -> Floats:
        """The inner corners (K, 3) in the board's frame, metres."""
        return np.asarray(self.made.getChessboardCorners(), dtype=float)


def read(path: str | Path) -> Board:
    """Return a board from caliscope's TOML file: columns, rows, aruco_scale, dictionary, inverted, a square's side.

    Raises
    ------
    UserError : where the file is missing, no TOML or incomplete.
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
            raise ValueError("sizes or dictionary make no board")
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such board; give the path of its definition") from error
    except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path}: no definition of a board ({error}); see charuco.toml of caliscope") from error
    return board


def detect(board: Board, pictures: Iterable[Plane]) -> Floats:
    """Return the corners (T, K, 2) in pixels of each picture's plane Y (H, W), NaN where not seen."""
    detector = cv2.aruco.CharucoDetector(board.made)
    found = []
    for picture in pictures:
        corners, names, _, _ = detector.detectBoard(255 - picture if board.inverted else picture)
        pixels = np.full((len(board.corners_m), 2), np.nan)
        if names is not None and len(names):
            pixels[np.ravel(names)] = corners.reshape(-1, 2)
        found.append(pixels)
    return np.array(found).reshape(-1, len(board.corners_m), 2)


def sightings(board: Board, camera: str, pictures: Iterable[Plane]) -> pd.DataFrame:
    """Return the rows of the table ``corners`` (camera, frame, corner, x_px, y_px) of one film, where seen."""
    corners = detect(board, pictures)
    frames, seen = np.nonzero(~np.isnan(corners[..., 0]))
    x, y = corners[frames, seen].T
    return pd.DataFrame({"camera": camera, "frame": frames, "corner": seen, "x_px": x, "y_px": y})


def observations(board: Board, table: pd.DataFrame, names: Sequence[str]) -> Floats:
    """Return the corners (C, T, K, 2) in pixels of a table ``corners``, NaN where not seen; frames count from 0."""
    n_frames = int(table["frame"].max()) + 1 if len(table) else 0
    corners = np.full((len(names), n_frames, len(board.corners_m), 2), np.nan)
    rows = pd.Index(names).get_indexer(pd.Index(table["camera"]))
    corners[rows, table["frame"], table["corner"]] = table[["x_px", "y_px"]]
    return corners


def lying(board: Board, corners_m: Floats, facts: Sequence[Mapping[str, int]]) -> axes.Similarity:
    """Return the change to axes in which the board lies face up at the origin, columns to the left and rows ahead.

    Parameters
    ----------
    corners_m : (T K, 3) from ``calibrate``.
    facts : the ``origin_frame`` in which it lies so; none leaves the axes those of the first camera.

    Raises
    ------
    UserError : where the board is not found in that frame.
    """
    if not facts:
        return axes.Similarity(1.0, np.eye(3), np.zeros(3))
    frame = facts[0]["origin_frame"]
    found = corners_m.reshape(-1, len(board.corners_m), 3)
    found = found[frame] if frame < len(found) else np.empty((0, 3))
    seen = ~np.isnan(found[:, 0])
    if seen.sum() < LEAST_CORNERS:
        raise UserError(
            f"calibration: the board is not found in frame {frame}, where it is said to lie; state another"
        )
    return axes.fit(found[seen], board.corners_m[seen][:, [0, 2, 1]])


def calibrate(
    board: Board,
    names: Sequence[str],
    corners: Floats,
    sizes_px: Sequence[tuple[int, int]],
    insides: Sequence[Camera] | None = None,
) -> tuple[list[Camera], Floats, Mask]:
    """Return the cameras in metres, in the frame of the first, the corners (T K, 3) and what was used (C, T K).

    Parameters
    ----------
    corners : pixels (C, T, K, 2) of K corners in T pictures that C cameras took together, NaN where not seen.
    insides : cameras whose focal length, principal point and lens are known from elsewhere; their poses do not count.

    Raises
    ------
    UserError : where a camera saw too few boards, or none together with the others.
    """
    if insides is None:
        insides = [inside(board, *own) for own in zip(names, sizes_px, corners, strict=True)]
    poses = np.array([_poses(board, camera, own) for camera, own in zip(insides, corners, strict=True)])
    cameras = _join(insides, poses)
    diagonal = float(np.hypot(*np.max(np.array(sizes_px), axis=0)))
    held = np.where(_still(corners, STILL * diagonal)[:, :, None, None], corners, np.nan)
    observations = held.reshape(len(names), -1, 2)
    seen = ~np.isnan(observations[..., 0])
    for name, shared in zip(names, (seen & (seen.sum(axis=0) >= 2)).sum(axis=1), strict=True):
        if shared < LEAST_HELD:
            raise UserError(
                f"calibration: {shared} corners of boards held still join camera {name} to another, at least "
                f"{LEAST_HELD} are needed; film the board again, and move it slowly"
            )
    cameras, points, used = rounds(cameras, observations, WIDE * diagonal, free=())
    change = _metre(board, points)
    return change.cameras(cameras), change.points(points), used


def inside(board: Board, name: str, size_px: tuple[int, int], corners: Floats) -> Camera:
    """Return a camera with focal length, principal point, k1 and k2 from the corners (T, K, 2) that it saw.

    Raises
    ------
    UserError : where it saw too few boards.
    """
    seen = ~np.isnan(corners[..., 0])
    boards = np.flatnonzero(seen.sum(axis=1) >= LEAST_CORNERS)
    if len(boards) < LEAST_BOARDS:
        raise UserError(
            f"calibration: camera {name} saw {len(boards)} boards with {LEAST_CORNERS} corners or more, at least "
            f"{LEAST_BOARDS} are needed; check the board's definition, or film it again, nearer and tilted"
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
    """Return the poses (T, 4, 4), board to camera, of boards with corners (T, K, 2); NaN where too few are seen."""
    poses = np.full((len(corners), 4, 4), np.nan)
    seen = ~np.isnan(corners[..., 0])
    for b in np.flatnonzero(seen.sum(axis=1) >= LEAST_CORNERS):
        solved, turn, shift = cv2.solvePnP(
            board.corners_m[seen[b]], corners[b][seen[b]], camera.intrinsic, np.array(camera.lens)
        )
        if solved:
            poses[b] = np.eye(4)
            poses[b, :3, :3], poses[b, :3, 3] = Rotation.from_rotvec(turn.ravel()).as_matrix(), shift.ravel()
    return poses


def _still(corners: Floats, limit_px: float) -> Mask:
    """Return in which pictures (C, T) the board moved less than ``limit_px`` since the one before or to the next.

    Cameras that are not exactly in step see a moving board in different places.
    """
    steps = np.linalg.norm(np.diff(corners, axis=1), axis=-1)
    both = ~np.isnan(steps)
    moved = np.where(both, steps, 0.0).sum(axis=2) / np.maximum(both.sum(axis=2), 1)
    moved[~both.any(axis=2)] = np.inf
    edge = np.full((len(corners), 1), np.inf)
    return np.minimum(np.hstack([edge, moved]), np.hstack([moved, edge])) < limit_px


def _join(cameras: Sequence[Camera], poses: Floats) -> list[Camera]:
    """Return the cameras in the frame of the first, joined where most boards are shared, from poses (C, T, 4, 4)."""
    seen = ~np.isnan(poses[..., 0, 0])
    placed = {0: np.eye(4)}
    while len(placed) < len(cameras):
        shared = {
            (i, j): int((seen[i] & seen[j]).sum()) for i in placed for j in range(len(cameras)) if j not in placed
        }
        (i, j), most = max(shared.items(), key=lambda item: (item[1], item[0]))
        if most < LEAST_SHARED:
            raise UserError(
                f"calibration: camera {cameras[j].name} shares {most} boards with the others, at least "
                f"{LEAST_SHARED} are needed; show the board to neighbouring cameras together"
            )
        steps = poses[j][seen[i] & seen[j]] @ np.linalg.inv(poses[i][seen[i] & seen[j]])
        placed[j] = _middle(steps) @ placed[i]
    joined = []
    for number, camera in enumerate(cameras):
        turn, shift = Rotation.from_matrix(placed[number][:3, :3]).as_rotvec(), placed[number][:3, 3]
        joined.append(replace(camera, turn=tuple(turn.tolist()), shift_m=tuple(shift.tolist())))
    return joined


def _middle(steps: Floats) -> Floats:
    """Return that one of the poses (n, 4, 4) which is least far from all others, by rotation and by place."""
    turns = Rotation.from_matrix(steps[:, :3, :3])
    turned = np.array([(turns * turn.inv()).magnitude().sum() for turn in turns])
    places = steps[:, :3, 3]
    moved = np.linalg.norm(places[:, None] - places, axis=2).sum(axis=1) / np.linalg.norm(places, axis=1).mean()
    return steps[int(np.argmin(turned + moved))]


def _metre(board: Board, points: Floats) -> axes.Similarity:
    """Return the change of unit under which the corners (T K, 3) are as far apart as on the board."""
    found = points.reshape(-1, len(board.corners_m), 3)
    first, second = np.triu_indices(found.shape[1], 1)
    apart = np.linalg.norm(found[:, first] - found[:, second], axis=2)
    wanted = np.linalg.norm(board.corners_m[first] - board.corners_m[second], axis=1)
    both = ~np.isnan(apart)
    scale = float((np.where(both, apart, 0.0) * wanted).sum() / (apart[both] ** 2).sum())
    return axes.Similarity(scale, np.eye(3), np.zeros(3))
