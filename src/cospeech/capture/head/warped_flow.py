"""The flow from the reference image, warped by the previous pose.

The reference, drawn as the camera would see it had the head not moved since the previous frame, differs from the
current image by the motion of one frame only. Nothing accumulates, because it is always the same reference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cospeech.capture.head import face as faces
from cospeech.capture.head import surface
from cospeech.capture.head.aligned import Aligned
from cospeech.capture.head.bandpass import bandpass
from cospeech.capture.head.estimate import MISSING, Estimator, Matches, Measurement, State
from cospeech.capture.head.flow import find_flow
from cospeech.capture.head.images import Frame
from cospeech.capture.head.pose import Pose
from cospeech.geometry.rotation import angles_deg

MARGIN_PX = 28
"""How far the window in which the flow is searched reaches beyond the face."""

REACH_PX = 6
"""How far a disparity may deviate from the one that the pose predicts."""

AGAIN_DEG, AGAIN_PX = 3.0, 6.0
"""Motion between two frames above which the reference is warped once more, by the new pose."""

SEARCH_EVERY = 5
"""Every how many frames a lost face is searched by the detector."""


@dataclass
class WarpedFlow:
    """Measures the pose in one frame after another; see the module."""

    estimator: Estimator

    def step(self, frame: Frame, state: State) -> Measurement:
        """Return the pose in a frame, given what is known from those before it."""
        measured = self._warped_by(state.pose, frame)
        if measured.pose is not None and self._moved_far(state.pose, measured.pose):
            again = self._warped_by(measured.pose, frame)
            return again if again.n_points > measured.n_points else measured
        if measured.pose is None and state.n_missed % SEARCH_EVERY == SEARCH_EVERY - 1:
            tried = [self._warped_by(pose, frame) for pose in self._guesses(frame, state.pose)]
            return max(tried, key=lambda one: one.n_points, default=measured)
        return measured

    def _moved_far(self, before: Pose, after: Pose) -> bool:
        turned = float(angles_deg(after.rotation @ before.rotation.T))
        return turned > AGAIN_DEG or self.estimator.shift_px(before, after) > AGAIN_PX

    def _warped_by(self, expected: Pose, frame: Frame) -> Measurement:
        """Return the pose by the flow from the reference image warped by an expected pose."""
        known, optics = self.estimator.reference, self.estimator.optics
        warped = surface.warp(known.banded, known.surface, optics, expected, MARGIN_PX)
        if warped is None:
            return MISSING
        moved, normals = expected.points(known.points_m), known.normals @ expected.rotation.T
        usable = surface.visible(warped, optics, moved, normals)
        (x, y), (height, width) = warped.corner, warped.picture.shape
        banded = bandpass(frame.left[0][y : y + height, x : x + width], known.gain)
        start = optics.pixels(moved[usable]) - warped.corner
        found, good = find_flow(warped.picture, banded, start, start)
        good[good] = self.estimator.on_skin(frame, found[good] + warped.corner, expected)
        found = found[good]
        disparities = np.full(len(found), np.nan)
        if frame.right is not None:
            aligned = Aligned(frame.right, warped, optics, known.gain)
            disparities = aligned.disparities(banded, found, REACH_PX, known.half_window)
        seen = np.column_stack([found + warped.corner, disparities])
        measured = self.estimator.measure(Matches(known.points_m[usable][good], seen, len(start)), expected)
        if measured.pose is None or frame.right is not None:
            return measured
        places = np.full((len(known.points_m), 2), np.nan, dtype=np.float32)
        places[np.flatnonzero(usable)[good]] = seen[:, :2]
        return measured._replace(seen=places)

    def _guesses(self, frame: Frame, last: Pose) -> list[Pose]:
        """Return poses to try for a head that was lost: where a face is detected, turned as it was or not at all."""
        known, optics = self.estimator.reference, self.estimator.optics
        boxes = faces.find_faces(frame.left[0])
        if not boxes:
            return []
        middle = known.points_m.mean(axis=0)
        before = optics.pixels(last.points(middle))
        box = min(boxes, key=lambda one: float(np.linalg.norm(np.array(one.middle) - before)))
        scale = box.width / known.face.width
        off = optics.pixels(middle) - known.face.middle
        place = optics.points(np.array(box.middle) + scale * off, np.array(-middle[2] / scale))
        return [Pose(turn, place - turn @ middle) for turn in (np.eye(3), last.rotation)]
