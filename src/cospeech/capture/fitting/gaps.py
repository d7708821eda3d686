"""Interpolation of long marker gaps in the frame of the trunk, so that a hidden hand moves smoothly with the body."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from cospeech.capture.fitting.joint_centres import to_local
from cospeech.data.arrays import Floats


def bridge_gaps(places_m: Floats, trunk: tuple[Floats, Floats]) -> Floats:
    """Return positions (T, M, 3) in metres with the gaps of all markers filled, NaN where the trunk is lost too.

    Gaps are interpolated in the frame of the trunk by the monotone cubic of Fritsch and Carlson (SIAM J. Numer. Anal.
    1980), which does not overshoot. Before its first and after its last detection, a marker rests relative to the
    trunk. A marker that is never detected stays NaN.

    Parameters
    ----------
    trunk : rotations (T, 3, 3) and translations (T, 3) of the trunk in the world, NaN where lost.
    """
    rotations, shifts = trunk
    filled = places_m.copy()
    for marker in range(places_m.shape[1]):
        own = to_local(rotations, shifts, places_m[:, marker])
        known = np.flatnonzero(~np.isnan(own[:, 0]))
        gap = np.flatnonzero(np.isnan(places_m[:, marker, 0]))
        if len(known) < 2:
            continue
        inside = PchipInterpolator(known, own[known])(np.clip(gap, known[0], known[-1]))
        filled[gap, marker] = np.einsum("tij,tj->ti", rotations[gap], inside) + shifts[gap]
    return filled
