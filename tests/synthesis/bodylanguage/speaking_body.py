"""A small corpus for body language: dancing bodies with random subunits, and random syllables."""

from __future__ import annotations

import numpy as np
import pandas as pd
from dancer import motion

from cospeech.synthesis.bodylanguage import model
from cospeech.synthesis.interface import Speech, Training

FPS, FRAME_S = 20.0, 0.025
SETTINGS = {"elapsed": "exact", "pose_tolerance_deg": 5.0, "blending": "velocity"}


def syllables(rng, duration_s, record="one"):
    """A syllable table: some are unvoiced, some are followed by a silence."""
    n = int(duration_s / 0.05)
    lengths = rng.uniform(0.06, 0.35, n)
    gaps = np.where(rng.random(n) < 0.2, rng.uniform(0.1, 1.5, n), 0.0)
    starts = 0.3 + np.cumsum(gaps + np.concatenate([[0.0], lengths[:-1]]))
    voiced = rng.random(n) < 0.8
    pitch = {
        name: np.where(voiced, rng.uniform(0.0, high, n), np.nan)
        for name, high in (("f0_hz", 200.0), ("f0_rise_hz", 40.0), ("f0_fall_hz", 60.0))
    }
    table = pd.DataFrame(
        {
            "record": record,
            "syllable": np.arange(n),
            "start_s": starts,
            "peak_s": starts + 0.5 * lengths,
            "end_s": starts + lengths,
            "known_s": np.maximum.accumulate(starts + lengths + rng.uniform(0.02, 0.15, n)),
            **pitch,
            "intensity_db": rng.normal(-25.0, 6.0, n),
        }
    )
    return table[table["known_s"] <= duration_s].reset_index(drop=True)


def subunits(rng, n_frames, record, n_clusters=4):
    """A subunit table with random boundaries and clusters."""
    starts = np.cumsum(np.append(0, rng.integers(4, 30, n_frames)))
    starts = starts[starts < n_frames - 2]
    ends = np.append(starts[1:], n_frames)
    return pd.DataFrame(
        {
            "record": record,
            "segment": np.arange(len(starts)),
            "start_frame": starts,
            "end_frame": ends,
            "start_s": starts / FPS,
            "end_s": ends / FPS,
            "cluster": rng.integers(0, n_clusters, len(starts)),
            "medoid": False,
            "still": False,
        }
    )


def training(seed=0, n_records=3, duration_s=25.0):
    """What a model can learn from."""
    rng = np.random.default_rng(seed)
    n_frames = round(duration_s * FPS)
    records = [f"r{number}" for number in range(n_records)]
    return Training(
        "ada",
        FRAME_S,
        (),
        (),
        {},
        {},
        motions={record: motion(n_frames, FPS, seed + place, 0.002) for place, record in enumerate(records)},
        syllables={record: syllables(rng, duration_s, record) for record in records},
        subunits={
            record: {section: subunits(rng, n_frames, record) for section in model.SECTIONS} for record in records
        },
    )


def speech(seed=9, duration_s=20.0, fps=FPS):
    """The speech of another record."""
    return Speech(
        "new",
        FRAME_S,
        round(duration_s / FRAME_S),
        syllables=syllables(np.random.default_rng(seed), duration_s, "new"),
        motion_fps=fps,
        n_motion_frames=round(duration_s * fps),
    )
