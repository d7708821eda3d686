"""Made-up results about heads, of a system that nods, its control and a head that does not move."""

import numpy as np
import pandas as pd

from cospeech.evaluation import head_readings, head_recovery, head_sessions
from cospeech.evaluation.sessions import Bootstrap
from cospeech.motion import head
from cospeech.report import systems

PARAMS = {
    "nods": {
        "title": "Nodding head",
        "role": "system",
        "controls": ["nods_shuffled", "nods_shifted"],
        "source": "4.3",
    },
    "baseline": {
        "title": "Baseline",
        "role": "system",
        "controls": ["baseline_shuffled", "baseline_shifted"],
        "source": "4.4",
    },
    "nods_shuffled": {"title": "Nodding head: another record's speech", "role": "control"},
    "nods_shifted": {"title": "Nodding head: own speech, shifted", "role": "control"},
    "baseline_shuffled": {"title": "Baseline: another record's speech", "role": "control"},
    "baseline_shifted": {"title": "Baseline: own speech, shifted", "role": "control"},
    "still_head": {"title": "A head that does not move", "role": "control"},
}
SYSTEMS = systems.from_params(PARAMS)
SHOWN = ["nods", "baseline", "nods_shifted"]
ERRORS = {"nods": 8.0, "baseline": 9.0, "still_head": 10.0}


def angles(seed=0, n_frames=900):
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(0.0, 0.7, (n_frames, 3)), axis=0)
    return head.table(walk - walk.mean(axis=0), 30.0)


def scores(actors):
    rng = np.random.default_rng(2)
    rows = []
    for system in SYSTEMS:
        for record, actor in actors.items():
            for minute in (None, 0, 1):
                level = ERRORS.get(system, 12.0) + rng.normal(0.0, 0.3)
                named = {"system": system, "variant": "main", "actor": actor, "record": record, "minute": minute}
                for measure, scale in (("normalised", 0.1), ("mahalanobis", 0.15), ("euclidean", 1.0)):
                    rows.append(named | {"draw": 0, "measure": measure, "lag_s": np.nan, "value": scale * level})
                named["draw"], moves = 0, system != "still_head"
                if moves:
                    rows.append(named | {"measure": "speed_correlation", "lag_s": np.nan, "value": 0.5 - level / 40})
                for lag_s in (-0.1, 0.0, 0.1):
                    value = 0.5 - abs(lag_s) - level / 40
                    rows.append(named | {"draw": 0, "measure": "speed_r", "lag_s": lag_s, "value": value})
    return pd.DataFrame(rows).astype({"minute": "Int64"})


def sessions(actors):
    roles = {name: (system.role, system.controls) for name, system in SYSTEMS.items()}
    return head_sessions.table(scores(actors), head_sessions.pairs(roles), Bootstrap(200, 0.95, 1))


def patterns(features, prefix):
    """A parallel HMM of five patterns of three states, the first of which is at rest."""
    rows = []
    for branch in range(5):
        for state in range(3):
            for place, feature in enumerate(features):
                mean = 12.0 * np.sin(1 + state) * (branch % 3 == place) * (1 if branch < 3 else -1) * (branch > 0)
                rows.append(
                    {"branch": f"{prefix}{branch + 1}", "state": state, "entry_probability": 0.2}
                    | {"stay_probability": 0.9, "feature": feature, "mean": mean, "variance": 1.5}
                )
    return pd.DataFrame(rows)


def recovery(actors):
    rows = []
    for record, actor in actors.items():
        for quantity, value in (("head_ami", 0.8), ("melody_ami", 0.7)):
            own = {"quantity": quantity, "source": "found", "value": value, "n": 3000}
            rows.append(own | {"actor": actor, "record": record})
    for actor in dict.fromkeys(actors.values()):
        for source, height in (("planted", 1.2), ("found", 0.9)):
            for lag_s in (-0.2, 0.0, 0.2, 0.4):
                own = {"quantity": "information", "source": source, "lag_s": lag_s, "n": 3000}
                rows.append(own | {"value": height - abs(lag_s - 0.2), "actor": actor})
            rows.append({"quantity": "lag", "source": source, "value": 0.2, "n": 3000, "actor": actor})
    return head_recovery.table(rows)


