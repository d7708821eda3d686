"""Markers that stay lost for long: carried along with the trunk, so that a hidden hand goes smoothly on its way."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from cospeech.capture.fitting.joint_centres import within
from cospeech.data.arrays import Floats


def bridged(places_m: Floats, trunk: tuple[Floats, Floats]) -> Floats:
    """Return places (T, M, 3) in metres with the gaps of every marker bridged, NaN where the trunk is lost too.

    A gap is bridged in the frame of the trunk by the monotone cubic of Fritsch and Carlson (SIAM J. Numer.
    Anal. 1980), which overshoots neither side; before a marker is first seen, and after it is last seen, it rests
    there. A marker that is never seen stays NaN.

    Parameters
    ----------
    trunk : its rotations (T, 3, 3) and shifts (T, 3) in the world, NaN where lost.
    """
    rotations, shifts = trunk
    filled = places_m.copy()
    for marker in range(places_m.shape[1]):
        own = within(rotations, shifts, places_m[:, marker])
        known = np.flatnonzero(~np.isnan(own[:, 0]))
        gap = np.flatnonzero(np.isnan(places_m[:, marker, 0]))
        if len(known) < 2:
            continue
        inside = PchipInterpolator(known, own[known])(np.clip(gap, known[0], known[-1]))
        filled[gap, marker] = np.einsum("tij,tj->ti", rotations[gap], inside) + shifts[gap]
    return filled
