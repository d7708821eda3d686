"""How long a virtual corpus will take, told before it starts: from what there is to do, and what such jobs took."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cospeech.workflow.progress import clock

START_S = 1.8
"""Seconds to start a job, to read its tables and to write them, on the two slow cores where all this was measured."""

PICTURE_S = {
    "studio_film": 5.2e-3,
    "studio_range": 5.2e-3,
    "studio_laser": 3e-3,
    "track": 2.4e-3,
    "track_other": 2.4e-3,
    "laser": 1.8e-3,
}
"""Seconds for one picture of ``PICTURE_PX``, drawn and encoded, or decoded and measured."""

PICTURE_PX = 696 * 520
PICTURE_BYTES = 9_800

TAKE_S = {"studio_range": 24.0, "studio_laser": 35.0, "laser": 35.0}
"""Length of the takes that are no records."""

OWN_S = {"comparison": 0.33, "skeleton": 0.02}
"""Seconds for one second of a record, or of its video."""

LEARNING_S = {
    "sweep_settings": 0.0013,
    "prosody_clusters": 0.001,
    "gesture_fold": 0.005,
    "gesture_model": 0.005,
    "true_angles": 0.015,
}
"""Seconds for one second of all records of an actor, that of the sweep at each setting."""


def seconds(planned: Mapping[str, int], config: Mapping[str, Any], n_views: int, n_settings: int) -> float:
    """Return the seconds of all jobs, one after another.

    Parameters
    ----------
    planned : number of jobs of each rule.
    config : the configuration of a virtual corpus.
    n_views, n_settings : cameras of the rig, and settings of the sweep beside the main one.
    """
    actors = config["studio"]["actors"]
    n_records = sum(actor["records"] for actor in actors)
    record_s = sum(actor["records"] * actor["duration_s"] for actor in actors) / n_records
    actor_s = record_s * n_records / len(actors)
    pictures = config["studio"]["motion_fps"] * n_views * _size(config)
    longest_s = config["animation"]["video"]["longest_s"] or math.inf
    total_s = 0.0
    for rule, number in planned.items():
        own_s = min(record_s, longest_s) if rule == "comparison" else record_s
        each_s = START_S + OWN_S.get(rule, 0.0) * own_s
        each_s += PICTURE_S.get(rule, 0.0) * TAKE_S.get(rule, record_s) * pictures
        each_s += LEARNING_S.get(rule, 0.0) * actor_s * (n_settings if rule == "sweep_settings" else 1)
        total_s += number * each_s
    return total_s


def line(planned: Mapping[str, int], config: Mapping[str, Any], n_views: int, n_settings: int, cores: int) -> str:
    """Return what a person wants to know before a run starts: jobs, time, room for films."""
    last_s = seconds(planned, config, n_views, n_settings) / cores
    told = f"{sum(planned.values())} jobs, about {clock(last_s)} (h:mm:ss) on {cores} cores"
    filmed_s = sum(actor["records"] * actor["duration_s"] for actor in config["studio"]["actors"])
    size = PICTURE_BYTES * filmed_s * config["studio"]["motion_fps"] * n_views * _size(config)
    return f"{told}; {size / 1e9:.1f} GB of film" if planned.get("studio_film") else told


def _size(config: Mapping[str, Any]) -> float:
    """Return the area of a picture in pictures of ``PICTURE_PX``; all have the same sides' ratio."""
    return (config["studio"]["camera_width_px"] / 696) ** 2
