"""Compare the speed of inverse kinematics with scipy's Levenberg-Marquardt: python bench/kinematics.py

Both estimate the 26 degrees of freedom of the body model from 15 noisy markers, starting each frame from the pose of
the previous one. Ours uses analytic derivatives in compiled code, scipy's (MINPACK) finite differences of the same
compiled residuals.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.optimize import least_squares

from cospeech.capture.fitting import inverse_kinematics as ik
from cospeech.capture.fitting.body_model import KINDS, MARKER_PART, NAMES, PARENTS, TOLERANCES_M, BodyModel
from cospeech.motion import markers, skeleton

FRAMES, SCIPY_FRAMES, GOAL = 6_000, 100, 5_000


def subject(draw: np.random.Generator) -> BodyModel:
    """Return a body with the usual proportions and markers within 10 cm of the joints."""
    still = skeleton.forward(np.zeros((1, 3)), np.zeros((1, len(skeleton.JOINTS), 3)))
    joint = {"thorax": "chest", "left_leg": "left_thigh", "right_leg": "right_thigh"}
    places = np.array([still[joint.get(name, name)][0] for name in NAMES])
    offsets = places - np.where(PARENTS[:, None] >= 0, places[PARENTS], 0.0)
    return BodyModel(offsets, draw.uniform(-0.1, 0.1, (len(markers.NAMES), 3)), (0.0, 0.0))


def stepped(model: BodyModel, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the orientations and positions of the body parts after a ``step`` (26,) from the static pose."""
    turn, slide = np.tile(np.eye(3), (len(NAMES), 1, 1)), model.offsets_m.copy()
    ik._step(turn, slide, step, ik.PART, ik.AXIS, ik.SLIDES)
    turns, places = np.empty_like(turn), np.empty_like(slide)
    ik._place(turn, slide, model.offsets_m, PARENTS, KINDS, turns, places)
    return turns, places


def film(model: BodyModel, draw: np.random.Generator) -> np.ndarray:
    """Return markers (FRAMES, M, 3), with 0.5 mm of noise, of a body that moves in all degrees of freedom."""
    hertz, phase = draw.uniform(0.1, 0.6, len(ik.PART)), draw.uniform(0, 6, len(ik.PART))
    reach = np.where(ik.SLIDES, 0.05, 0.4)
    middle = np.where(np.isin(ik.PART, ik.ELBOWS), -0.8, 0.0)
    seen = np.empty((FRAMES, len(markers.NAMES), 3))
    for frame in range(FRAMES):
        turns, places = stepped(model, middle + reach * np.sin(2 * np.pi * hertz * frame / 20 + phase))
        seen[frame] = places[MARKER_PART] + np.einsum("mij,mj->mi", turns[MARKER_PART], model.marker_places_m)
    return seen + draw.normal(0, 0.0003, seen.shape)


def scipy_rate(model: BodyModel, seen: np.ndarray) -> float:
    """Return the speed of scipy in frames per second."""
    residual, weight = np.empty((len(markers.NAMES), 3)), 1.0 / TOLERANCES_M

    def residuals(step: np.ndarray, places: np.ndarray) -> np.ndarray:
        turns, at = stepped(model, step)
        ik._residuals(turns, at, MARKER_PART, model.marker_places_m, weight, places, residual)
        return residual.ravel().copy()

    step, start = np.zeros(len(ik.PART)), time.perf_counter()
    for places in seen[:SCIPY_FRAMES]:
        step = least_squares(residuals, step, args=(places,), method="lm").x
    return SCIPY_FRAMES / (time.perf_counter() - start)


def main() -> None:
    """Print both speeds and their ratio."""
    draw = np.random.default_rng(0)
    model = subject(draw)
    seen = film(model, draw)
    ik.solve(model, seen[:2])  # compile
    start = time.perf_counter()
    steps = ik.solve(model, seen).steps
    ours = FRAMES / (time.perf_counter() - start)
    theirs = scipy_rate(model, seen)
    print(f"inverse kinematics: {ours:,.0f} frames/s, {steps.mean():.1f} steps per frame, goal {GOAL:,}")
    print(f"scipy:              {theirs:,.0f} frames/s, ours is {ours / theirs:,.0f} times as fast")
    print("goal reached" if ours >= GOAL else "GOAL MISSED")


if __name__ == "__main__":
    main()
