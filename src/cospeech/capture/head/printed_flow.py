"""The flow as printed: from the reference image, and beyond 25 degrees from the previous image (Sargin 2006, 4.1.1).

The flow from the reference itself already fails at 15 to 20 degrees, and what is estimated from one frame to the next
accumulates its errors.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from cospeech.capture.head import reference, skin
from cospeech.capture.head.bandpass import bandpass
from cospeech.capture.head.disparity import find_disparities
from cospeech.capture.head.estimate import MISSING, Estimator, Matches, Measurement, State, euler
from cospeech.capture.head.flow import find_flow
from cospeech.capture.head.images import Frame
from cospeech.capture.head.pose import STILL, Pose
from cospeech.data.arrays import Floats, Plane

SWITCH_DEG = 25.0
"""Angle beyond which increments are estimated."""

REACH_PX = 6
"""How far a disparity may deviate from that of the nearest point of the previous pose."""


class Increments(Enum):
    """How the angles continue beyond ``SWITCH_DEG``.

    ``COMPOSED`` multiplies rotations; ``ADDED`` adds Euler angles, as printed (4.5), which drifts.
    """

    COMPOSED = "composed"
    ADDED = "added"


class _Banded(NamedTuple):
    """A frame and its band-passed images (H, W)."""

    frame: Frame
    left: Plane
    right: Plane


class PrintedFlow:
    """Measures the pose in one frame after another; see the module."""

    def __init__(self, estimator: Estimator, increments: Increments) -> None:
        self.estimator, self.increments = estimator, increments
        self._last: _Banded | None = None

    def step(self, frame: Frame, state: State) -> Measurement:
        """Return the pose in a frame of a stereo film, given what is known from those before it."""
        if frame.right is None:
            raise ValueError("increments need the disparities of a stereo pair")
        gain = self.estimator.reference.gain
        now = _Banded(frame, bandpass(frame.left[0], gain), bandpass(frame.right, gain))
        last, self._last = self._last, now
        measured = MISSING
        if np.abs(state.angles_deg).max() <= SWITCH_DEG or state.n_missed:
            measured = self._from_reference(now, state)
        beyond = measured.pose is None or np.abs(measured.angles_deg).max() > SWITCH_DEG
        if beyond and last is not None and not state.n_missed:
            return self._from_previous(last, now, state)
        return measured

    def _from_reference(self, now: _Banded, state: State) -> Measurement:
        """Return the pose by the flow from the reference image."""
        known = self.estimator.reference
        found, good = find_flow(known.banded, now.left, known.pixels, known.pixels)
        matches = self._matches(now, known.points_m[good], found[good], state, len(good))
        return self.estimator.measure(matches, state.pose)

    def _from_previous(self, last: _Banded, now: _Banded, state: State) -> Measurement:
        """Return the pose by the flow from the previous image, as an increment to the previous pose (4.5)."""
        known, optics = self.estimator.reference, self.estimator.optics
        ellipse = skin.find_ellipse(*last.frame.left[1:], self.estimator.region(state.pose), known.colour)
        if ellipse is None:
            return MISSING
        inside = reference.inside(last.left.shape, ellipse, reference.INSIDE)
        pixels = reference.corners(last.left, inside, known.face)
        points = optics.points(pixels, optics.depths(self._disparities(last, pixels, state.pose)))
        found, good = find_flow(last.left, now.left, pixels, pixels)
        good &= np.isfinite(points[:, 2])
        step = self.estimator.measure(self._matches(now, points[good], found[good], state, len(good)), STILL)
        if step.pose is None:
            return MISSING
        pose = step.pose.after(state.pose)
        added = self.increments is Increments.ADDED
        return step._replace(pose=pose, angles_deg=state.angles_deg + step.angles_deg if added else euler(pose))

    def _matches(self, now: _Banded, points_m: Floats, pixels: Floats, state: State, n_tried: int) -> Matches:
        kept = self.estimator.on_skin(now.frame, pixels, state.pose)
        seen = np.column_stack([pixels[kept], self._disparities(now, pixels[kept], state.pose)])
        return Matches(points_m[kept], seen, n_tried)

    def _disparities(self, now: _Banded, pixels: Floats, last: Pose) -> Floats:
        """Return the disparities (n,) of points near those of the previous pose, NaN where they are not valid."""
        optics = self.estimator.optics
        moved = last.points(self.estimator.reference.points_m)
        away = ((optics.pixels(moved)[None] - pixels[:, None]) ** 2).sum(axis=2)
        expected = optics.disparities(-moved[:, 2])[away.argmin(axis=1)]
        return find_disparities(now.left, now.right, pixels, expected, REACH_PX, self.estimator.reference.half_window)
