"""Time blending and transitions, frame by frame: python bench/blending.py

One step of ``Blender`` or ``Transitions`` moves all 17 joints of the body. Every frame comes from another place of
the recording, so that every joint of ``Transitions`` is always in a transition. Forward kinematics of the same poses
with numpy is timed as well, as a measure of how fast the processor is. The median and the 99th percentile are
printed.
"""

from __future__ import annotations

import time

import numpy as np

from cospeech.motion.blending import Blender, Stepper, Transitions
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses

GOAL_US = 10.0
N_FRAMES, N_REFERENCE = 50_000, 500


def wander(n_frames: int) -> Poses:
    """Return random poses of the body, each near the one before."""
    rng = np.random.default_rng(0)
    rotations = np.cumsum(rng.normal(0.0, 0.02, (n_frames, len(STANDARD.joints), 4)), axis=0)
    rotations[..., 0] += 3.0
    rotations /= np.linalg.norm(rotations, axis=2, keepdims=True)
    return Poses(rng.normal(0.0, 0.01, (n_frames, 3)), rotations)


def step_times_s(stepper: Stepper, poses: Poses, order: np.ndarray) -> np.ndarray:
    """Return the time of each step through poses in a given order."""
    stepper.start(poses.root_m[1], poses.rotations[1])
    times = np.empty(len(order) + 1)
    for row, frame in enumerate(np.append(1, order)):
        begin = time.perf_counter()
        stepper.step(poses.root_m[frame], poses.rotations[frame], poses.root_m[frame - 1], poses.rotations[frame - 1])
        times[row] = time.perf_counter() - begin
    return times[1:]  # the first step compiles


def main() -> None:
    """Print the times, their ratio and the goal."""
    poses = wander(N_FRAMES)
    order = np.random.default_rng(1).integers(1, N_FRAMES, N_FRAMES)
    begin = time.perf_counter()
    for frame in order[:N_REFERENCE]:
        STANDARD.world(poses.root_m[[frame]], poses.rotations[[frame]])
    reference = 1e6 * (time.perf_counter() - begin) / N_REFERENCE
    print(f"forward kinematics of one frame with numpy: {reference:.0f} us")
    for stepper in (Blender(STANDARD), Transitions(STANDARD, 40.0)):
        middle, late = 1e6 * np.percentile(step_times_s(stepper, poses, order), [50, 99])
        print(
            f"{type(stepper).__name__}: {middle:.1f} us per frame, 99th percentile {late:.1f} us, "
            f"{reference / middle:.0f} times as fast; goal {GOAL_US:g} us, "
            + ("reached" if middle <= GOAL_US else "MISSED")
        )


if __name__ == "__main__":
    main()
