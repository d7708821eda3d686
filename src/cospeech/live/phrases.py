"""Motion of gesture phrases whose ends are not known yet: recorded gestures of their class, joined as they come.

Unit selection (``motion.unit_selection``) looks for the best sequence of recorded gestures for phrases of known
durations. While speech is heard, neither the phrases to come nor the end of the current one are known. So a phrase
starts with the recorded gesture of its class that begins nearest to the pose shown, with the distance of equation
6.2 (Özkul 2012). If the phrase is longer than the gesture, another one of the class follows; if it is shorter, the
gesture is cut. At each join, the difference between the pose shown and the new gesture decays within ``JOIN_S``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.geometry import rotation
from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.motion.library import Library

JOIN_S = 0.4
"""Time in which the difference at a join decays, in seconds."""

JOINTS = [skeleton.JOINTS.index(name) for name in assembly.SYNTHESISED]
"""The joints that move: arms and hands. All others stand still."""


class Player:
    """Plays recorded gestures, frame by frame. It begins with hanging arms.

    Parameters
    ----------
    gestures : gesture phrases of the training records (schema ``segments``).
    motions : motion table of each training record.
    fps : frame rate of the frames.

    Raises
    ------
    UserError : if a record has no motion, or no phrase contains a frame.
    """

    def __init__(self, gestures: pd.DataFrame, motions: Mapping[str, pd.DataFrame], fps: float) -> None:
        recorded = unit_selection.templates(gestures, motions).table.rename(columns={"first_frame": "start_frame"})
        library = Library.of_motions(recorded, motions).at_rate(fps)
        of_segment = recorded.set_index(["record", "segment"])["label"].to_dict()
        self._labels = np.array(
            [of_segment[key] for key in zip(library.table["record"], library.table["segment"], strict=True)],
            dtype=object,
        )
        self._first, self._end = library.start, library.end
        self._recorded = rotation.from_quaternions(library.poses.rotations[:, JOINTS])
        self._shown = np.broadcast_to(np.eye(3), (len(JOINTS), 3, 3)).copy()
        self._gap = np.zeros((len(JOINTS), 3))
        self._n_join = max(1, round(JOIN_S * fps))
        self._n_joined = self._n_join
        self._label: str | None = None
        self._unit = -1
        self._place = 0

    def play(self, label: str) -> None:
        """Start a phrase with the next frame. If no training record has such a gesture, the pose is held."""
        self._label = label
        self._start_unit()

    def frame(self) -> Floats:
        """Return the next frame, (3 + 4 J,): root position in metres, and the rotations w, x, y, z of all joints."""
        if self._unit >= 0 and self._place >= self._end[self._unit]:
            self._start_unit()
        if self._unit >= 0:
            self._n_joined = min(self._n_joined + 1, self._n_join)
            share = self._n_joined / self._n_join
            left = 1.0 - share * share * (3.0 - 2.0 * share)  # from 1 to 0, with speed 0 at both ends
            self._shown = rotation.from_vectors(left * self._gap) @ self._recorded[self._place]
            self._place += 1
        pose = np.zeros(3 + 4 * len(skeleton.JOINTS))
        rotations = pose[3:].reshape(-1, 4)
        rotations[:, 0] = 1.0
        rotations[JOINTS] = rotation.to_quaternions(self._shown)
        return pose

    def _start_unit(self) -> None:
        """Take the gesture of the class that begins nearest to the pose shown, but not the same one twice running."""
        candidates = np.flatnonzero(self._labels == self._label)
        if len(candidates) > 1:
            candidates = candidates[candidates != self._unit]
        if not len(candidates):
            self._unit = -1
            return
        gaps = rotation.to_vectors(self._shown @ np.swapaxes(self._recorded[self._first[candidates]], -1, -2))
        nearest = int(np.argmin((gaps**2).sum(axis=(1, 2))))
        self._unit, self._gap = int(candidates[nearest]), gaps[nearest]
        self._place, self._n_joined = int(self._first[self._unit]), 0
