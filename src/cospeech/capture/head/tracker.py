"""Tracking of the pose of one head through the frames of a film.

The flow to a reference frame does not drift, but fails when the head has turned too far. It is helped in one of two
ways, ``warped_flow`` and ``printed_flow``.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from cospeech.capture.head import face as faces
from cospeech.capture.head import pairing
from cospeech.capture.head import reference as face_reference
from cospeech.capture.head.estimate import FEWEST_POINTS, MODEL_ERROR, THRESHOLD, Estimator, Measurement, State
from cospeech.capture.head.images import Frame
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.pose import RigidFit
from cospeech.capture.head.printed_flow import Increments, PrintedFlow
from cospeech.capture.head.warped_flow import WarpedFlow
from cospeech.errors import UserError

FAST = 0.12
"""Motion between two frames, in widths of the face, that is fast enough to explain a loss."""

RIVAL = 0.6
"""Width of a second face, as a share of that of the widest, from which on it is not clear whom the film shows."""


class Flow(Enum):
    """What the optical flow starts from: ``warped_flow`` or ``printed_flow``."""

    WARPED = "warped"
    PRINTED = "printed"


@dataclass(frozen=True)
class Method:
    """The choices of ``capture.head`` that concern a single frame."""

    flow: Flow
    rigid: RigidFit
    increments: Increments
    head_width_m: float


class Tracker:
    """Tracks the head that a reference frame shows.

    Parameters
    ----------
    first : the reference frame. face : the face detected in it.
    where : name of the record, for messages.

    Attributes
    ----------
    estimator : with the reference and the optics.
    losses : why the head may have been lost, by the first frame of each loss.
    right_dark : the frames in which the right image is dark, so that only the left one counts.
    """

    def __init__(self, first: Frame, face: faces.Box, optics: Optics, method: Method, where: str) -> None:
        tolerance = MODEL_ERROR if optics.baseline_m is None else THRESHOLD
        self.estimator = Estimator(optics, _reference(first, face, optics, method, where), method.rigid, tolerance)
        self.losses: dict[int, str] = {}
        self.right_dark: list[int] = []
        self._flow = (
            WarpedFlow(self.estimator)
            if method.flow is Flow.WARPED
            else PrintedFlow(self.estimator, method.increments)
        )
        self._state = State()
        self._speed_px = 0.0

    def step(self, frame: Frame) -> Measurement:
        """Return the pose of the head in the next frame, of which the first is the reference frame."""
        state = self._state
        if frame.right is not None and pairing.is_dark(frame.right):
            self.right_dark.append(frame.number)
        measured = self._flow.step(frame, state)
        if measured.pose is None:
            if not state.n_missed:
                self.losses[frame.number] = self._reason(frame)
            state.n_missed += 1
        else:
            self._speed_px = 0.0 if state.n_missed else self.estimator.shift_px(state.pose, measured.pose)
            self._state = State(measured.pose, measured.angles_deg)
        return measured

    def _reason(self, frame: Frame) -> str:
        """Return why the head, tracked until now, may be lost in a frame."""
        known, optics = self.estimator.reference, self.estimator.optics
        x, y = optics.pixels(self._state.pose.points(known.points_m.mean(axis=0)))
        (width, height), around = optics.size_px, known.face.width / 2
        if pairing.is_dark(frame.left[0]) or (frame.right is not None and pairing.is_dark(frame.right)):
            return "where an image is dark"
        speed_px = max(self._speed_px, self._jump_px(frame))
        if speed_px > FAST * known.face.width:
            return f"after a motion of {speed_px:.0f} pixels per frame, too fast for the optical flow"
        if not (around < x < width - around and around < y < height - around):
            return "at the border of the image"
        return "hidden, blurred or turned away"

    def _jump_px(self, frame: Frame) -> float:
        """Return how far the nearest detected face is from where the last one was; 0 if there is none."""
        known, optics = self.estimator.reference, self.estimator.optics
        moved = optics.pixels(self._state.pose.points(known.points_m)) - optics.pixels(known.points_m)
        last = np.array(known.face.middle) + moved.mean(axis=0)
        away = (float(np.linalg.norm(np.array(box.middle) - last)) for box in faces.find_faces(frame.left[0]))
        return min(away, default=0.0)


def find_face(frame: Frame, where: str) -> faces.Box | None:
    """Return the face in a frame, if there is one.

    Raises
    ------
    UserError : if there are two of similar size, or if the image is dark.
    """
    pairing.check_light(frame.left[0], f"{where}: frame {frame.number}")
    found = faces.find_faces(frame.left[0])
    if not found:
        return None
    largest = max(found, key=lambda box: box.width)
    rivals = [box for box in found if box.width >= RIVAL * largest.width]
    if len(rivals) > 1:
        places = " and ".join(f"({box.middle[0]:.0f}, {box.middle[1]:.0f})" for box in rivals[:2])
        raise UserError(
            f"{where}: frame {frame.number}: two faces, at {places} pixels; film one person, or crop the film to one"
        )
    return largest


def _reference(first: Frame, face: faces.Box, optics: Optics, method: Method, where: str) -> face_reference.Reference:
    """Return what the first frame tells about the face.

    Raises
    ------
    UserError : if the images of a pair do not fit each other, or if the face has too little structure.
    """
    at = f"{where}: frame {first.number}"
    if first.right is None:
        reference = face_reference.from_one(first.left, face, optics, method.head_width_m)
    else:
        disparity = pairing.face_disparity(pairing.Views(first.left[0], first.right, at), face, optics)
        reference = face_reference.from_pair(first.left, first.right, face, optics, disparity)
    if len(reference.pixels) < FEWEST_POINTS:
        raise UserError(
            f"{at}: the face shows {len(reference.pixels)} points to track, fewer than {FEWEST_POINTS}; film it "
            "larger, sharper or in better light"
        )
    return reference
