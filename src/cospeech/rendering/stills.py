"""Still pictures: a typical frame of each gesture class (figure 4.3), frames of a synthesised animation (6.4)."""

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
"""The joints whose places make a pose of the arms; the finger tips join them."""

CELL_PX = (440, 560)
"""Height and width of one picture of a gesture class."""
GRID_COLUMNS = 4
FILM_PX, FILMED_COLUMNS = 300, 3
"""Width of the middle of a film's picture beside it, and the columns of such a grid."""

FRAME_PX = (360, 190)
"""Height and width of one frame of a strip."""
STRIP_FRAMES = 8
STRIP_STEP_S = 0.3
STRIP_VIEW_DEG = 28.0


def arm_places(motion: pd.DataFrame) -> Floats:
    """Return where the arms' joints and finger tips are (T, 6, 3), in metres, on a body that stands straight."""
    angles = skeleton.angles(motion).copy()
    for index, joint in enumerate(skeleton.JOINTS):
        if "arm" not in joint and "hand" not in joint:
            angles[:, index] = 0
    places = skeleton.forward(np.zeros((len(motion), 3)), angles)
    return np.stack([places[name] for name in (*ARM_POINTS, "left_hand_tip", "right_hand_tip")], axis=1)


def typical(phrases: pd.DataFrame, motions: Mapping[str, pd.DataFrame], order: Sequence[str]) -> pd.DataFrame:
    """Return the frame that shows each gesture class best: the table of schema ``stills``.

    The stroke of a phrase is taken to be its middle third. The frame is the one, among all strokes of the class,
    whose arms are nearest to their mean place in these strokes.

    Parameters
    ----------
    phrases : gesture segments of all records.
    motions : the motion table of each record.
    order : the classes, in the order wanted; those that do not occur are left out.
    """
    strokes = []
    for record, rows in phrases.groupby("record", sort=True):
        motion = motions[str(record)]
        first, end = frame_spans(rows, len(motion), skeleton.frame_rate(motion))
        third = (end - first) // 3
        frames = np.concatenate([np.arange(a, b) for a, b in zip(first + third, end - third, strict=True)])
        labels = np.repeat(rows["label"].to_numpy(dtype=object), end - first - 2 * third)
        strokes.append((str(record), frames, labels, arm_places(motion)[frames]))
    shown = []
    for label in order:
        chosen = [(record, frames[of == label], places[of == label]) for record, frames, of, places in strokes]
        places = np.concatenate([part for _, _, part in chosen])
        if len(places) == 0:
            continue
        distance = np.linalg.norm(places - places.mean(axis=0), axis=-1).mean(axis=-1)
        best = int(np.argmin(distance))
        names = np.repeat([record for record, _, _ in chosen], [len(part) for _, _, part in chosen])
        record, frame = str(names[best]), int(np.concatenate([frames for _, frames, _ in chosen])[best])
        shown.append((label, record, frame, (frame + 0.5) / skeleton.frame_rate(motions[record]), distance[best]))
    table = pd.DataFrame(shown, columns=["label", "record", "frame", "time_s", "distance_m"])
    table["n_phrases"] = table["label"].map(phrases["label"].value_counts()).astype("int64")
    return table


def grid(table: pd.DataFrame, motions: Mapping[str, pd.DataFrame], shots: Mapping[str, Path]) -> Image:
    """Return one picture (H, W, 3) of the frames that ``typical`` found, each from two sides, with captions.

    Parameters
    ----------
    table : from ``typical``.
    motions : the motion table of each record.
    shots : the film of each record that was filmed, a picture a motion frame; it is shown beside the figure.
    """
    height, width = CELL_PX
    film_px = FILM_PX if shots else 0
    columns = FILMED_COLUMNS if shots else GRID_COLUMNS
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
        if record in shots:
            shot = films.stills(shots[record], {frame}, height)[frame]
            cell[:, :film_px] = shot[:, (shot.shape[1] - film_px) // 2 :][:, :film_px]
        for view in views:
            painter.figure(moving, view.moved(left, top), floor_m).draw(image, 0)
        canvas.lay(cell, 14, film_px + 14, *picture.tag(str(row.label), 14))
        caption = f"{row.record} · {row.time_s:.1f} s · one of {row.n_phrases} phrases"
        canvas.write(cell, caption, height - 24, film_px + 14, 12, canvas.FAINT)
        cell[:, -1] = cell[-1] = 255
    return image


def liveliest(motion: pd.DataFrame, frames: int, step: int) -> npt.NDArray[np.int64]:
    """Return ``frames`` frame numbers, ``step`` apart, over which the arms travel farthest."""
    places = arm_places(motion)
    span = (frames - 1) * step
    if span >= len(places):
        return np.linspace(0, len(places) - 1, frames).astype(np.int64)
    travelled = np.append(0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=-1).sum(axis=-1)))
    start = int(np.argmax(travelled[span:] - travelled[: len(travelled) - span]))
    return start + step * np.arange(frames)


def strip(motions: Sequence[pd.DataFrame], phrases: Sequence[pd.DataFrame], captions: Sequence[str]) -> Image:
    """Return one picture (H, W, 3): a row of successive frames of each motion, where its arms are busiest."""
    height, width = FRAME_PX
    painter = figure.Painter(detail=3)
    rows = []
    for motion, shown, caption in zip(motions, phrases, captions, strict=True):
        fps = skeleton.frame_rate(motion)
        frames = liveliest(motion, STRIP_FRAMES, max(1, round(STRIP_STEP_S * fps)))
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
