"""Errors of the captured head where its motion is known: a trial over image size, contrast and noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd

from cospeech.capture.head.tracker import Flow
from cospeech.data.arrays import Floats

WIDTHS_PX = (640, 320)
CONDITIONS = ((1.0, 1.5), (0.5, 1.5), (1.0, 6.0))
"""Contrast of the face, and standard deviation of the noise in grey levels."""

AMPLITUDES_DEG = np.array([24.0, 30.0, 21.0])
CYCLES_PER_S = np.array([0.6, 0.83, 0.47])
"""Largest angles x, y and z, and how often per second they swing."""

BLINK_EVERY_S, BLINK_S, OPENINGS_PER_S = 0.8, 0.15, 3.0
"""When the eyes are shut, for how long, and how often the mouth opens."""

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Case:
    """One trial: the size, contrast and noise of the images, and how the head is captured in them."""

    width_px: int
    contrast: float
    noise: float
    flow: Flow
    stereo: bool

    @property
    def settings(self) -> dict[str, str]:
        """The settings of ``capture.head`` that differ from those of the run."""
        return {"flow": self.flow.value, "smoothing": "none"}


@dataclass(frozen=True)
class Trial:
    """The motion of a head: angles (T, 3) in degrees, and how far the eyes are shut and the mouth is open (T,)."""

    angles_deg: Floats
    blink: Floats
    mouth: Floats


def cases() -> Iterator[Case]:
    """Yield the cases of the trial: both flows with a stereo pair, and a single camera."""
    for width_px, (contrast, noise) in product(WIDTHS_PX, CONDITIONS):
        for flow, stereo in ((Flow.WARPED, True), (Flow.PRINTED, True), (Flow.WARPED, False)):
            yield Case(width_px, contrast, noise, flow, stereo)


def trial(n_frames: int, fps: float) -> Trial:
    """Return a motion about all three axes at once, with blinks and a mouth that opens, which starts at rest."""
    time_s = np.arange(n_frames) / fps
    angles = AMPLITUDES_DEG * np.sin(2.0 * np.pi * time_s[:, None] * CYCLES_PER_S)
    blink = (time_s % BLINK_EVERY_S > BLINK_EVERY_S - BLINK_S).astype(float)
    return Trial(angles, blink, 0.5 - 0.5 * np.cos(2.0 * np.pi * OPENINGS_PER_S * time_s))


def rows(case: Case, planted_deg: Floats, found: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of one case as rows of a table ``head_accuracy``.

    Parameters
    ----------
    planted_deg : (T, 3) true angles relative to the first frame. found : the captured poses (schema ``head_pose``).
    """
    off = np.abs(found[[f"{axis}_deg" for axis in AXES]].to_numpy(dtype=float) - planted_deg)
    known = off[np.isfinite(off).all(axis=1)]
    return pd.DataFrame(
        {
            "width_px": case.width_px,
            "contrast": case.contrast,
            "noise": case.noise,
            "flow": case.flow.value,
            "depth": "disparity" if case.stereo else "ellipsoid",
            "axis": AXES,
            "mean_deg": known.mean(axis=0) if len(known) else np.nan,
            "max_deg": known.max(axis=0) if len(known) else np.nan,
            "share_lost": 1.0 - len(known) / len(off),
            "n_frames": len(off),
        }
    )
