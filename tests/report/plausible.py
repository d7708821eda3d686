"""Plausible tables of a small run, for exhibits and page: scored by the true methods, from made-up phrases."""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech import segments, skeleton
from cospeech.evaluation import scores, sessions

ACTORS = {f"{actor}_{k}": actor for actor in ("ada", "deniz") for k in range(1, 5)}
GESTURES = segments.GESTURES
FRAME_S = 0.025
DURATION_S = 60.0
BINS_S = (0.025, 0.25, 0.5)
RULES = scores.Rules(GESTURES, BINS_S, 10.0, 0.5, 3.0, 1.5, FRAME_S)
SYSTEMS = {
    "hsmm": {"title": "HSMM as printed", "role": "system"},
    "hsmm_weighted": {"title": "HSMM, weighted emissions", "role": "system"},
    "hsmm_sampled": {"title": "HSMM, sampled path", "role": "system"},
    "random": {"title": "random phrases", "role": "control"},
    "prior": {"title": "HSMM without speech", "role": "control"},
    "shuffled": {"title": "HSMM, another record's speech", "role": "control"},
    "shifted": {"title": "HSMM, speech shifted in time", "role": "control"},
    "clock": {"title": "most likely at this time", "role": "control"},
    "majority": {"title": "most frequent gesture", "role": "control"},
    "another": {"title": "another real record", "role": "ceiling"},
    "oracle": {"title": "HSMM as planted", "role": "ceiling"},
}
FIDELITY = {"hsmm": 0.5, "hsmm_weighted": 0.65, "hsmm_sampled": 0.55, "oracle": 0.8}


def draw_phrases(record: str, rng: np.random.Generator, mean_s: float = 2.2) -> pd.DataFrame:
    """Return made-up gesture phrases of one record, at rest at both ends."""
    n_frames = round(DURATION_S / FRAME_S)
    starts, labels, at = [], [], 0
    while at < n_frames:
        starts.append(at)
        share = np.array([0.18, 0.24, 0.16, 0.08, 0.12, 0.06, 0.16])
        choice = "rest" if at == 0 else str(rng.choice(GESTURES, p=share))
        labels.append(choice)
        scale = mean_s * (1.4 if choice == "rest" else 1.0)
        at += max(8, round(rng.gamma(4.0, scale / 4.0) / FRAME_S))
    return segments.from_starts(record, starts, labels, n_frames, 1 / FRAME_S)


