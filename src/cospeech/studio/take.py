"""One take: the performance filmed by all cameras, and the true positions of the markers; or the head in stereo."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.data import tables
from cospeech.geometry.camera import Camera
from cospeech.motion import skeleton
from cospeech.studio import dress, face, film, planted, stage
from cospeech.studio.face import Acting, Appearance


def shoot(
    motion: pd.DataFrame, actor: str, cameras: Sequence[Camera], paths: Sequence[str | Path], seed: int
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Film a motion table from all cameras, and return the true ``markers_2d`` and ``markers_3d`` tables.

    Parameters
    ----------
    actor : the actor who wears the markers.
    paths : path of the film of each camera.
    """
    fps = skeleton.frame_rate(motion)
    limbs, markers = stage.limbs(motion), dress.wear(motion, dress.places(actor, seed))
    seen = np.empty((len(cameras), *markers.shape[:2]))
    for camera, path, shown in zip(cameras, paths, seen, strict=True):
        with tables.replacing(path) as temporary:
            film.encode(temporary, film.record_visibility(film.frames(camera, limbs, markers, seed), shown), fps)
    return planted.in_views(cameras, markers, seen), planted.in_world(markers, seen, fps)


def shoot_head(
    acting: Acting, looks: Appearance, cameras: Sequence[Camera], paths: Sequence[str | Path], fps: float, seed: int
) -> None:
    """Film a talking head from all cameras at once.

    Parameters
    ----------
    acting : what the head does in each frame.
    looks : the look of the actor.
    paths : path of the film of each camera.
    fps : frame rate of the films.
    """
    with ExitStack() as stack:
        temporary = [stack.enter_context(tables.replacing(path)) for path in paths]
        reels = [stack.enter_context(film.Reel(path, fps)) for path in temporary]
        for views in face.frames(acting, looks, cameras, seed=seed):
            for reel, planes in zip(reels, views, strict=True):
                reel.add(planes)
