"""Still images: a typical frame of each gesture class (figure 4.3), and frames of an animation (figure 6.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Floats, Image
from cospeech.formats import canvas, films
from cospeech.motion import skeleton
from cospeech.motion.unit_selection import frame_spans
from cospeech.rendering import figure, picture

ARM_POINTS = ("left_forearm", "left_hand", "right_forearm", "right_hand")
"""The joints whose positions, together with the finger tips, define the pose of the arms."""

CELL_PX = (440, 560)
"""Height and width of the image of one gesture class."""
GRID_COLUMNS = 4
FOOTAGE_PX, FOOTAGE_COLUMNS = 300, 3
"""Width of the section of the film shown next to a figure, and the number of grid columns if films are shown."""

FRAME_PX = (360, 190)
"""Height and width of one frame of a film strip."""
STRIP_FRAMES = 8
STRIP_STEP_S = 0.3
STRIP_VIEW_DEG = 28.0


def arm_positions(motion: pd.DataFrame) -> Floats:
    """Return the positions (T, 6, 3) of arm joints and finger tips in metres, for an upright body."""
    angles = skeleton.angles(motion).copy()
    for index, joint in enumerate(skeleton.JOINTS):
        if "arm" not in joint and "hand" not in joint:
            angles[:, index] = 0
    positions = skeleton.forward(np.zeros((len(motion), 3)), angles)
    return np.stack([positions[name] for name in (*ARM_POINTS, "left_hand_tip", "right_hand_tip")], axis=1)


def typical_frames(phrases: pd.DataFrame, motions: Mapping[str, pd.DataFrame], order: Sequence[str]) -> pd.DataFrame:
    """Return the most typical frame of each gesture class (schema ``stills``).

    The middle third of a phrase is taken as its stroke. The typical frame is the one, among all strokes of the class,
    in which the arms are closest to their mean position over these strokes.

    Parameters
    ----------
    phrases : gesture segments of all records.
    motions : motion tables by record.
    order : the classes in output order; classes that do not occur are left out.
    """
    strokes = []
    for record, table in phrases.groupby("record", sort=True):
        motion = motions[str(record)]
        first, end = frame_spans(table, len(motion), skeleton.frame_rate(motion))
        third = (end - first) // 3
        frames = np.concatenate([np.arange(a, b) for a, b in zip(first + third, end - third, strict=True)])
        labels = np.repeat(table["label"].to_numpy(dtype=object), end - first - 2 * third)
        strokes.append((str(record), frames, labels, arm_positions(motion)[frames]))
    rows = []
    for label in order:
        chosen = [
            (record, frames[labels == label], positions[labels == label])
            for record, frames, labels, positions in strokes
        ]
        positions = np.concatenate([part for _, _, part in chosen])
        if len(positions) == 0:
            continue
        distance = np.linalg.norm(positions - positions.mean(axis=0), axis=-1).mean(axis=-1)
        best = int(np.argmin(distance))
        names = np.repeat([record for record, _, _ in chosen], [len(part) for _, _, part in chosen])
        record, frame = str(names[best]), int(np.concatenate([frames for _, frames, _ in chosen])[best])
        rows.append((label, record, frame, (frame + 0.5) / skeleton.frame_rate(motions[record]), distance[best]))
    table = pd.DataFrame(rows, columns=["label", "record", "frame", "time_s", "distance_m"])
    table["n_phrases"] = table["label"].map(phrases["label"].value_counts()).astype("int64")
    return table


def grid(table: pd.DataFrame, motions: Mapping[str, pd.DataFrame], footage: Mapping[str, Path]) -> Image:
    """Return an image (H, W, 3) of the frames selected by ``typical_frames``, each from two sides, with captions.

    Parameters
    ----------
    table : the table returned by ``typical_frames``.
    motions : motion tables by record.
    footage : films by record, one picture per motion frame, shown next to the figures; empty if there are none.
    """
    height, width = CELL_PX
    film_px = FOOTAGE_PX if footage else 0
    columns = FOOTAGE_COLUMNS if footage else GRID_COLUMNS
    bodies = [
        figure.pose(motions[record].iloc[[frame]])
        for record, frame in zip(table["record"], table["frame"], strict=True)
    ]
    painter, floor_m = figure.Painter(detail=3), figure.floor_height(bodies)
    views = figure.cameras(painter.extent(bodies), (film_px, 36, film_px + width, height - 30))
    width += film_px
    rows = -(-len(table) // columns)
    image = picture.background(1, 1)[0, 0] * np.ones((rows * height, columns * width, 3), dtype=np.uint8)
    for number, (moving, row) in enumerate(zip(bodies, table.itertuples(index=False), strict=True)):
        top, left = height * (number // columns), width * (number % columns)
        cell = image[top : top + height, left : left + width]
        cell[:] = picture.background(height, width)
        record, frame = str(row.record), int(table["frame"].iloc[number])
        if record in footage:
            still = films.stills(footage[record], {frame}, height)[frame]
            cell[:, :film_px] = still[:, (still.shape[1] - film_px) // 2 :][:, :film_px]
        for view in views:
            painter.figure(moving, view.shifted(left, top), floor_m).draw(image, 0)
        canvas.lay(cell, 14, film_px + 14, *picture.tag(str(row.label), 14))
        caption = f"{row.record} · {row.time_s:.1f} s · one of {row.n_phrases} phrases"
        canvas.write(cell, caption, height - 24, film_px + 14, 12, canvas.FAINT)
        cell[:, -1] = cell[-1] = 255
    return image


def most_active_frames(motion: pd.DataFrame, frames: int, step: int) -> npt.NDArray[np.int64]:
    """Return ``frames`` frame numbers, ``step`` apart, over which the arms travel the largest distance."""
    positions = arm_positions(motion)
    span = (frames - 1) * step
    if span >= len(positions):
        return np.linspace(0, len(positions) - 1, frames).astype(np.int64)
    travelled = np.append(0, np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=-1).sum(axis=-1)))
    start = int(np.argmax(travelled[span:] - travelled[: len(travelled) - span]))
    return start + step * np.arange(frames)


def strip(motions: Sequence[pd.DataFrame], phrases: Sequence[pd.DataFrame], captions: Sequence[str]) -> Image:
    """Return an image (H, W, 3) with a row of successive frames of each motion, where its arms are most active."""
    height, width = FRAME_PX
    painter = figure.Painter(detail=3)
    rows = []
    for motion, shown, caption in zip(motions, phrases, captions, strict=True):
        fps = skeleton.frame_rate(motion)
        frames = most_active_frames(motion, STRIP_FRAMES, max(1, round(STRIP_STEP_S * fps)))
        moving = figure.pose(motion.iloc[frames])
        view = figure.cameras(painter.extent([moving]), (0, 40, width, height - 30), [STRIP_VIEW_DEG])[0]
        drawn = painter.figure(moving, view, figure.floor_height([moving]))
        times = segments.frame_times(len(motion), fps)[frames]
        cells = []
        for number, (time_s, label) in enumerate(zip(times, picture.labels_at(shown, times), strict=True)):
            cell = picture.background(height, width)
            drawn.draw(cell, number)
            canvas.lay(cell, 12, 12, *picture.tag(label, 12))
            canvas.write(cell, f"{time_s:.1f} s", height - 24, 12, 12, canvas.FAINT)
            cells.append(cell)
        header = picture.background(1, 1) * np.ones((28, width * len(cells), 1), dtype=np.uint8)
        canvas.write(header, caption, 10, 12, 13)
        rows += [header, np.hstack(cells)]
    return np.vstack(rows)
