"""The two animated models of Sargin 2006, figure 3.2, as a strip: the stick figure, and arms and head of a body.

The stick figure is drawn from the positions of head, hands and shoulders in the image. The body uses a dictionary of
events with poses that were made by hand, independently for the head and each arm (3.5).
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
from PIL import Image as Pillow
from PIL import ImageDraw

from cospeech.data.arrays import Floats, Image, Integers
from cospeech.formats import canvas
from cospeech.motion import skeleton
from cospeech.rendering import body, figure, picture

CELL_PX = (260, 230)
"""Height and width of a frame."""

FRAMES = 7
"""Number of frames in a row."""

FILM_HEIGHT_PX = 480
"""Height of the document's film, whose pixels the head moves by."""

METRES = 1.1
"""Height of what the stick figure's frame shows, in metres."""

SHOULDER_M, HEAD_M = (0.18, 0.0), 0.30
"""The left shoulder, and the height of the head, from the middle between the shoulders."""

ELBOW_M, HAND_M = (0.21, -0.27), (0.10, -0.42)
"""The left elbow, which hangs, and the left hand at rest; the right ones mirror them."""

HAND_POSES = {
    "left": {"left": ((0.0, 0.0, 12.0), (0.0, 0.0, 78.0))},
    "right": {"right": ((0.0, 0.0, -12.0), (0.0, 0.0, -78.0))},
    "straight": {
        "left": ((-40.0, 0.0, 0.0), (-50.0, 0.0, 0.0)),
        "right": ((-40.0, 0.0, 0.0), (-50.0, 0.0, 0.0)),
    },
}
"""The dictionary of the body: by keyword and side, the angles x, y and z of upper arm and forearm, in degrees."""

REST_POSE = {"left": ((-8.0, 0.0, 5.0), (-25.0, 0.0, 0.0)), "right": ((-8.0, 0.0, -5.0), (-25.0, 0.0, 0.0))}
"""The same at rest."""

NOD_DEG = 10.0
"""How far the head of the body is down in the middle of an accent."""

HELD = (0.3, 0.7)
"""Shares of a keyword between which its pose is held."""

SHOWN = tuple(body.MATERIALS.index(name) for name in body.MATERIALS if name not in ("shirt", "trousers", "shoe"))
"""The materials of arms and head."""


def shown_frames(animation: pd.DataFrame) -> Integers:
    """Return the numbers of the frames in the strip: a frame at rest, then the middle of keywords and accents.

    Parameters
    ----------
    animation : the table ``direction_animation`` of an answer.
    """
    middles: dict[str, list[int]] = {"keyword_share": [], "accent_share": []}
    for name in middles:
        share = animation[name].to_numpy(dtype=float)
        starts = np.flatnonzero(np.isfinite(share) & ~(np.diff(share, prepend=np.inf) > 0.0))
        for first, end in itertools.pairwise([*starts.tolist(), len(share)]):
            middles[name].append(first + int(np.nanargmin(np.abs(share[first:end] - 0.5))))
    keywords, accents = middles.values()
    chosen = [*keywords[: FRAMES - 2], *accents[:1]]
    still = int(np.flatnonzero(animation[["keyword_share", "accent_share"]].isna().all(axis=1).to_numpy()).min())
    return np.array(sorted({still, *chosen}))


def strip(animation: pd.DataFrame, caption: str) -> Image:
    """Return an image (H, W, 3) with frames of the stick figure, and below them the same frames of the body."""
    frames = shown_frames(animation)
    shown = animation.iloc[frames]
    height, width = CELL_PX
    rows = [[picture.background(height, width) for _ in frames] for _ in range(2)]
    for number, cell in enumerate(rows[0]):
        _draw_lines(cell, _lines(shown.iloc[number]))
    _draw_body(rows[1], pose(shown))
    for cells in rows:
        for cell, (_, row) in zip(cells, shown.iterrows(), strict=True):
            if isinstance(row["keyword"], str):
                canvas.lay(cell, 10, 10, *picture.tag(row["keyword"], 11))
            canvas.write(cell, f"{row['time_s']:.1f} s", height - 22, 10, 11, canvas.FAINT)
            if pd.notna(row["accent_share"]):
                canvas.write(cell, f"accent, head {row['head_px']:.1f} px", height - 22, 70, 11, canvas.FAINT)
    header = picture.background(1, 1) * np.ones((26, width * len(frames), 1), dtype=np.uint8)
    canvas.write(header, caption, 8, 10, 12)
    return np.vstack([header, *(np.hstack(cells) for cells in rows)])


