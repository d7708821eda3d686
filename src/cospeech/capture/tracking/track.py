"""A take from its first frame to its last: pictures in, sights of the markers out."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from cospeech.capture.tracking import clicks, colour, first_positions, footage
from cospeech.capture.tracking.detections import Sights, confirmed, film
from cospeech.capture.tracking.robust_tracker import RobustTracker
from cospeech.capture.tracking.thesis_tracker import ThesisTracker
from cospeech.geometry.camera import Camera

METHODS = ("robust", "thesis")


def follow(
    films: Sequence[footage.Film],
    cameras: Sequence[Camera],
    method: str,
    n_frames: int,
    *,
    clicked: pd.DataFrame | None = None,
    corrections: pd.DataFrame | None = None,
    where: str,
) -> Sights:
    """Return the markers of a take in every view and frame.

    Parameters
    ----------
    films, cameras : one film for each camera, checked by ``footage.check``, which gives ``n_frames``.
    method : one of ``METHODS``.
    clicked : the markers in frame 0; without it they are found by colour.
    corrections : positions that a person set; they override what is measured.
    where : what errors call the take.
    """
    by_hand = {} if corrections is None else clicks.by_frame(corrections, cameras)
    frames: list[Sights] = []
    tracker: RobustTracker | ThesisTracker | None = None
    for frame, pictures in enumerate(footage.read(films, n_frames)):
        if tracker is None:
            widths = [camera.size_px[0] for camera in cameras]
            mixers = colour.mixers(colour.skin(pictures, widths))
            first = (
                first_positions.find(pictures, cameras, mixers, where)
                if clicked is None
                else first_positions.from_clicks(clicked, cameras, where)
            )
            tracker = (
                RobustTracker(cameras, first, mixers, films[0].fps)
                if method == "robust"
                else ThesisTracker(cameras, first, mixers)
            )
        frames.append(tracker.step(pictures, by_hand.get(frame, ())))
    found = film(frames)
    return confirmed(found) if method == "robust" else found
