"""Where motion goes: the interface between the engine and its outputs."""

from __future__ import annotations

from typing import Protocol

from cospeech.data.arrays import Floats


class Output(Protocol):
    """Shows or keeps frames of motion.

    An output learns the body and the frame rate from its constructor. It handles its own errors: ``show`` must not
    raise, so that the other outputs continue.

    Attributes
    ----------
    in_real_time : whether somebody watches. If so, the engine holds back sound that arrives faster than it is spoken.
    """

    in_real_time: bool

    def show(self, frame: int, time_s: float, pose: Floats) -> None:
        """Take the next frame.

        Parameters
        ----------
        frame, time_s : its number, counted from 0, and the time of its middle in seconds.
        pose : (3 + 4 J,) root position in metres, and the rotations w, x, y, z of the joints in parent space. Of a
            head that moves alone, its angles (3,) in degrees; ``heads.OnBody`` puts it onto a body.
        """

    def close(self) -> None:
        """Complete what was begun; no frame follows.

        Raises
        ------
        UserError : if it cannot be completed.
        """