def _lines(row: pd.Series) -> list[Floats]:
    """Return the line segments (2, 2) of a frame of the stick figure: x to the person's left, y up, in metres."""
    lines = [np.array([[0.0, 0.0], [0.0, HEAD_M - row["head_px"] * METRES / FILM_HEIGHT_PX]])]
    lines.append(np.array([[-SHOULDER_M[0], 0.0], [SHOULDER_M[0], 0.0]]))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shoulder, elbow, hand = (np.array([sign * x, y]) for x, y in (SHOULDER_M, ELBOW_M, HAND_M))
        hand += row[[f"{side}_x_m", f"{side}_y_m"]].to_numpy(dtype=float)
        lines += [np.array([shoulder, elbow]), np.array([elbow, hand])]
    return lines


def _draw_lines(cell: Image, lines: list[Floats]) -> None:
    """Draw line segments in metres, with a disc for the head at the end of the first one."""
    height, width = cell.shape[:2]
    fine = 3
    scale = fine * height / METRES
    middle = np.array([fine * width / 2, fine * height * 0.42])
    plate = Pillow.new("L", (fine * width, fine * height))
    pen = ImageDraw.Draw(plate)
    for line in lines:
        ends = middle + line * [scale, -scale]
        pen.line([tuple(end) for end in ends.tolist()], fill=255, width=4 * fine)
    x, y = (middle + lines[0][1] * [scale, -scale]).tolist()
    pen.ellipse((x - 9 * fine, y - 9 * fine, x + 9 * fine, y + 9 * fine), fill=255)
    ink = np.asarray(plate.resize((width, height), Pillow.Resampling.BOX), dtype=np.float32) / np.float32(255)
    canvas.lay(cell, 0, 0, canvas.INK, ink)


def pose(animation: pd.DataFrame) -> figure.Pose:
    """Return the poses of the body in the frames of an animation, from the dictionary of its events."""
    angles = np.zeros((len(animation), len(skeleton.JOINTS), 3))
    over, nodded = (animation[f"{event}_share"].fillna(0.0).to_numpy(float) for event in ("keyword", "accent"))
    held = np.interp(over, [0.0, *HELD, 1.0], [0.0, 1.0, 1.0, 0.0])
    for side, at_rest in REST_POSE.items():
        joints = [skeleton.JOINTS.index(f"{side}_{part}") for part in ("arm", "forearm")]
        for number, (keyword, share) in enumerate(zip(animation["keyword"], held.tolist(), strict=True)):
            made = HAND_POSES.get(keyword, {}).get(side, at_rest) if isinstance(keyword, str) else at_rest
            angles[number, joints] = (1.0 - share) * np.array(at_rest) + share * np.array(made)
    angles[:, skeleton.JOINTS.index("head"), 0] = np.interp(nodded, [0.0, 0.5, 1.0], [0.0, NOD_DEG, 0.0])
    return figure.Pose(*skeleton.chain(np.zeros((len(animation), 3)), angles))


def _draw_body(cells: list[Image], moving: figure.Pose) -> None:
    """Draw the arms and the head of the body, without the rest of it."""
    painter = figure.Painter(detail=3)
    shown = np.isin(painter.mesh.material, SHOWN)
    painter.mesh = painter.mesh._replace(face=painter.mesh.face[shown], material=painter.mesh.material[shown])
    parts = [
        number for number, name in enumerate(skeleton.JOINTS) if "arm" in name or "hand" in name or name == "head"
    ]
    height, width = CELL_PX
    points = painter.extent([moving]).reshape(len(moving), len(skeleton.JOINTS), 8, 3)[:, parts].reshape(-1, 3)
    (camera,) = figure.cameras(points, (0, 26, width, height - 26), [18.0])
    drawn = painter.figure(moving, camera, floor_m=-10.0)
    for number, cell in enumerate(cells):
        drawn.draw(cell, number)
