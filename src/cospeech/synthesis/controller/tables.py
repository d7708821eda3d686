"""The trained controller as tables and back, without loss.

The motion of the library is not among them if it is that of the training records: models come with the motion tables
of these, ``motion~<record>``. The motion of another body is in the tables ``body`` and ``poses``, which are empty
otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov.crf import CRF
from cospeech.markov.gaussian_hmm import GaussianHMM
from cospeech.motion import library as motion_library
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Library
from cospeech.synthesis.controller import control
from cospeech.synthesis.controller.clusters import Clusters, Range
from cospeech.synthesis.controller.control import Balance, Control, Tone
from cospeech.synthesis.controller.inference import KINEMATICS, PROSODY, Inference, Scale
from cospeech.synthesis.controller.library import TABLE_BYTES, Pieces, Rows
from cospeech.synthesis.controller.model import Model
from cospeech.synthesis.controller.policy import Policy
from cospeech.synthesis.controller.situations import Situations
from cospeech.synthesis.controller.style import Transform

MOTION = "motion~"
"""Names of the motion tables of the training records begin with this."""

Tables = Mapping[str, pd.DataFrame]


def to_tables(model: Model) -> dict[str, pd.DataFrame]:
    """Return the model as tables, with the names and schemas that the declaration lists."""
    layer, made = model.layer, model.control
    plan, tones = made.situations, made.tones
    found = {
        "controller": _settings(model),
        "scales": pd.concat(
            [_scale("kinematics", KINEMATICS, layer.kinematics), _scale("prosody", PROSODY, layer.prosody)],
            ignore_index=True,
        ),
        "gaussians": pd.concat(
            [
                _gaussians("state", KINEMATICS, layer.hmm.initial, layer.hmm.mean, layer.hmm.covariance),
                _gaussians("cluster", PROSODY, *layer.clusters),
            ],
            ignore_index=True,
        ),
        "chain": _matrix(
            {"state": len(layer.hmm.mean), "next_state": len(layer.hmm.mean)},
            probability=layer.hmm.transitions, weight=layer.crf.transitions,
        ),
        "observations": _matrix(
            {"lag": layer.window, "cluster": len(layer.clusters.weight), "state": len(layer.hmm.mean)},
            weight=layer.crf.observations,
        ),
        "states": pd.DataFrame(
            {"n_states": [*model.held_out], "log_likelihood": [float(value) for value in model.held_out.values()]}
        ).astype({"n_states": "int64", "log_likelihood": "float64"}),
        "situations": _matrix(
            {"situation": len(plan.beliefs), "state": len(layer.hmm.mean)}, probability=plan.beliefs
        ),
        "situation_chain": _matrix(
            dict.fromkeys(("situation", "next_situation"), len(plan.beliefs)), probability=plan.transitions

        ),
        "library": made.library.table,
        "kinematics": _kinematics(made.kinematics),
        "styles": _styles(made.tones),
        "delta": _by_style({name: one.distances for name, one in tones.items()}, "segment", "state", "distance"),
        "policy": _by_style({name: one.policy.values for name, one in tones.items()}, "piece", "situation", "value"),
        "convergence": pd.DataFrame(
            {
                "style": [*made.tones],
                "iterations": [tone.policy.iterations for tone in made.tones.values()],
                "error_bound": [tone.policy.error_bound for tone in made.tones.values()],
            }
        ),
        "keywords": pd.DataFrame(
            [(word, int(a)) for word, chosen in made.keywords.items() for a in chosen], columns=["word", "segment"]
        ).astype({"word": object, "segment": "int64"}),
    }  # fmt: skip
    return found | _costs(made) | _foreign(made.library)


def from_tables(tables: Tables) -> Model:
    """Return the model of ``to_tables``, given its tables and the motion tables of its training records."""
    scalars = tables["controller"].iloc[0]
    gaussians, chain, observations = tables["gaussians"], tables["chain"], tables["observations"]
    initial, mean, covariance = _from_gaussians(gaussians, "state", len(KINEMATICS))
    n_states = len(initial)
    layer = Inference(
        _from_scale(tables["scales"], "kinematics"),
        _from_scale(tables["scales"], "prosody"),
        GaussianHMM(initial, _square(chain["probability"], n_states), mean, covariance),
        Clusters(*_from_gaussians(gaussians, "cluster", len(PROSODY))),
        Range(float(scalars["f0_low"]), float(scalars["f0_high"])),
        int(scalars["window"]),
        CRF(_square(chain["weight"], n_states), _numbers(observations["weight"]).reshape(-1, n_states)),
    )
    library, kinematics = _library(tables), tables["kinematics"][list(KINEMATICS)].to_numpy(dtype=float)
    balance = Balance(
        float(scalars["transition_s"]),
        float(scalars["interruption_s"]),
        float(scalars["horizon_s"]),
        float(scalars["repetition_s"]),
        float(scalars["memory_s"]),
        scalars["discounts"],
    )
    delta = _from_by_style(tables["delta"], "distance", n_states)
    plan = Situations(
        _numbers(tables["situations"]["probability"]).reshape(-1, n_states),
        _square(tables["situation_chain"]["probability"], len(tables["situations"]) // n_states),
    )
    values = _from_by_style(tables["policy"], "value", len(plan.beliefs))
    transforms = _from_styles(tables["styles"])
    keywords = {
        str(word): tuple(int(a) for a in rows["segment"])
        for word, rows in tables["keywords"].groupby("word", sort=False)
    }
    made = control.without_policies(
        layer,
        library,
        int(scalars["frames_per_step"]),
        kinematics,
        delta[control.NEUTRAL],
        keywords,
        balance,
        plan,
    )
    made = made._replace(rows=_from_costs(tables, made.cut) or made.rows)
    tones = {
        name: Tone(
            transforms.get(name), delta[name], Policy(values[name], values[name][made.cut.first[:-1]], *converged)
        )
        for name, *converged in tables["convergence"].itertuples(index=False)
    }
    held_out = {int(n): float(value) for n, value in tables["states"].itertuples(index=False)}
    return Model(layer, made._replace(tones=tones), float(scalars["pause_db"]), held_out)


def _settings(model: Model) -> pd.DataFrame:
    layer, made = model.layer, model.control
    row = {
        "frames_per_step": made.per_step,
        "step_s": made.step_s,
        "window": layer.window,
        "f0_low": float(layer.f0.low),
        "f0_high": float(layer.f0.high),
        "pause_db": model.pause_db,
        **made.balance._asdict(),
        "discount": made.discount,
        "interruption": made.known.penalty,
    }
    return pd.DataFrame([row])


def _scale(kind: str, names: tuple[str, ...], scale: Scale) -> pd.DataFrame:
    return pd.DataFrame({"features": kind, "feature": names, "mean": scale.mean, "sd": scale.sd})


def _from_scale(table: pd.DataFrame, kind: str) -> Scale:
    own = table[table["features"] == kind]
    return Scale(_numbers(own["mean"]), _numbers(own["sd"]))


def _gaussians(kind: str, names: tuple[str, ...], weight: Floats, mean: Floats, covariance: Floats) -> pd.DataFrame:
    """Return one row per component, feature, and other feature."""
    n, d = mean.shape
    return pd.DataFrame(
        {
            "kind": kind,
            "component": np.repeat(np.arange(n), d * d),
            "weight": np.repeat(weight, d * d),
            "feature": np.tile(np.repeat(np.array(names, dtype=object), d), n),
            "mean": np.repeat(mean.ravel(), d),
            "with_feature": np.tile(np.array(names, dtype=object), n * d),
            "covariance": covariance.ravel(),
        }
    )


def _from_gaussians(table: pd.DataFrame, kind: str, d: int) -> tuple[Floats, Floats, Floats]:
    own = table[table["kind"] == kind]
    covariance = _numbers(own["covariance"]).reshape(-1, d, d)
    return _numbers(own["weight"][:: d * d]), _numbers(own["mean"][::d]).reshape(-1, d), covariance


def _matrix(axes: Mapping[str, int], **values: Floats) -> pd.DataFrame:
    """Return one row per combination of indices, the last changing fastest."""
    indices = np.indices(tuple(axes.values())).reshape(len(axes), -1)
    columns = dict(zip(axes, indices.astype(np.int64), strict=True))
    return pd.DataFrame({**columns, **{name: array.ravel() for name, array in values.items()}})


def _kinematics(values: Floats) -> pd.DataFrame:
    table = pd.DataFrame(values, columns=list(KINEMATICS))
    table.insert(0, "segment", np.arange(len(values)))
    return table


def _by_style(arrays: Mapping[str, Floats], axis: str, other: str, name: str) -> pd.DataFrame:
    parts = []
    for style, values in arrays.items():
        part = _matrix({axis: len(values), other: values.shape[1]}, **{name: values})
        part.insert(0, "style", style)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def _from_by_style(table: pd.DataFrame, name: str, n_states: int) -> dict[str, Floats]:
    return {
        str(style): _numbers(rows[name]).reshape(-1, n_states) for style, rows in table.groupby("style", sort=False)
    }


def _styles(tones: Mapping[str, Tone]) -> pd.DataFrame:
    """Return one row per style, parameter, and other parameter."""
    d, names = len(KINEMATICS), np.array(KINEMATICS, dtype=object)
    parts = [
        pd.DataFrame(
            {
                "style": name,
                "feature": np.repeat(names, d),
                "offset": np.repeat(tone.transform.offset, d),
                "with_feature": np.tile(names, d),
                "factor": tone.transform.matrix.ravel(),
            }
        )
        for name, tone in tones.items()
        if tone.transform is not None
    ]
    columns = {"style": object, "feature": object, "offset": float, "with_feature": object, "factor": float}
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=[*columns]).astype(columns)


def _from_styles(table: pd.DataFrame) -> dict[str, Transform]:
    d = len(KINEMATICS)
    return {
        str(name): Transform(_square(rows["factor"], d), _numbers(rows["offset"][::d]))
        for name, rows in table.groupby("style", sort=False)
    }


def _costs(made: Control) -> dict[str, pd.DataFrame]:
    """Return the successor costs after the last piece of each segment, and after the others.

    Both tables are empty for a library whose costs are too large for a table; they are computed again then.
    """
    cut, n_segments = made.cut, len(made.kinematics)
    n_pieces = len(cut.segment) if 8 * len(cut.segment) * n_segments <= TABLE_BYTES else 0
    costs = made.rows(slice(0, n_pieces))
    closing = cut.closing[:n_pieces]
    after_last, others = np.flatnonzero(closing), np.flatnonzero(~closing)
    successors = {
        "segment": np.repeat(cut.segment[after_last], n_segments),
        "next_segment": np.tile(np.arange(n_segments), len(after_last)),
        "cost": costs[after_last].ravel(),
    }
    # An interrupted segment does not start itself again: the cost is infinite, and has no row.
    ends, targets = (axis.ravel() for axis in np.meshgrid(others, np.arange(n_segments), indexing="ij"))
    possible = cut.segment[ends] != targets
    interruptions = {
        "segment": cut.segment[ends[possible]],
        "frame": cut.end[ends[possible]],
        "next_segment": targets[possible],
        "cost": costs[ends[possible], targets[possible]],
    }
    return {"successors": pd.DataFrame(successors), "interruptions": pd.DataFrame(interruptions)}


def _from_costs(tables: Tables, cut: Pieces) -> Rows | None:
    """Return the successor costs, or None if the tables do not contain them."""
    successors, interruptions = tables["successors"], tables["interruptions"]
    if len(successors) == 0:
        return None
    n_segments = len(cut.first) - 1
    costs = np.full((len(cut.segment), n_segments), np.inf)
    costs[cut.closing] = _numbers(successors["cost"]).reshape(-1, n_segments)
    starts = np.flatnonzero(~cut.closing)
    possible = cut.segment[starts][:, None] != np.arange(n_segments)[None]
    ends = costs[starts]
    ends[possible] = _numbers(interruptions["cost"])
    costs[starts] = ends
    return costs.__getitem__


def _foreign(library: Library) -> dict[str, pd.DataFrame]:
    """Return the tables ``body`` and ``poses``; they are empty for the body of the motion tables."""
    body, poses = motion_library.to_tables(library.recordings, library.body, library.fps)
    if library.body is STANDARD:
        return {"body": body.iloc[:0], "poses": poses.iloc[:0]}
    return {"body": body, "poses": poses}


def _library(tables: Tables) -> Library:
    table = tables["library"]
    if len(tables["body"]):
        recordings, body = motion_library.from_tables(tables["body"], tables["poses"])
        return Library(table, recordings, float(table["fps"].iloc[0]), body)
    motions = {name.removeprefix(MOTION): motion for name, motion in tables.items() if name.startswith(MOTION)}
    for record in dict.fromkeys(table["record"]):
        if record not in motions:
            raise UserError(f"the model has segments of record '{record}', but not its motion; train it again")
    whole = pd.DataFrame(
        {"record": list(motions), "segment": 0, "start_frame": 0, "end_frame": [len(m) for m in motions.values()]}
    )
    used = whole[whole["record"].isin(table["record"])]
    recordings = Library.of_motions(used, motions).recordings
    return Library(table, recordings, float(table["fps"].iloc[0]))


def _numbers(column: pd.Series) -> Floats:
    return np.array(column, dtype=np.float64)


def _square(column: pd.Series, n: int) -> Floats:
    return _numbers(column).reshape(n, n)
