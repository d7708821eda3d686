"""The static pose: upright, arms hanging straight, palms to the thighs, facing +z, at the start of a take.

It is the pose of all angles zero. The joints' axes are those of the world in it, so that every marker's place there
is its place in the frame of its body part, once the joint centres are known.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError

STILL_M = 0.015
"""How far a marker may stray (root mean square) from its mean place while the actor stands still."""


def static_pose(
    places_m: Floats, names: Sequence[str], fps: float, seconds: float, spare: Collection[str] = ()
) -> Floats:
    """Return the mean places (M, 3) of the markers over the first ``seconds`` of a take, places (T, M, 3).

    A marker of ``spare`` that is never seen in that time is NaN.

    Raises
    ------
    UserError : where any other marker is never seen in that time, or the actor moves.
    """
    still = places_m[: max(1, round(seconds * fps))]
    seen = ~np.any(np.isnan(still), axis=2)
    for index, name in enumerate(names):
        if name not in spare and not seen[:, index].any():
            raise UserError(
                f"static pose: marker '{name}' is not seen in the first {seconds:g} s of the range-of-motion take; "
                "begin the take with the static pose in view of the cameras"
            )
    count = np.where(seen.any(axis=0), seen.sum(axis=0), np.nan)
    middle = np.nansum(np.where(seen[:, :, None], still, np.nan), axis=0) / count[:, None]
    stray = np.sqrt(np.nansum((still - middle) ** 2, axis=(0, 2)) / np.nan_to_num(count, nan=1.0))
    worst = int(np.argmax(stray))
    if stray[worst] > STILL_M:
        raise UserError(
            f"static pose: marker '{names[worst]}' moves by {stray[worst] * 1000:.0f} mm in the first {seconds:g} s "
            "of the range-of-motion take; stand still there, or shorten capture.static_s"
        )
    return middle
