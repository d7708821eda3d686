"""The static pose at the start of a take: upright, facing +z, with arms hanging straight or in a T-pose.

With hanging arms and palms to the thighs, all joint angles are zero and the joint axes are parallel to the world
axes. In a T-pose (palms down), the same holds but for the arms, which are rotated by 90 degrees to the sides. Once
the joint centres are known, a marker's position in this pose therefore gives its position in the frame of its body
part.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError

STILL_M = 0.015
"""Largest RMS deviation of a marker from its mean position while the actor stands still."""


def static_pose(
    places_m: Floats, names: Sequence[str], fps: float, seconds: float, optional: Collection[str] = ()
) -> Floats:
    """Return the mean positions (M, 3) of the markers over the first ``seconds`` of a take ``places_m`` (T, M, 3).

    An ``optional`` marker that is not seen in that time is NaN.

    Raises
    ------
    UserError : if any other marker is not seen in that time, or if the actor moves.
    """
    still = places_m[: max(1, round(seconds * fps))]
    seen = ~np.any(np.isnan(still), axis=2)
    for index, name in enumerate(names):
        if name not in optional and not seen[:, index].any():
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
            "of the range-of-motion take; record it again standing still, or shorten capture.static_s"
        )
    return middle
