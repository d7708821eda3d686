"""``cospeech synthesize`` with a model that moves the head alone: its files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import pandas as pd

    from cospeech.api import HeadModel, HeadPerformance
    from cospeech.data.arrays import Floats

FORMATS = {
    "bvh": (".bvh", "a body that moves its head, for animation programs"),
    "table": (".head.parquet", "angles of the head in degrees, as a table"),
    "csv": (".head.csv", "the same as text"),
    "mp4": (".mp4", "video of the head, with the sound"),
}
"""The formats that can be written: the end of the file's name, and what it contains."""

VIDEO_FPS, VIDEO_HEIGHT_PX = 25.0, 540


class Moved(NamedTuple):
    """What was synthesized: the movements of a head, and the motion of the body that it belongs to."""

    performance: HeadPerformance
    motion: pd.DataFrame


def made(sound: Floats, model: HeadModel, record: str, seed: int | None, body: pd.DataFrame | None) -> Moved:
    """Synthesize the head for (n,) samples of sound; ``body`` is the motion to take the body from, or None."""
    from cospeech import api
    from cospeech.motion import head, skeleton

    performance = api.synthesize_head(sound, model, record=record, seed=seed)
    own = skeleton.standing(len(performance.head), head.frame_rate(performance.head)) if body is None else body
    return Moved(performance, head.moved(own, performance.head))


def write(name: str, path: Path, moved: Moved, model: HeadModel, record: str) -> None:
    """Write what was synthesized in one format."""
    card, angles = model.card, moved.performance.head
    if name == "bvh":
        from cospeech.formats import bvh

        bvh.write(moved.motion, path)
    elif name == "csv":
        angles.to_csv(path, index=False, lineterminator="\n", float_format="%.6f")
    elif name == "table":
        from cospeech.data import tables
        from cospeech.workflow.job import settings_hash

        tables.write(angles, path, "head", corpus=card["corpus"], config_hash=settings_hash(dict(card)))
    else:
        from cospeech.formats import sound
        from cospeech.rendering import heads

        wav = path.with_suffix(".wav")
        sound.write(moved.performance.sound, wav)
        caption = f"{record} · model of {card['actor']} ({card['corpus']})"
        panel = heads.Panel(model.system.title, angles)
        heads.write_video(path, [panel], caption, VIDEO_FPS, VIDEO_HEIGHT_PX, longest_s=None, sound=wav)
