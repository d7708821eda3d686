"""The videos that the page contains, as many as fit."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import av


class Clip(NamedTuple):
    """A video file that the page may contain.

    ``section`` is the anchor of the section that shows it, and ``group`` those among which the room is shared fairly.
    """

    path: str
    section: str
    group: str
    title: str
    description: str
    link: str


class Video(NamedTuple):
    """A video: contained in the page (``data``, ``poster``) if there was room, otherwise only linked."""

    clip: Clip
    data: str | None = None
    poster: str | None = None


def embed(clips: Sequence[Clip], budget: int) -> list[Video]:
    """Return the videos of a run, with the content of those that fit.

    Parameters
    ----------
    clips : the videos.
    budget : free bytes of the page, in which content takes 4/3 of its size.
    """
    sizes = [Path(clip.path).stat().st_size * 4 // 3 + 60_000 for clip in clips]
    chosen = choose(sizes, [clip.group for clip in clips], budget)
    return [_embedded(clip) if place in chosen else Video(clip) for place, clip in enumerate(clips)]


def _embedded(clip: Clip) -> Video:
    data = data_uri(Path(clip.path).read_bytes(), "video/mp4")
    return Video(clip, data, data_uri(poster(clip.path), "image/jpeg"))


def choose(sizes: Sequence[int], groups: Sequence[str], budget: int) -> set[int]:
    """Return which videos fit: the first of each group, then the second of each, while there is room.

    Parameters
    ----------
    sizes : bytes that each video takes in the page.
    groups : the group of each.
    budget : bytes that they may take together.
    """
    turns: dict[str, int] = {}
    order = []
    for place, group in enumerate(groups):
        turns[group] = turns.get(group, 0) + 1
        order.append((turns[group], place))
    chosen: set[int] = set()
    for _, place in sorted(order, key=lambda entry: entry[0]):
        if sizes[place] <= budget:
            chosen.add(place)
            budget -= sizes[place]
    return chosen


def poster(path: str, share: float = 0.4) -> bytes:
    """Return one frame of a video as JPEG, at a given share of its length."""
    with av.open(path) as video:
        stream = video.streams.video[0]
        wanted = int(share * stream.frames)
        for number, frame in enumerate(video.decode(stream)):
            content = frame
            if number == wanted:
                break
        target = io.BytesIO()
        content.to_image().save(target, "JPEG", quality=78)
    return target.getvalue()


def data_uri(content: bytes, kind: str) -> str:
    """Return content as a data URI."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
