"""Plausible tables of a small run, for exhibits and page: scored by the true methods, from made-up phrases."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from cospeech.capture import accuracy
from cospeech.capture.fitting import observability as measured
from cospeech.data import segments, trajectories, vocabulary
from cospeech.evaluation import scores, sessions
from cospeech.geometry import camera
from cospeech.motion import skeleton
from cospeech.motion.markers import NAMES
from cospeech.report import systems as reported
from cospeech.report.exhibits import capture
from cospeech.report.exhibits.run import Run
from cospeech.studio import rig
from cospeech.synthesis.registry import registered

ROOT = Path(__file__).parents[2]

ACTORS = {f"{actor}_{k}": actor for actor in ("ada", "deniz") for k in range(1, 5)}
GESTURES = vocabulary.GESTURES
FRAME_S = 0.025
DURATION_S = 60.0
BINS_S = (0.025, 0.25, 0.5)
RULES = scores.Rules(GESTURES, BINS_S, 10.0, 0.5, 3.0, 1.5, FRAME_S)
MAIN = "clusters~8,states~3"
SWEPT = ("hsmm", "hsmm_weighted")
DECLARED = registered(
    {name: {} for name in (*SWEPT, "hsmm_sampled", "random", "prior", "clock", "majority", "another", "oracle")},
    virtual=True,
).systems
PARAMS = {
    name: {"title": system.title, "role": system.role, "controls": list(system.controls), "swept": name in SWEPT}
    | {"variant": MAIN if "prosody_labels" in system.needs else "main"}
    for name, system in DECLARED.items()
}
"""The systems of the run, as a rule hands them to a script."""
PARAMS["original"] = {"title": "Original motion, labelled by the same model", "role": "ceiling", "plans": False}
SYSTEMS = reported.from_params(PARAMS)
ANIMATED = ("hsmm", "hsmm_weighted", "hsmm_sampled", "random", "original")
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
    for s, system in enumerate(DECLARED):
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
    """Return the scores of all systems at the main setting, of what is seen in motion, and of a sweep."""
    tables = actual_phrases()
    actual = {record: scores.phrases(table, RULES) for record, table in tables.items()}
    rows = []

    def add(system: str, variant: str, record: str, table: pd.DataFrame, phrases: str = "planned") -> None:
        origin = {"system": system, "variant": variant, "phrases": phrases, "draw": 0}
        found = scores.record_scores(actual[record], scores.phrases(table, RULES), RULES)
        rows.extend(origin | {"actor": ACTORS[record], "record": record} | row for row in found)

    for (system, record), table in synthesised_phrases(tables).items():
        add(system, SYSTEMS[system].variant, record, table)
        if system in ANIMATED:
            rng = np.random.default_rng([10, len(rows)])
            add(system, SYSTEMS[system].variant, record, imitate(table, 0.8, rng), "seen")
    for r, record in enumerate(ACTORS):
        add("original", "main", record, imitate(tables[record], 0.9, np.random.default_rng([11, r])), "seen")
    for i, setting in enumerate((m, n) for m in (4, 8, 12) for n in (3, 5)):
        for system in SWEPT:
            for r, record in enumerate(ACTORS):
                fidelity = FIDELITY[system] - 0.01 * abs(setting[0] - 8) - 0.01 * (setting[1] - 3)
                if setting != (8, 3):
                    variant = f"clusters~{setting[0]},states~{setting[1]}"
                    add(system, variant, record, imitate(tables[record], fidelity, np.random.default_rng([9, i, r])))
    return pd.DataFrame(rows).assign(recorded=np.nan)


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


def speech(record: str, rng: np.random.Generator) -> pd.DataFrame:
    """Return made-up prosody frames: syllables of noise under a slow melody."""
    n_frames = round(DURATION_S / FRAME_S)
    time_s = segments.frame_times(n_frames, 1 / FRAME_S)
    intensity = np.convolve(rng.normal(0, 4, n_frames), np.ones(20) / 20, "same")
    lag_s = 1 / (180 + 40 * np.sin(time_s) + rng.normal(0, 2, n_frames))
    gain = np.clip(0.5 + 0.5 * np.sin(5 * time_s), -1, 1)
    table = pd.DataFrame({"frame": np.arange(n_frames), "time_s": time_s, "intensity": intensity})
    table = table.assign(pitch_lag=lag_s - lag_s.mean(), pitch_gain=gain)
    for name in ("intensity", "pitch_lag", "pitch_gain"):
        table[f"d_{name}"] = np.diff(table[name], prepend=table[name].iloc[0])
    return table.assign(intensity_log=intensity, lag_s=lag_s)


def clusters(record: str, rng: np.random.Generator) -> pd.DataFrame:
    starts = np.cumsum(np.append(0, rng.integers(16, 64, 50)))
    n_frames = round(DURATION_S / FRAME_S)
    starts = starts[starts < n_frames]
    labels = [f"p{k}" for k in rng.integers(1, 9, len(starts))]
    return segments.from_starts(record, starts, labels, n_frames, 1 / FRAME_S)


def records() -> pd.DataFrame:
    scenarios = ("memory", "documentary", "fairy_tale", "watch_and_tell")
    return pd.DataFrame(
        [
            {"actor": actor, "record": record, "scenario": scenarios[place % 4], "language": "Turkish"}
            | {"motion_source": "bvh", "motion_fps": 20.0, "audio_rate_hz": 16000.0, "duration_s": DURATION_S}
            | {
                "motion_path": f"{record}.bvh",
                "audio_path": f"{record}.wav",
                "note": "mixed down to <mono>" if place else None,
                "head_source": None,
                "head_fps": np.nan,
            }
            for place, (record, actor) in enumerate(ACTORS.items())
        ]
    )


def annotations(origin: str = "studio") -> pd.DataFrame:
    rows = [(record, float(k), k + 0.9, g, origin) for record in ACTORS for k, g in enumerate(GESTURES)]
    return pd.DataFrame(rows, columns=["record", "start_s", "end_s", "gesture", "origin"])


def smoothing() -> pd.DataFrame:
    """Return one made-up joint angle under each filter."""
    time_s = segments.frame_times(40, 20.0)
    plain = np.where(time_s < 1.0, 10 * np.sin(3 * time_s), -20 + 4 * np.sin(3 * time_s))
    tables = []
    for name, width in (("none", 1), ("exponential", 5), ("moving_average", 5), ("gaussian", 3), ("median", 3)):
        padded = np.pad(plain, width // 2, mode="edge")
        angle = np.convolve(padded, np.ones(width) / width, "valid")
        origin = {"filter": name, "window": 5, "system": "hsmm_weighted", "record": "ada_1"}
        where = {"joint": "left_arm", "axis": "x", "frame": np.arange(40), "time_s": time_s}
        tables.append(pd.DataFrame(origin | where | {"angle_deg": angle, "boundary_s": 1.0}))
    return pd.concat(tables, ignore_index=True)


def stills() -> pd.DataFrame:
    return pd.DataFrame(
        [
            {"label": g, "record": "ada_1", "frame": 20 * k, "time_s": k + 0.025, "n_phrases": 9, "distance_m": 0.02}
            for k, g in enumerate(GESTURES)
        ]
    )


def cameras() -> pd.DataFrame:
    return camera.to_table(rig.cameras(696, 1)).assign(rms_px=0.07, footage="0" * 64, n_points=500)


def capture_scores() -> pd.DataFrame:
    """Return made-up errors of capture: small ones of the robust method, and of the other on one record."""
    rows: list[dict[str, object]] = []
    for name, quantity in capture.QUANTITIES.items():
        if quantity.group == "cameras":
            rows.append({"quantity": name, "value": 0.1, "n": 5})
            continue
        for place, record in enumerate(ACTORS):
            rows.append(
                {"quantity": name, "record": record, "method": "robust", "value": 0.1 + 0.1 * place, "n": 400}
            )
        if quantity.group == "markers":
            rows.append({"quantity": name, "record": "ada_1", "method": "thesis", "value": 9.0, "n": 400})
    return accuracy.table(rows)


def film_effect() -> pd.DataFrame:
    """Return a made-up change by filming: 4 % of all actors together, more and less of each."""
    setting = {"system": "hsmm_weighted", "variant": MAIN, "part": "whole", "planted": 0.5, "n_records": 4}
    rows = [
        setting | {"actor": actor, "measure": measure, "bin_s": bin_s, "filmed": 0.5 + change / 200}
        | {"difference_pct": change, "low_pct": change - 5.0, "high_pct": change + 5.0}
        for actor, change in (("all", 4.0), ("ada", 9.0), ("deniz", -1.0))
        for measure, bin_s in (("S", 0.25), ("S", 0.5), ("D", np.nan), ("frames_right", np.nan))
    ]  # fmt: skip
    return pd.DataFrame(rows)


def observability() -> pd.DataFrame:
    rows = [
        (joint, axis, state, 0.0 if state == "locked" else 0.75, "as it is")
        for joint in skeleton.JOINTS
        for axis, state in zip("xyz", measured.AXES[joint.rpartition("_")[2]][:3], strict=True)
    ]
    return pd.DataFrame(rows, columns=["joint", "axis", "state", "share", "reason"])


def markers() -> pd.DataFrame:
    """Return made-up markers in the world: seen, but for one that is predicted, lost, and set by a person."""
    places = np.zeros((100, len(NAMES), 3))
    places[20:30, NAMES.index("left_hand")] = np.nan
    table = trajectories.to_table(places, NAMES, 20.0).assign(residual_px=0.2)
    for status, first, end in (("predicted", 40, 44), ("corrected", 60, 61)):
        own = (table["marker"] == "left_hand") & table["frame"].between(first, end - 1)
        table.loc[own, "status"] = status
    return table


def transplant() -> pd.DataFrame:
    """Return a made-up transplant: the second actor's model under the first actor's voice."""
    voice = {"record": "ada_1", "voice_actor": "ada", "system": "hsmm_weighted", "variant": MAIN}
    own = {"model_actor": "ada", "source": "own_model", "n_phrases": 31, "phrases_per_minute": 31.0}
    other = {"model_actor": "deniz", "source": "transplant", "n_phrases": 24, "phrases_per_minute": 24.0}
    return pd.DataFrame(
        [
            voice | own | {"mean_phrase_s": 1.94, "share_rest": 0.31, "kappa": np.nan},
            voice | other | {"mean_phrase_s": 2.5, "share_rest": 0.42, "kappa": 0.27},
        ]
    )


def body_language() -> dict[str, tuple[pd.DataFrame, str]]:
    """Return made-up tables of a model of body language and of its synthesis, with their schemas."""
    rng = np.random.default_rng(12)
    n_clusters = {"head": 3, "arms": 4, "legs": 2}
    libraries, clustered, selected, errors = [], [], [], []
    for section, n in n_clusters.items():
        cluster = np.arange(n)
        of = {"section": section}
        rows = pd.DataFrame(of | {"segment": np.arange(40), "record": "ada_2", "cluster": np.arange(40) % n})
        libraries.append(rows.assign(start_frame=np.arange(40) * 9, end_frame=np.arange(1, 41) * 9))
        fits = {name: rng.uniform(2.0, 4.0, n) for name in ("intercept", "printed_intercept")}
        fits |= {name: rng.uniform(-6.0, -4.0, n) for name in ("slope", "printed_slope")}
        fits["printed_slope"][0] = fits["printed_intercept"][0] = np.nan
        shares = {"initial": 1 / n, "continuing": 0.8, "length_s": 0.9}
        clustered.append(pd.DataFrame(of | {"cluster": cluster} | shares | fits))
        step, state = (axis.ravel() for axis in np.indices((40, 2 * n)))
        table = pd.DataFrame(of | {"step": step, "time_s": 0.2 * (step + 1), "cluster": state // 2})
        table["forward"] = rng.dirichlet(np.ones(2 * n), 40).ravel()
        chosen = {rule: state == rng.integers(0, 2 * n, 40)[step] for rule in ("by_direct", "by_product")}
        selected.append(table.assign(start=state % 2 == 0, **chosen))
        for mode, error in (("expected", 0.01), ("printed", 0.2)):
            sizes = {"variation_mean": error, "variation_max": 2 * error, "share_error": error}
            errors.append(of | {"mode": mode, "n": 300} | sizes)
    seen = pd.DataFrame({"observation": np.arange(36)})
    values = np.array(np.unravel_index(np.arange(36), (2, 2, 3, 3))).T
    seen[["up", "down", "intensity", "length"]] = values
    seen["can_occur"] = (values[:, 2] > 0) | ((values[:, :2].sum(axis=1) == 0) & (values[:, 3] < 2))
    seen["count"] = np.where(seen["can_occur"], rng.integers(0, 60, 36), 0)
    return {
        "subunits": (pd.concat(libraries, ignore_index=True), "subunit_library"),
        "clusters": (pd.concat(clustered, ignore_index=True), "subunit_clusters"),
        "occurrences": (seen, "observation_occurrences"),
        "selections": (pd.concat(selected, ignore_index=True), "subunit_selections"),
        "elapsed": (pd.DataFrame(errors), "elapsed_errors"),
    }


def controller() -> dict[str, tuple[pd.DataFrame, str]]:
    """Return made-up tables of the controller's experiments, by path, with their schemas."""
    rng = np.random.default_rng(13)
    scores = [
        {"record": record, "window": window, "step_ms": 100.0, "model": model, "chain": -0.5 * worse}
        | {"filtered": -1.7 - worse, "kinematics": -2.5 - worse}
        for record in ("ada_2", "ada_3")
        for window in range(1, 6)
        for model, worse in (("crf", 0.02 * abs(window - 4)), ("hmm", 0.8 * window))
    ]
    delays = 100.0 * np.arange(7)
    cost = 2.0 + 0.6 * np.exp(-delays / 200)
    quantities = {"segments": 220.0, "pieces": 700.0, "hidden_states": 9.0, "library_s": 180.0, "iterations": 12.0}
    quantities |= {"undominated_share": 0.06, "printed_discount_error": 0.07, "style_combination_error": np.nan}
    names = ("standard", "creature", "own")
    joints = [(None, "hips"), ("hips", "chest"), ("chest", "head"), ("chest", "hand")]
    strips = [
        {"library": name, "picture": picture, "time_s": 2.0 + picture, "joint": joint, "parent": parent}
        | dict(zip(("x_m", "y_m", "z_m"), rng.normal(0, 0.5, 3), strict=True))
        for name in names
        for picture in range(4)
        for parent, joint in joints
    ]
    libraries = {"library": names, "library_s": [706.0, 51.0, 30.0], "segments": [900, 60, 40], "hands": [2, 8, 2]}
    return {
        "windows": (pd.DataFrame(scores), "controller_windows"),
        "regret": (
            pd.DataFrame(
                {"plan": ["states"] * 6 + ["situations"], "delay_ms": [*delays[:6], 0.0], "cost": cost}
                | {"optimum": 2.0, "regret": cost / 2.0 - 1.0}
            ),
            "controller_regret",
        ),
        "control_layer": (
            pd.DataFrame({"quantity": [*quantities], "value": [*quantities.values()]}), "controller_control_layer",
        ),
        "controller_libraries": (
            pd.DataFrame(libraries | {"training_s": [0.9, 0.02, 0.01]}), "controller_libraries",
        ),
        "controller_strips": (pd.DataFrame(strips), "controller_strips"),
    }  # fmt: skip


RUN = Run(
    systems=SYSTEMS,
    actors=ACTORS,
    pictured=["hsmm", "hsmm_weighted"],
    in_timeline=["hsmm", "hsmm_weighted", "hsmm_weighted_shifted", "random"],
    main={"clusters": 8, "states": 3},
    published=yaml.safe_load((ROOT / "reports/template/published.yaml").read_text(encoding="utf-8")),
)
