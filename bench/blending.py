"""Time velocity-preserving blending of one frame: python bench/blending.py

One step of ``Blender`` moves all 17 joints of the body. Forward kinematics of the same pose with numpy is timed in
turn, as a measure of how fast the processor is. The median and the 99th percentile of the steps are printed.
"""

from __future__ import annotations

import time

import numpy as np

from cospeech.motion.blending import Blender
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


def main() -> None:
    """Print the times, their ratio and the goal."""
    poses, blender = wander(N_FRAMES), Blender(STANDARD)
    blender.start(poses.root_m[1], poses.rotations[1])
    blender.step(poses.root_m[1], poses.rotations[1], poses.root_m[0], poses.rotations[0])  # compile
    order = np.random.default_rng(1).integers(1, N_FRAMES, N_FRAMES)
    times = np.empty(N_FRAMES)
    for row, frame in enumerate(order):
        begin = time.perf_counter()
        blender.step(poses.root_m[frame], poses.rotations[frame], poses.root_m[frame - 1], poses.rotations[frame - 1])
        times[row] = time.perf_counter() - begin
    begin = time.perf_counter()
    for frame in order[:N_REFERENCE]:
        STANDARD.world(poses.root_m[[frame]], poses.rotations[[frame]])
    reference = (time.perf_counter() - begin) / N_REFERENCE
    middle, late = 1e6 * np.percentile(times, [50, 99])
    print(
        f"one frame of {len(STANDARD.joints)} joints: {middle:.1f} us, 99th percentile {late:.1f} us; "
        f"forward kinematics with numpy {1e6 * reference:.0f} us; goal {GOAL_US:g} us, "
        + ("reached" if middle <= GOAL_US else "MISSED")
    )


if __name__ == "__main__":
    main()
