"""Images without their slow changes of brightness and without their finest noise, for optical flow and disparity."""

from __future__ import annotations

import cv2
import numpy as np

from cospeech.data.arrays import Flags, Plane, Singles

NARROW_PX, WIDE_PX = 0.8, 4.0
"""Standard deviations of the two Gaussians whose difference is the band."""

SPREAD = 32.0
"""Standard deviation that the band-passed face is scaled to, in grey levels, whatever its contrast."""

MOST_GAIN = 16.0
"""Largest gain, beyond which there is only noise to amplify."""


def bandpass(luma: Plane, gain: float) -> Plane:
    """Return the difference of two Gaussian filters of an image (H, W), times ``gain``, around 128."""
    narrow, wide = _filtered(luma)
    return np.asarray(cv2.addWeighted(narrow, gain, wide, -gain, 128.0, dtype=cv2.CV_8U), dtype=np.uint8)


def gain_for(luma: Plane, region: Flags) -> float:
    """Return the gain that gives the band-passed pixels of a region (H, W) the standard deviation ``SPREAD``."""
    narrow, wide = _filtered(luma)
    return min(MOST_GAIN, SPREAD / max(float((narrow - wide)[region].std()), 1e-3))


def _filtered(luma: Plane) -> tuple[Singles, Singles]:
    single = luma.astype(np.float32)
    narrow, wide = (cv2.GaussianBlur(single, (0, 0), sd) for sd in (NARROW_PX, WIDE_PX))
    return np.asarray(narrow, dtype=np.float32), np.asarray(wide, dtype=np.float32)
