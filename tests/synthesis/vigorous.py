"""A tiny actor whose loudness tells how fast the arms move, for tests of systems that make motion."""

import numpy as np
import pandas as pd

from cospeech.motion import skeleton
from cospeech.segmentation import phases
from cospeech.synthesis.controller import SETTINGS
from cospeech.synthesis.interface import Speech, Training

FPS, FRAME_S = 20.0, 0.025
PHASES = {"threshold": 0.25, "minimum_s": 0.1}
QUICK = {**SETTINGS, "states": [4], "clusters": 5}
ARMS = [skeleton.JOINTS.index(name) for name in ("left_arm", "right_arm")]


def arousal(rng, duration_s):
    """Whether the actor is aroused, at each frame of the motion: 0, 1 or 2, for 1.5 to 4 s at a time."""
    levels = []
    while len(levels) < duration_s * FPS:
        levels += [int(rng.integers(3))] * int(rng.uniform(1.5, 4.0) * FPS)
    return np.array(levels[: round(duration_s * FPS)])


def motion_of(levels, rng):
    """Arms that swing faster and wider the more the actor is aroused, with short rests."""
    n = len(levels)
    resting = np.convolve(rng.random(n) < 0.02, np.ones(8), "same") > 0
    drive = np.where(resting, 0.0, 0.2 + levels)
    drive = np.convolve(drive, np.ones(5) / 5, "same")
    turned = np.cumsum(drive)[:, None] * [0.35, 0.31] + [0.0, 1.0]
    angles = np.zeros((n, len(skeleton.JOINTS), 3))
    angles[:, ARMS, 0] = -50 + (6 + 12 * drive[:, None]) * np.sin(turned)
    angles[:, ARMS, 2] = [20, -20] + 5 * np.cos(turned)
    root = np.cumsum(rng.normal(0, 0.001, (n, 3)), axis=0)
    return skeleton.motion_table(root, angles, FPS)


def syllables_of(record, levels, rng):
    """Syllables that are louder, higher and shorter the more the actor is aroused; a quarter are unvoiced."""
    rows, time_s, end_s = [], 0.1, len(levels) / FPS
    while time_s < end_s - 0.4:
        level = levels[int(time_s * FPS)]
        length_s = rng.uniform(0.2, 0.3) - 0.04 * level
        voiced = rng.random() > 0.25
        rows.append(
            {
                "start_s": time_s,
                "peak_s": time_s + length_s / 2,
                "end_s": time_s + length_s,
                "known_s": time_s + length_s / 2 + rng.uniform(0.1, 0.2),
                "f0_hz": 110 + 40 * level + rng.normal(0, 10) if voiced else np.nan,
                "intensity_db": -40 + 8 * level + rng.normal(0, 2.0),
            }
        )
        time_s += length_s + (rng.uniform(0.5, 1.2) if rng.random() < 0.05 else 0.0)
    table = pd.DataFrame(rows)
    table.insert(0, "record", record)
    table.insert(1, "syllable", np.arange(len(table)))
    return table.assign(f0_rise_hz=np.nan, f0_fall_hz=np.nan)


class Actor:
    """Records with motion and speech, of which all but the last are learned from."""

    def __init__(self, seed, records=3, duration_s=40.0):
        rng = np.random.default_rng(seed)
        names = [f"r{i}" for i in range(records)]
        self.levels = {name: arousal(rng, duration_s) for name in names}
        self.motions = {name: motion_of(levels, rng) for name, levels in self.levels.items()}
        self.syllables = {name: syllables_of(name, levels, rng) for name, levels in self.levels.items()}
        self.new = names[-1]
        known = names[:-1]
        found = phases.find({name: self.motions[name] for name in known}, PHASES)
        self.training = Training(
            "actor", FRAME_S, (), (), {}, {},
            motions={name: self.motions[name] for name in known},
            syllables={name: self.syllables[name] for name in known},
            phases={name: table.reset_index(drop=True) for name, table in found.groupby("record")},
        )  # fmt: skip

    def speech(self, syllables=None, record=None, fps=FPS):
        """The speech of a record, by default the new one; with other syllables, if some are given."""
        record = record or self.new
        duration_s = len(self.motions[record]) / FPS
        return Speech(
            record, FRAME_S, round(duration_s / FRAME_S),
            syllables=self.syllables[record] if syllables is None else syllables,
            motion_fps=fps, n_motion_frames=round(duration_s * fps),
        )  # fmt: skip


def hand_speed(motion):
    return phases.speed(phases.hands(motion), skeleton.frame_rate(motion))
