"""The comparison videos that the page carries, as many as fit."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import NamedTuple

import av


class Video(NamedTuple):
    """A comparison video: in the page (``data``, ``poster``) where there was room, else only linked."""

    record: str
    actor: str
    link: str
    data: str | None = None
    poster: str | None = None


def embed(paths: dict[str, str], links: dict[str, str], actors: dict[str, str], budget: int) -> list[Video]:
    """Return the videos of a run, those that fit into ``budget`` bytes of page with their content.

    Parameters
    ----------
    paths : the file of each record.
    links : its address from the page.
    actors : the actor of each record.
    budget : bytes of the page that are free; content takes 4/3 of its size there.
    """
    sizes = {record: Path(path).stat().st_size * 4 // 3 + 60_000 for record, path in paths.items()}
    chosen = choose(sizes, actors, budget)
    videos = []
    for record, path in paths.items():
        plain = Video(record, actors[record], links[record])
        if record in chosen:
            data = data_uri(Path(path).read_bytes(), "video/mp4")
            plain = plain._replace(data=data, poster=data_uri(poster(path), "image/jpeg"))
        videos.append(plain)
    return videos


def choose(sizes: dict[str, int], actors: dict[str, str], budget: int) -> set[str]:
    """Return the records whose videos fit: the first of each actor, then the second of each, while there is room.

    Parameters
    ----------
    sizes : bytes of each record's video in the page.
    actors : the actor of each record.
    budget : bytes that all together may have.
    """
    turns: dict[str, int] = {}
    order = []
    for record in sizes:
        turns[actors[record]] = turns.get(actors[record], 0) + 1
        order.append((turns[actors[record]], record))
    chosen: set[str] = set()
    for _, record in sorted(order, key=lambda entry: entry[0]):
        if sizes[record] <= budget:
            chosen.add(record)
            budget -= sizes[record]
    return chosen


def poster(path: str, share: float = 0.4) -> bytes:
    """Return one frame of a video as JPEG, at a share of its length."""
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
    """Return bytes as an address that a page carries in itself."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
