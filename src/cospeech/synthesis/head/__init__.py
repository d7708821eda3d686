"""Head gestures driven by pitch and intensity (Sargin 2006, chapter 4), their baseline, and their controls."""

from typing import Any

from cospeech.synthesis.declaration import System

SOURCE = "Sargin 2006"

TABLES = {
    "head_patterns": "hmm_model",
    "melody_patterns": "hmm_model",
    "joint_patterns": "symbol_hmm",
    "weighted_patterns": "symbol_hmm",
    "iohmm": "iohmm",
    "noise": "head_noise",
    "examples": "head_examples",
    "rates": "head_rates",
}
"""The tables of the model that all systems share, with their schemas."""

REPORTS = {name: f"head_{name}" for name in ("curves", "means", "contours", "segments", "generation")}
"""Tables about what is learnt and generated (see ``report``), with their schemas."""

SETTINGS = {
    "head_patterns": 5,
    "head_states": 10,
    "melody_patterns": 5,
    "melody_states": 5,
    "joint_patterns": 6,
    "joint_states": 4,
    "melody_weight": 0.2,
    "iohmm_states": 24,
    "restarts": 8,
    "iterations": 30,
    "melody_lag_s": 0.5,
    "look_ahead_frames": 24,
    "overlap_frames": 5,
    "filters": "kept",
}
"""Settings of the systems and their defaults, which are those of the thesis where it gives any.

head_patterns, head_states, melody_patterns, melody_states : patterns of the first stage and states of each; there are
    fewer patterns if the training records are too short for so many.
joint_patterns, joint_states : joint patterns of the second stage, and states of each.
melody_weight : exponent of the melody in the second stage of ``head_weighted`` (eq. 4.18); those of the thesis are 1.
iohmm_states : states of the input-output HMM; 24, as many as those of the joint patterns.
restarts, iterations : initial models of each stage, and iterations of training of the most promising one.
melody_lag_s : time after which the melody pattern of a frame is decided.
look_ahead_frames : frames of the head after which its pattern is decided, except by ``iohmm``.
overlap_frames : frames by which a pattern reaches into its neighbours (section 4.3).
filters : printed, the median and Gaussian filters of the thesis; or kept, filters that keep the speed, jerk and
    spread of the training records (see ``generation``).
"""


POOL = {"pool": "head_pool", "order": "record_order"}
"""The tables of the controls that show recorded heads."""


def _declare(name: str, title: str, method: str, section: str, order: int, **more: Any) -> System:
    return System(
        name=name,
        title=title,
        method=f"cospeech.synthesis.head.{method}",
        source=f"{SOURCE}, {section}",
        needs=("melody", "head"),
        makes="head",
        tables=TABLES,
        settings=SETTINGS,
        order=order,
        **more,
    )


def _control(name: str, title: str, method: str, order: int, shares: str = "") -> System:
    return System(
        name=name,
        title=title,
        method=f"cospeech.synthesis.head.{method}",
        role="control",
        needs=("head",),
        makes="head",
        shares=shares,
        tables=POOL,
        order=order,
    )


SYSTEMS = (
    _declare("head", "Head gestures", "proposed", "4.2 and 4.3", 70, live=True, reports=REPORTS),
    _declare(
        "head_weighted", "Head gestures, melody weighted", "weighted", "4.2 and 4.3", 71, shares="head", live=True
    ),
    _declare("iohmm", "Head gestures by IOHMM", "iohmm", "4.4.3", 72, shares="head", live=True),
    _declare(
        "iohmm_ahead", "Head gestures by IOHMM with look-ahead", "iohmm_ahead", "4.4.3", 73, shares="head", live=True
    ),
    _control("head_another", "Another recorded head", "another", 70),
    _control("head_mean", "Mean head", "mean", 71, shares="head_another"),
    _control("head_still", "Head that does not move", "still", 72, shares="head_another"),
    _declare(
        "head_ceiling", "Head gestures by gradient boosting", "ceiling", "4.3", 70, role="ceiling", shares="head"
    ),
)
