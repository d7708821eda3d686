"""Tracking of a whole take: from the images of all cameras to marker detections in every frame."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from cospeech.capture.tracking import clicks, colour, first_positions, footage
from cospeech.capture.tracking.detections import Detections, confirmed, stack
from cospeech.capture.tracking.robust_tracker import RobustTracker
from cospeech.capture.tracking.thesis_tracker import ThesisTracker
from cospeech.geometry.camera import Camera

METHODS = ("robust", "thesis")


def track_markers(
    films: Sequence[footage.Film],
    cameras: Sequence[Camera],
    method: str,
    n_frames: int,
    *,
    clicked: pd.DataFrame | None = None,
    corrections: pd.DataFrame | None = None,
    where: str,
) -> Detections:
    """Return the markers of a take in every view and frame.

    Parameters
    ----------
    films, cameras : one film per camera, checked by ``footage.check``.
    method : one of ``METHODS``.
    n_frames : number of frames to track, as returned by ``footage.check``.
    clicked : clicks on the markers in frame 0; without them, the markers are found by colour.
    corrections : positions set by a person, which override the measured ones.
    where : name of the take in error messages.
    """
    by_hand = {} if corrections is None else clicks.by_frame(corrections, cameras)
    frames: list[Detections] = []
    tracker: RobustTracker | ThesisTracker | None = None
    for frame, pictures in enumerate(footage.read(films, n_frames)):
        if tracker is None:
            widths = [camera.size_px[0] for camera in cameras]
            unmixers = colour.unmixers(colour.estimate_skin(pictures, widths))
            first = (
                first_positions.find(pictures, cameras, unmixers, where)
                if clicked is None
                else first_positions.from_clicks(clicked, cameras, where)
            )
            tracker = (
                RobustTracker(cameras, first, unmixers, films[0].fps)
                if method == "robust"
                else ThesisTracker(cameras, first, unmixers)
            )
        frames.append(tracker.step(pictures, by_hand.get(frame, ())))
    found = stack(frames)
    return confirmed(found) if method == "robust" else found
