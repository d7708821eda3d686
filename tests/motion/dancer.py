"""Moving bodies and phrases for the tests."""

import numpy as np

from cospeech.data import segments
from cospeech.motion import skeleton


def motion(n_frames=60, fps=20.0, seed=0, walk_m=0.0, turn_deg=0.0):
    """A body with swinging arms that may walk at random and turn."""
    rng = np.random.default_rng(seed)
    time = np.arange(n_frames) / fps
    angles = np.zeros((n_frames, len(skeleton.JOINTS), 3))
    for name, reach in (("arm", 70), ("forearm", 80)):
        for side in ("left", "right"):
            joint = skeleton.JOINTS.index(f"{side}_{name}")
            speed, phase = rng.uniform(0.5, 3, 2)
            angles[:, joint, 0] = -reach * (0.5 + 0.5 * np.sin(speed * time + phase))
            angles[:, joint, 2] = rng.uniform(0, 30) * (1 if side == "left" else -1)
    angles[:, skeleton.JOINTS.index("head"), 1] = 10 * np.sin(time)
    angles[:, 0, 1] = turn_deg * np.sin(rng.uniform(0.2, 1) * time)
    root = np.cumsum(rng.normal(0, walk_m, (n_frames, 3)), axis=0) * [1, 0.05, 1]
    return skeleton.motion_table(root, angles, fps)


def phrases(n_frames=60, fps=20.0, seed=0, record="ada_1", labels=("rest", "left", "open")):
    """A segment table over ``n_frames`` with phrases of about one second."""
    rng = np.random.default_rng(seed)
    starts = np.cumsum(np.append(0, rng.integers(fps // 2, 2 * fps, n_frames)))
    starts = starts[starts < n_frames]
    return segments.from_starts(record, starts, rng.choice(labels, len(starts)), n_frames, fps)