def transplant(actors):
    record, actor = next(iter(actors.items()))
    moved = {"speed_deg_s": 20.0, "spread_deg": 5.0, "patterns_per_minute": 40.0, "pattern_distance": 0.2}
    named = {"record": record, "voice_actor": actor, "system": "nods", "variant": "main"}
    rows = [
        named | moved | {"source": source, "model_actor": model, "melody_ami": agreed}
        for source, model, agreed in (
            ("voice_recorded", actor, None), ("own_model", actor, None),
            ("transplant", "deniz", 0.7), ("model_recorded", "deniz", None),
        )
    ]  # fmt: skip
    return pd.DataFrame(rows)


def readings():
    rows = [
        {"equation": "4.5", "quantity": "largest error", "unit": "°", "as_printed": 50.0, "as_read": 0.0},
        {
            "equation": "4.20",
            "quantity": "a head that does not move",
            "unit": "",
            "as_printed": 900.0,
            "as_read": 1.0,
        },
    ]
    return head_readings.table(rows)


def captured(actors):
    parts = []
    for place, (record, actor) in enumerate(actors.items()):
        for quantity in ("x", "y", "z", "rotation", "position"):
            errors = {"mean": 0.3 + 0.05 * place, "p95": 0.8, "largest": 1.5 + 0.1 * place}
            counts = {"n_frames": 900, "n_tracked": 880, "n_predicted": 15}
            unit = "mm" if quantity == "position" else "deg"
            parts.append({"actor": actor, "record": record, "quantity": quantity, "unit": unit} | errors | counts)
    return pd.DataFrame(parts)


def curves():
    rows = []
    for stream in ("head", "melody", "joint"):
        for n in range(2, 9):
            fitness = {
                "alpha": -5.0 + 0.3 * n,
                "beta": 1.0 / n,
                "bic": 10.0 + abs(n - 5),
                "stability": 1.0 - 0.05 * n,
            }
            rows.append({"stream": stream, "n_patterns": n} | fitness)
    return pd.DataFrame(rows)


def generation():
    rng = np.random.default_rng(5)
    parts = []
    for stage in ("drawn", "median", "printed", "kept"):
        table = head.table(rng.normal(0.0, 5.0, (120, 3)), 30.0).drop(columns="frame")
        parts.append(table.assign(stage=stage, pattern=np.repeat(["g1", "g2", "g3"], 40)))
    return pd.concat(parts, ignore_index=True)


def accuracy():
    rows = []
    for width_px in (320, 640):
        for flow in ("warped", "printed"):
            for axis, mean in (("x", 0.3), ("y", 0.5), ("z", 0.2)):
                film = {"width_px": width_px, "contrast": 1.0, "noise": 2.0, "flow": flow, "depth": "disparity"}
                errors = {"mean_deg": mean, "max_deg": 3 * mean, "share_lost": 0.0, "n_frames": 36}
                rows.append(film | {"axis": axis} | errors)
    return pd.DataFrame(rows)


def results(actors):
    """Tables by path, with their schemas, as a run leaves them for its report."""
    first = next(iter(actors))
    found = {f"head/{first}.parquet": (angles(), "head")}
    found |= {f"synthesis/{name}/main/{first}/head.parquet": (angles(k + 1), "head") for k, name in enumerate(SHOWN)}
    place = f"synthesis/{SHOWN[0]}/main/{first}"
    return found | {
        f"{place}/curves.parquet": (curves(), "head_curves"),
        f"{place}/generation.parquet": (generation(), "head_generation"),
        f"{place}/head_patterns.parquet": (patterns(head.COLUMNS, "g"), "hmm_model"),
        f"{place}/melody_patterns.parquet": (patterns(["pitch", "d_pitch", "intensity"], "r"), "hmm_model"),
        "evaluation/head_sessions.parquet": (sessions(actors), "head_sessions"),
        "evaluation/head_recovery.parquet": (recovery(actors), "head_recovery"),
        "evaluation/head_capture.parquet": (captured(actors), "head_capture"),
        "evaluation/head_readings.parquet": (readings(), "head_readings"),
        "evaluation/head_transplant.parquet": (transplant(actors), "head_transplant"),
        "capture/head/accuracy.parquet": (accuracy(), "head_accuracy"),
    }
