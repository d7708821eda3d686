"""Measure the speed, the drift and the failures of head capture: python bench/head.py [seconds of film]

The virtual head is filmed in memory by the stereo camera of the studio (640x480, 30 frames/s) and tracked on one
thread. A film of several minutes shows whether the errors grow: the mean and the largest are printed per minute.
Newton's method is searched for failures over angles of rotation, on sets of 60 points of a face with 2 mm of noise,
against the closed form.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator

import cv2
import numpy as np

from cospeech.capture.head import accuracy, optics, track
from cospeech.geometry.newton_rotation import Variant, newton_rotation
from cospeech.geometry.rigid import align
from cospeech.geometry.rotation import from_vectors
from cospeech.studio import face, stereo
from cospeech.workflow import config

GOAL_MS = 40.0
FACE_M = (0.05, 0.06, 0.02)


class Timed:
    """An iterator that sums the time that making its items takes."""

    def __init__(self, items: Iterator[object]) -> None:
        self.items, self.seconds = items, 0.0

    def __iter__(self) -> Iterator[object]:
        return self

    def __next__(self) -> object:
        began = time.process_time()
        try:
            return next(self.items)
        finally:
            self.seconds += time.process_time() - began


def follow(duration_s: float) -> bool:
    """Print the speed and, per minute, the errors over a film, and return whether tracking reaches its goal."""
    settings = config.defaults()["capture"]["head"]
    planted = accuracy.trial(round(duration_s * stereo.FPS), stereo.FPS)
    acting = face.Acting(planted.angles_deg, face.pivoted(planted.angles_deg), planted.blink, planted.mouth)
    cameras = stereo.cameras()
    own, _ = optics.rectified(cameras)
    views = Timed(face.frames(acting, face.appearance("ada", 1), cameras))
    began = time.process_time()
    found = track.track_images(views, own, settings, stereo.FPS, "bench").table
    each_ms = 1000.0 * (time.process_time() - began - views.seconds) / len(found)
    signed = found[["x_deg", "y_deg", "z_deg"]].to_numpy() - planted.angles_deg
    print(f"{duration_s:.0f} s: {each_ms:.1f} ms per stereo frame (goal: {GOAL_MS:g})")
    print(f"{'minute':>8}{'mean error':>14}{'largest':>12}{'signed mean (x, y, z)':>28}{'lost':>8}")
    minute = round(60 * stereo.FPS)
    for number, first in enumerate(range(0, len(signed), minute), start=1):
        part = signed[first : first + minute]
        bias = " ".join(f"{value:+.3f}" for value in np.nanmean(part, axis=0))
        print(
            f"{number:>8}{np.nanmean(np.abs(part)):>10.3f} deg{np.nanmax(np.abs(part)):>8.2f} deg{bias:>28}"
            f"{np.isnan(part[:, 0]).mean():>8.1%}"
        )
    return each_ms <= GOAL_MS


def map_failures(n_trials: int = 100) -> None:
    """Print how often Newton's method ends at the optimum, and after how many steps, over angles of rotation."""
    draw = np.random.default_rng(1)
    print("rotation  " + "".join(f"{variant.value:>24}" for variant in Variant))
    for degrees in (5, 20, 40, 60, 80, 100, 120, 140, 160, 175):
        line = ""
        for variant in Variant:
            found, steps = 0, []
            for _ in range(n_trials):
                axis = draw.normal(size=3)
                turn = from_vectors(np.radians(degrees) * axis / np.linalg.norm(axis))
                source = draw.normal(size=(60, 3)) * FACE_M
                target = source @ turn.T + draw.normal(size=source.shape) * 0.002
                search = newton_rotation(source, target, variant)
                if np.abs(search.rotation - align(source, target[None])[0][0]).max() < 1e-9:
                    found, steps = found + 1, [*steps, search.n_steps]
            line += f"{found / n_trials:>12.0%} {f'{np.mean(steps):.1f} steps' if steps else '':>11}"
        print(f"{degrees:>5} deg {line}")


if __name__ == "__main__":
    cv2.setNumThreads(1)
    follow(2.0)  # compile
    met = follow(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
    map_failures()
    sys.exit(0 if met else "head capture is slower than its goal")
