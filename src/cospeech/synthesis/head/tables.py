"""Joint patterns, input-output HMMs and noise as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.markov.iohmm import IOHMM
from cospeech.markov.parallel_symbols import SymbolHMM
from cospeech.synthesis.head.generation import TIMES, Noise
from cospeech.synthesis.live import ANGLES

PARTS = ("initial", "transition", "emission")
"""The distributions of an input-output HMM, in the order of its fields."""


def of_symbols(model: SymbolHMM, streams: tuple[str, ...]) -> pd.DataFrame:
    """Return a model as a table of schema ``symbol_hmm``: one row per branch, state, stream and symbol."""
    parts = []
    for stream, values, weight in zip(streams, model.emissions, model.weights, strict=True):
        branch, state, symbol = (index.ravel() for index in np.indices(values.shape))
        own = {
            "branch": branch,
            "state": state,
            "entry_probability": model.entry[branch],
            "stay_probability": model.stay[branch, state],
            "stream": stream,
            "weight": weight,
            "symbol": symbol,
            "probability": values.ravel(),
        }
        parts.append(pd.DataFrame(own))
    return pd.concat(parts, ignore_index=True)


def symbols_in(table: pd.DataFrame, streams: tuple[str, ...]) -> SymbolHMM:
    """Return the model of ``of_symbols``."""
    shape = int(table["branch"].max()) + 1, int(table["state"].max()) + 1
    parts = [table[table["stream"] == stream] for stream in streams]

    def in_shape(part: pd.DataFrame, name: str) -> Floats:
        return part[name].to_numpy(dtype=float).reshape(*shape, -1).copy()

    return SymbolHMM(
        in_shape(parts[0], "entry_probability")[:, 0, 0],
        in_shape(parts[0], "stay_probability")[:, :, 0],
        tuple(in_shape(part, "probability") for part in parts),
        tuple(float(part["weight"].iloc[0]) for part in parts),
    )


def of_iohmms(models: Mapping[int, IOHMM]) -> pd.DataFrame:
    """Return models by look-ahead as a table of schema ``iohmm``: one row per probability."""
    parts = []
    for ahead, model in models.items():
        for part, values in zip(PARTS, model, strict=True):
            places = [index.ravel() for index in np.indices(values.shape)]
            begin = places[1] if part != "initial" else None
            own = {"melody": places[0], "state": begin, "target": places[-1], "probability": values.ravel()}
            parts.append(pd.DataFrame({"look_ahead_frames": ahead, "part": part} | own))
    return pd.concat([part.astype({"state": "Int64"}) for part in parts], ignore_index=True)


def iohmms_in(table: pd.DataFrame) -> dict[int, IOHMM]:
    """Return the models of ``of_iohmms``."""
    aheads = dict.fromkeys(table["look_ahead_frames"].tolist())
    return {ahead: _iohmm_in(table[table["look_ahead_frames"] == ahead]) for ahead in aheads}


def _iohmm_in(table: pd.DataFrame) -> IOHMM:
    values = {part: table.loc[table["part"] == part, "probability"].to_numpy(dtype=float) for part in PARTS}
    n_inputs = int(table["melody"].max()) + 1
    initial, transitions, emissions = (values[part].copy() for part in PARTS)
    n_states = len(initial) // n_inputs
    return IOHMM(
        initial.reshape(n_inputs, n_states),
        transitions.reshape(n_inputs, n_states, n_states),
        emissions.reshape(n_inputs, n_states, -1),
    )


def of_noise(noise: Mapping[str, Noise]) -> pd.DataFrame:
    """Return the noise of each system as a table of schema ``head_noise``: one row per system, time and angle."""
    parts = []
    for system, own in noise.items():
        part, axis = (index.ravel() for index in np.indices(own.deviation.shape))
        columns = {"time_frames": TIMES[part], "angle": np.array(ANGLES, dtype=object)[axis]}
        parts.append(pd.DataFrame({"system": system, **columns, "deviation_deg": own.deviation.ravel()}))
    return pd.concat(parts, ignore_index=True)


def noise_in(table: pd.DataFrame) -> dict[str, Noise]:
    """Return the noise of ``of_noise``."""
    return {
        str(system): Noise(own["deviation_deg"].to_numpy(dtype=float).reshape(-1, len(ANGLES)).copy())
        for system, own in table.groupby("system", sort=False)
    }


def of_examples(examples: Sequence[tuple[str, int, Integers]]) -> pd.DataFrame:
    """Return records, first frames and patterns (T, 2) of head and melody as a table of schema ``head_examples``."""
    parts = []
    for stretch, (record, first, symbols) in enumerate(examples):
        frames = {"stretch": stretch, "record": record, "frame": first + np.arange(len(symbols))}
        parts.append(pd.DataFrame({**frames, "head": symbols[:, 0], "melody": symbols[:, 1]}))
    return pd.concat(parts, ignore_index=True)


def examples_in(table: pd.DataFrame) -> list[tuple[str, int, Integers]]:
    """Return the examples of ``of_examples``."""
    found = []
    for _, own in table.groupby("stretch", sort=False):
        symbols = np.ascontiguousarray(own[["head", "melody"]].to_numpy(dtype=np.int64))
        found.append((str(own["record"].iloc[0]), int(own["frame"].iloc[0]), symbols))
    return found