def imitate(actual: pd.DataFrame, fidelity: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return phrases that agree with the actual ones in about the given share."""
    n_frames = int(actual["end_frame"].iloc[-1])
    starts = actual["start_frame"].to_numpy() + np.round(rng.normal(0, 14 * (1.2 - fidelity), len(actual))).astype(
        int
    )
    labels = [label if rng.random() < fidelity else str(rng.choice(GESTURES)) for label in actual["label"]]
    starts[0] = 0
    order = np.maximum.accumulate(np.clip(starts, 0, n_frames - 1) + np.arange(len(starts)))
    keep = order < n_frames
    return segments.from_starts(actual["record"].iloc[0], order[keep], np.array(labels)[keep], n_frames, 1 / FRAME_S)


def actual_phrases(seed: int = 7) -> dict[str, pd.DataFrame]:
    return {record: draw_phrases(record, np.random.default_rng([seed, i])) for i, record in enumerate(ACTORS)}


def synthesised_phrases(actual: dict[str, pd.DataFrame], seed: int = 8) -> dict[tuple[str, str], pd.DataFrame]:
    found = {}
    records = list(ACTORS)
    for s, system in enumerate(SYSTEMS):
        for r, record in enumerate(records):
            rng = np.random.default_rng([seed, s, r])
            if system in FIDELITY:
                table = imitate(actual[record], FIDELITY[system], rng)
            elif system == "majority":
                table = segments.from_starts(record, [0], ["rest"], round(DURATION_S / FRAME_S), 1 / FRAME_S)
            elif system == "clock":
                table = segments.from_starts(
                    record, [0, 160], ["rest", "left"], round(DURATION_S / FRAME_S), 1 / FRAME_S
                )
            elif system == "another":
                table = actual[records[(r + 1) % 4 + 4 * (r // 4)]].assign(record=record)
            else:
                table = draw_phrases(record, rng, mean_s=3.0 if system == "prior" else 2.2)
            found[system, record] = table
    return found


def record_scores() -> pd.DataFrame:
    """Return the scores of all systems at the main setting and of two systems over a sweep."""
    tables = actual_phrases()
    actual = {record: scores.phrases(table, RULES) for record, table in tables.items()}
    rows = []

    def add(system: str, setting: tuple[int, int], record: str, table: pd.DataFrame) -> None:
        origin = {"system": system, "clusters": setting[0], "states": setting[1]}
        found = scores.record_scores(actual[record], scores.phrases(table, RULES), RULES)
        rows.extend(origin | {"actor": ACTORS[record], "record": record} | row for row in found)

    for (system, record), table in synthesised_phrases(tables).items():
        add(system, (8, 3), record, table)
    for i, setting in enumerate((m, n) for m in (4, 6, 8, 10, 12, 14, 16) for n in (3, 5, 7, 9)):
        for system in ("hsmm", "hsmm_weighted"):
            for r, record in enumerate(ACTORS):
                fidelity = FIDELITY[system] - 0.01 * abs(setting[0] - 8) - 0.01 * (setting[1] - 3)
                if setting != (8, 3):
                    add(system, setting, record, imitate(tables[record], fidelity, np.random.default_rng([9, i, r])))
    return pd.DataFrame(rows)


BOOTSTRAP = sessions.Bootstrap(samples=2000, level=0.95, seed=2012)


def motion(record: str, energy: float, rng: np.random.Generator, fps: float = 20.0) -> pd.DataFrame:
    """Return made-up joint angles: slow waves on the arms with a little noise."""
    n_frames = round(DURATION_S * fps)
    time_s = np.arange(n_frames) / fps
    angles = rng.normal(0, 0.4, (n_frames, len(skeleton.JOINTS), 3))
    for joint in ("left_arm", "left_forearm", "right_arm", "right_forearm"):
        index = skeleton.JOINTS.index(joint)
        for axis in range(3):
            rate, phase = rng.uniform(0.1, 0.5), rng.uniform(0, 2 * np.pi)
            angles[:, index, axis] += energy * 25 * np.clip(np.sin(2 * np.pi * rate * time_s + phase), 0, None)
    return skeleton.motion_table(np.zeros((n_frames, 3)), angles, fps)


def recovery_rows() -> list[dict[str, object]]:
    rng = np.random.default_rng(5)
    rows: list[dict[str, object]] = []
    for record, actor in ACTORS.items():
        of = {"actor": actor, "record": record}
        rows.append(of | {"quantity": "gesture_frames_right", "value": rng.uniform(0.92, 0.97), "n": 2400})
        rows.append(of | {"quantity": "gesture_kappa", "value": rng.uniform(0.9, 0.95), "n": 2400})
        rows.append(of | {"quantity": "gesture_phrase_ratio", "value": rng.uniform(0.9, 1.1), "n": 2400})
        rows.append(of | {"quantity": "pitch_error", "value": rng.uniform(0.01, 0.02), "n": 1200})
        rows.append(of | {"quantity": "pitch_gross_errors", "value": rng.uniform(0.01, 0.05), "n": 1200})
        for clusters in (4, 6, 8, 10, 12, 14, 16):
            for states in (3, 5, 7, 9):
                for part, n in (("held_out", 2400), ("training", 7200)):
                    value = 0.6 - 0.02 * abs(clusters - 8) - 0.02 * (states - 3) + rng.normal(0, 0.03)
                    setting = {"clusters": clusters, "states": states, "part": part}
                    rows.append(of | setting | {"quantity": "prosody_ami", "value": value, "n": n})
    for actor in ("ada", "deniz"):
        for quantity in ("transitions_p", "durations_p"):
            rows.append({"actor": actor, "quantity": quantity, "value": rng.uniform(0.1, 0.9), "n": 90})
    return rows
