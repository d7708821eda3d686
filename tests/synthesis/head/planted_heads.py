"""Melodies and heads with planted joint patterns, without sound: what stages I and II should find."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d

from cospeech.data.segments import frame_times
from cospeech.synthesis.interface import Speech, Training

FPS, MELODY_HZ = 30.0, 100.0
KINDS = 5
REST = KINDS
"""The label of frames without a pattern."""

TURN_DEG, TILT_DEG, NOD_DEG = 18.0, 12.0, 10.0


class Planted(NamedTuple):
    """A record: tables of melody and head, and the planted pattern of every frame of the head (T,), of both."""

    melody: pd.DataFrame
    head: pd.DataFrame
    of_head: np.ndarray
    of_melody: np.ndarray


def gesture(kind, share):
    """The angles (T, 3) of a gesture over its course, ``share`` from 0 to 1."""
    bump = np.sin(np.pi * share) ** 2
    angles = np.zeros((len(share), 3))
    if kind == 4:
        angles[:, 0] = NOD_DEG * bump * np.sin(4 * np.pi * share)
    else:
        angles[:, 1 + kind // 2] = (-1) ** kind * (TURN_DEG, TILT_DEG)[kind // 2] * bump
    return angles


def movement(kind, share):
    """The pitch (T,) of a movement over its course, in standard deviations."""
    bump = np.sin(np.pi * share) ** 2
    shapes = (
        2.5 * bump,
        -2.5 * bump,
        2.5 * np.sin(2 * np.pi * share) * np.sqrt(bump),
        -2.5 * np.sin(2 * np.pi * share) * np.sqrt(bump),
        1.5 * bump * np.sin(6 * np.pi * share) + 1.2 * bump,
    )
    return shapes[kind]


def record(rng, duration_s=60.0, coupling=0.8, lag_frames=6, jitter_s=0.0, fps=FPS):
    """A record in which a gesture of the head begins ``lag_frames`` before the movement of the pitch."""
    n_head, n_melody = round(duration_s * fps), round(duration_s * MELODY_HZ)
    head_s, melody_s = frame_times(n_head, fps), frame_times(n_melody, MELODY_HZ)
    angles, pitch = np.zeros((n_head, 3)), np.zeros(n_melody)
    of_head, of_melody = np.full(n_head, REST), np.full(n_head, REST)
    begin_s = rng.uniform(1.0, 2.0)
    while begin_s < duration_s - 2.0:
        kind = int(rng.integers(KINDS))
        shown = kind if rng.random() < coupling else int(rng.integers(KINDS))
        lasting_s, moving_s = rng.uniform(0.8, 1.2, 2)
        moved_s = begin_s - lag_frames / fps + rng.normal(0.0, jitter_s) if jitter_s else begin_s - lag_frames / fps
        spoken = (melody_s >= begin_s) & (melody_s < begin_s + lasting_s)
        pitch[spoken] = movement(kind, (melody_s[spoken] - begin_s) / lasting_s)
        of_melody[(head_s >= begin_s) & (head_s < begin_s + lasting_s)] = kind
        seen = (head_s >= moved_s) & (head_s < moved_s + moving_s)
        angles[seen] = gesture(shown, (head_s[seen] - moved_s) / moving_s)
        of_head[seen] = shown
        begin_s += max(lasting_s, moving_s) + rng.uniform(0.4, 1.2)
    angles += 2.0 * gaussian_filter1d(rng.normal(size=angles.shape), 3.0, axis=0)
    pitch += 0.2 * rng.normal(size=n_melody)
    loud = 0.3 * gaussian_filter1d(rng.normal(size=n_melody), 5.0) * 5.0
    return Planted(melody_table(melody_s, pitch, loud), head_table(head_s, angles), of_head, of_melody)


def melody_table(times_s, pitch, intensity):
    padded = np.pad(pitch, 2, mode="edge")
    slope = (padded[3:-1] - padded[1:-3] + 2 * (padded[4:] - padded[:-4])) / 10.0
    frames = {"frame": np.arange(len(pitch)), "time_s": times_s, "f0_hz": 120.0, "intensity_db": -20.0}
    return pd.DataFrame({**frames, "active": True, "pitch": pitch, "d_pitch": slope, "intensity": intensity})


def head_table(times_s, angles):
    x, y, z = angles.T
    return pd.DataFrame({"frame": np.arange(len(x)), "time_s": times_s, "x_deg": x, "y_deg": y, "z_deg": z})


def corpus(seed, n_records=4, **planted):
    """Records r0, r1, ... by name."""
    return {f"r{k}": record(np.random.default_rng([seed, k]), **planted) for k in range(n_records)}


def training_of(records, held_out):
    """What systems may learn from if a record is held out."""
    kept = {name: own for name, own in records.items() if name != held_out}
    return Training(
        actor="ada",
        frame_s=0.025,
        labels=(),
        symbols=(),
        gestures={},
        speech={},
        melodies={name: own.melody for name, own in kept.items()},
        heads={name: own.head for name, own in kept.items()},
        order=tuple(records),
    )


def speech_of(records, name, fps=FPS, driven_by=None, draw=0):
    """The speech that drives a record."""
    own, driving = records[name], records[driven_by or name]
    n_frames = round(len(own.head) * fps / FPS)
    return Speech(
        name, 0.025, round(len(own.melody) / 2.5), melody=driving.melody, driving_record=driven_by or name,
        draw=draw, motion_fps=fps, n_motion_frames=n_frames,
    )  # fmt: skip
