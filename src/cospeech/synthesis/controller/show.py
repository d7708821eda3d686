"""From steps through a motion library to motion: the frames of the chosen segments, joined where they meet.

The paper does not say how segments are joined. ``motion.blending`` offers two ways: on an actor of the demo, 96 % of
the joins stay within the accelerations of the recorded motion with velocity-preserving blending, and 97 % with smooth
transitions. The latter are used, since they also suit actors who step and turn.
"""

from __future__ import annotations

import math

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.motion.blending import Transitions
from cospeech.synthesis.controller.control import Control

SLACK = 1e-9
"""Frame numbers are products of rounded numbers; they are whole where they differ by less."""


class Screen:
    """Shows segments of a library, one motion frame at a time, at any frame rate.

    Parameters
    ----------
    layer : the control layer whose library is shown.
    fps : frame rate of the motion to make; the library is resampled if it has another one.

    Attributes
    ----------
    shown : number of frames shown so far.
    """

    def __init__(self, layer: Control, fps: float) -> None:
        library = layer.library.at_rate(fps)
        self._transitions = Transitions(library.body, fps)
        self._root, self._rotations = library.poses.root_m, library.poses.rotations
        self._before = library.before
        records = layer.library.table["record"]
        lengths = library.table.groupby("record")["n_frames"].first()
        self._first = records.map(library.first).to_numpy(dtype=np.int64)
        self._last = self._first + records.map(lengths).to_numpy(dtype=np.int64) - 1
        self._start_s = layer.library.table["start_frame"].to_numpy(dtype=float) / layer.library.fps
        self._fps, self._step_s = fps, layer.step_s
        self.shown = 0

    @property
    def step(self) -> int:
        """The time step that the next frame belongs to."""
        return self._step_at((self.shown + 0.5) / self._fps)

    def _step_at(self, time_s: float) -> int:
        return math.floor(time_s / self._step_s + SLACK)

    def due(self, heard_s: float) -> bool:
        """Return whether the next frame is over when speech has been heard for ``heard_s`` seconds."""
        return self.shown + 1 <= heard_s * self._fps + SLACK

    def next(self, segment: int, frame: int) -> Floats:
        """Return the next frame (3 + 4 J,), which belongs to a time step that shows a frame of a segment."""
        time_s = (self.shown + 0.5) / self._fps
        within_s = time_s - self._step_at(time_s) * self._step_s
        place_s = self._start_s[segment] + frame * self._step_s + within_s
        index = min(self._first[segment] + math.floor(place_s * self._fps + SLACK), self._last[segment])
        before = self._before[index]
        self.shown += 1
        return self._transitions.step(
            self._root[index], self._rotations[index], self._root[before], self._rotations[before]
        )
