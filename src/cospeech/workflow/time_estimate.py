"""Estimated run time of a virtual corpus, from the planned jobs and the measured time of such jobs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cospeech.workflow.progress import clock

START_S = 1.8
"""Seconds to start a job and to read and write its tables. All times here were measured on two slow cores."""

PICTURE_S = {
    "studio_film": 5.2e-3,
    "studio_range": 5.2e-3,
    "studio_laser": 3e-3,
    "track": 2.4e-3,
    "track_other": 2.4e-3,
    "laser": 1.8e-3,
}
"""Seconds per picture of ``PICTURE_PX`` pixels, rendered and encoded, or decoded and tracked."""

PICTURE_PX = 696 * 520
PICTURE_BYTES = 9_800

TAKE_S = {"studio_range": 24.0, "studio_laser": 35.0, "laser": 35.0}
"""Duration of the takes that are not records."""

RECORD_S = {"comparison": 0.33, "skeleton": 0.02, "studio_head": 0.35}
"""Seconds per second of a record, or of its video; a stereo film has 30 frames per second."""

TRAINING_S = {
    "sweep_settings": 0.0013,
    "prosody_clusters": 0.001,
    "gesture_fold": 0.005,
    "gesture_model": 0.005,
    "true_angles": 0.015,
}
"""Seconds per second of all records of an actor; for the sweep, per setting."""


def seconds(planned: Mapping[str, int], config: Mapping[str, Any], n_views: int, n_settings: int) -> float:
    """Return the total time of all jobs in seconds, if run one after another.

    Parameters
    ----------
    planned : number of jobs of each rule.
    config : the configuration of a virtual corpus.
    n_views, n_settings : number of cameras, and of settings of the sweep in addition to the main one.
    """
    actors = config["studio"]["actors"]
    record_s = _record_s(config)
    actor_s = record_s * sum(actor["records"] for actor in actors) / len(actors)
    pictures = config["studio"]["motion_fps"] * n_views * _size(config)
    longest_s = config["animation"]["video"]["longest_s"] or math.inf
    total_s = 0.0
    for rule, number in planned.items():
        shown_s = min(record_s, longest_s) if rule == "comparison" else record_s
        each_s = START_S + RECORD_S.get(rule, 0.0) * shown_s
        each_s += PICTURE_S.get(rule, 0.0) * TAKE_S.get(rule, record_s) * pictures
        each_s += TRAINING_S.get(rule, 0.0) * actor_s * (n_settings if rule == "sweep_settings" else 1)
        total_s += number * each_s
    return total_s


def line(planned: Mapping[str, int], config: Mapping[str, Any], n_views: int, n_settings: int, cores: int) -> str:
    """Return one line about a planned run: number of jobs, estimated time, and disk space for films."""
    run_s = seconds(planned, config, n_views, n_settings) / cores
    summary = f"{sum(planned.values())} jobs, about {clock(run_s)} (h:mm:ss) on {cores} cores"
    filmed_s = planned.get("studio_film", 0) * _record_s(config)
    size = PICTURE_BYTES * filmed_s * config["studio"]["motion_fps"] * n_views * _size(config)
    return f"{summary}; {size / 1e9:.1f} GB of film" if planned.get("studio_film") else summary


def _record_s(config: Mapping[str, Any]) -> float:
    """Return the mean duration of a record in seconds."""
    actors = config["studio"]["actors"]
    n_records = sum(actor["records"] for actor in actors)
    return sum(actor["records"] * actor["duration_s"] for actor in actors) / n_records


def _size(config: Mapping[str, Any]) -> float:
    """Return the area of a picture relative to ``PICTURE_PX``; all pictures have the same aspect ratio."""
    return (config["studio"]["camera_width_px"] / 696) ** 2
