"""A small virtual actor for these tests: gesture phrases with preparation, stroke and retraction, plus noise."""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.motion import skeleton

FPS = 20.0
STROKES = {
    "raise_both": {"left_arm_x": -40, "right_arm_x": -40, "left_forearm_x": -80, "right_forearm_x": -80},
    "rest": {},
    "left": {"left_arm_x": -35, "left_forearm_x": -85},
    "perpendicular": {"left_arm_x": -30, "left_forearm_x": -70, "right_arm_z": -45, "right_forearm_x": -40},
    "contact": {"left_arm_y": -40, "right_arm_y": 40, "left_forearm_x": -90, "right_forearm_x": -90},
    "open": {"left_arm_x": 30, "right_arm_x": 30, "left_arm_z": 35, "right_arm_z": -35},
    "right": {"right_arm_x": -35, "right_forearm_x": -85},
}


def perform(record: str, rng: np.random.Generator, duration_s: float = 60.0, noise_deg: float = 0.4):
    """Return the motion table and the planted gesture segments of one record."""
    columns = skeleton.angle_columns(skeleton.ARM_JOINTS)
    neutral = np.zeros(len(columns))
    neutral[[columns.index("left_forearm_x_deg"), columns.index("right_forearm_x_deg")]] = -15
    poses, starts, labels = [], [], []
    frame, label = 0, "rest"
    n_frames = round(duration_s * FPS)
    while frame < n_frames:
        length = int(np.clip(rng.gamma(5.0, 0.45), 0.8, 5.0) * FPS)
        starts.append(frame)
        labels.append(label)
        pose = neutral.copy()
        vigour = rng.uniform(0.75, 1.25)
        for name, angle in STROKES[label].items():
            pose[columns.index(f"{name}_deg")] += angle * vigour + rng.normal(0, 4)
        u = np.linspace(0, 1, length, endpoint=False)
        rise = np.clip(u / rng.uniform(0.2, 0.35), 0, 1)
        fall = np.clip((1 - u) / rng.uniform(0.2, 0.3), 0, 1)
        envelope = np.minimum(rise, fall)
        envelope = envelope * envelope * (3 - 2 * envelope)
        beat = 1 + 0.12 * np.sin(2 * np.pi * rng.uniform(1.0, 2.0) * u * length / FPS) * (envelope > 0.99)
        poses.append(neutral + envelope[:, None] * beat[:, None] * (pose - neutral))
        frame += length
        others = [name for name in STROKES if name != label or (name != "rest" and rng.random() < 0.1)]
        label = "rest" if label != "rest" and rng.random() < 0.4 else str(rng.choice(others))
    arms = np.concatenate(poses)[:n_frames] + rng.normal(0, noise_deg, (n_frames, len(columns)))
    motion = skeleton.motion_table(np.zeros((n_frames, 3)), np.zeros((n_frames, len(skeleton.JOINTS), 3)), FPS)
    motion[columns] = arms
    return motion, segments.from_starts(record, starts, labels, n_frames, FPS)


def examples(truth: dict[str, pd.DataFrame], count: int, rng: np.random.Generator) -> pd.DataFrame:
    """Return ``count`` annotated phrases per class, distributed over the records."""
    whole = pd.concat([table.iloc[:-1] for table in truth.values()])
    shuffled = whole.iloc[rng.permutation(len(whole))]
    turn = shuffled.groupby(["label", "record"]).cumcount()
    chosen = shuffled.assign(turn=turn).sort_values(["turn", "record"]).groupby("label").head(count)
    return (
        chosen.rename(columns={"label": "gesture"})
        .assign(origin="person")[["record", "start_s", "end_s", "gesture", "origin"]]
        .sort_values(["record", "start_s"], ignore_index=True)
    )
