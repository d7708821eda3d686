"""All scores of one synthesised record against the actual one, on the whole record and on its interior."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.data import segments
from cospeech.data.arrays import Integers
from cospeech.errors import UserError
from cospeech.metrics import agreement, boundaries, similarity

PARTS = ("whole", "interior")

BETTER = {
    **{"S": 1, "D": -1, "boundary_f1": 1, "frames_right": 1, "kappa": 1, "phrase_ratio": 0},
    **{"hand_speed_r": 1, "beat_alignment": 1, "frechet_distance": -1},
}
"""The measures, and whether more of each is better (1), less (-1), or neither (0: a ratio ought to be 1)."""


@dataclass(frozen=True)
class Rules:
    """How scores are taken.

    gestures : the labels, each of which has an S of its own.
    bins_s : widths of the duration histograms of S.
    max_duration_s : D_max of eq. 7.1; longer phrases count in the last bin.
    tolerance_s : greatest distance of a boundary that counts as found.
    head_s, tail_s : what the interior leaves out at a record's ends.
    frame_s : length of a prosody frame, on whose grid everything is scored.
    """

    gestures: tuple[str, ...]
    bins_s: tuple[float, ...]
    max_duration_s: float
    tolerance_s: float
    head_s: float
    tail_s: float
    frame_s: float


class Phrases(NamedTuple):
    """The phrases of one record on the prosody grid: start frames (L + 1,), the last the end, and labels (L,)."""

    starts: Integers
    labels: Integers


def phrases(table: pd.DataFrame, rules: Rules) -> Phrases:
    """Return the phrases of one record, put on the prosody grid by time.

    Raises
    ------
    UserError : a label that is no gesture of ``rules``.
    """
    fps = 1.0 / rules.frame_s
    on_grid = segments.resample(table, round(float(table["end_s"].iloc[-1]) * fps), fps)
    labels = pd.Index(rules.gestures).get_indexer(pd.Index(on_grid["label"]))
    if (labels < 0).any():
        label = on_grid["label"].iloc[int(np.argmin(labels))]
        raise UserError(
            f"record '{on_grid['record'].iloc[0]}': gesture '{label}' is not in the config's phrases.gesture.labels; "
            "add it there or rename it"
        )
    ends = on_grid["end_frame"].to_numpy()
    return Phrases(np.append(0, ends), labels.astype(np.int64))


class Scored(NamedTuple):
    """What is scored: the phrases of one record that a system planned, or that are seen in its motion."""

    system: str
    variant: str
    record: str
    phrases: str
    draw: int = 0


def of_draws(tables: Iterable[pd.DataFrame], phrases: str) -> dict[Scored, pd.DataFrame]:
    """Return the phrases of each system, variant, record and draw in tables of schema ``planned_phrases``.

    Parameters
    ----------
    phrases : ``planned`` or ``seen``.
    """
    found = {}
    for table in tables:
        for key, own in table.groupby(["system", "variant", "record", "draw"], sort=False):
            system, variant, record, draw = key
            found[Scored(str(system), str(variant), str(record), phrases, int(str(draw)))] = own
    return found


def with_motion(scores: pd.DataFrame, motion: Iterable[pd.DataFrame], actors: Mapping[str, str]) -> pd.DataFrame:
    """Return the table ``record_scores`` with the scores of the motion of the same systems and records added.

    Parameters
    ----------
    scores : the table, as ``table`` returns it.
    motion : tables of schema ``motion_scores``.
    actors : the actor of each record.
    """
    known = scores.loc[scores["phrases"] == "seen", ["system", "variant", "record"]].drop_duplicates()
    rows = pd.concat(motion, ignore_index=True).merge(known)
    rows = rows.assign(phrases="seen", actor=rows["record"].map(actors), gesture=None, bin_s=np.nan)
    for count in ("n_actual", "n_synthesised"):
        rows[count] = pd.array([pd.NA] * len(rows), dtype="Int64")
        scores = scores.assign(**{count: scores[count].astype("Int64")})
    return pd.concat([scores, rows[scores.columns]], ignore_index=True)


def table(
    synthesised: Mapping[Scored, pd.DataFrame],
    actual: Mapping[str, pd.DataFrame],
    actors: Mapping[str, str],
    rules: Rules,
    decoders: Mapping[str, str] | None = None,
) -> pd.DataFrame:
    """Return the table ``record_scores``, record by record.

    A system that made nothing of one record (it failed) is left out altogether, with its matched controls: its mean
    over the other records could not be compared with those of other systems. A matched control may leave out records
    that are too short for it; differences are then those of the records that both sides have.

    Parameters
    ----------
    synthesised : segment tables. actual : the actual segment table of each record. actors : the actor of each record.
    decoders : the system whose decoder each matched control runs.
    """
    owner = decoders or {}
    failed = {one.system for one, made in synthesised.items() if len(made) == 0 and one.system not in owner}
    of_record: dict[str, list[Scored]] = {record: [] for record in actors}
    for one, made in synthesised.items():
        if len(made) and one.system not in failed and owner.get(one.system) not in failed:
            of_record[one.record].append(one)
    found = []
    for record, systems in of_record.items():
        rows: list[dict[str, Any]] = []
        real = phrases(actual[record], rules)
        for one in systems:
            origin = one._asdict() | {"actor": actors[record]}
            rows += [origin | row for row in record_scores(real, phrases(synthesised[one], rules), rules)]
        found.append(pd.DataFrame(rows))
    return pd.concat(found, ignore_index=True).assign(recorded=np.nan)


def record_scores(actual: Phrases, synthesised: Phrases, rules: Rules) -> list[dict[str, Any]]:
    """Return every measure of one record, one row each (and for S one row a gesture and bin width).

    The *whole* is the whole record: every phrase, and every boundary, including the one at 0, as in the thesis. The
    *interior* leaves out the first ``head_s`` and the last ``tail_s``, where records resemble one another whatever
    is said. It consists of the durations of phrases that lie in it completely, the boundaries in it, and the frames
    in it. A boundary in the interior is still compared with the nearest actual boundary anywhere, except for the
    trivial one at 0. If the sequences differ in length, the actual one is cut, or its last phrase is prolonged.

    Returns
    -------
    Rows of measure, part, gesture, bin_s, value (NaN where undefined), n_actual and n_synthesised (phrases that
    count: of the gesture for S, else that start in the part), duration_s (of the part).
    """
    n_frames = int(synthesised.starts[-1])
    actual = _fit(actual, n_frames)
    frame_labels = [np.repeat(side.labels, np.diff(side.starts)) for side in (actual, synthesised)]
    rows: list[dict[str, Any]] = []
    for part in PARTS:
        low, high = 0, n_frames
        if part == "interior":
            low, high = segments.interior(n_frames, rules.frame_s, rules.head_s, rules.tail_s)
        common = {"part": part, "duration_s": (high - low) * rules.frame_s}
        rows += [common | row for row in _similarities(actual, synthesised, low, high, rules)]
        a, s = (_starts_in(side, low, high) * rules.frame_s for side in (actual, synthesised))
        targets = actual.starts[int(part == "interior") : -1] * rules.frame_s
        labels = (frame_labels[0][low:high], frame_labels[1][low:high])
        values = {
            "D": boundaries.distance(s, targets),
            "boundary_f1": boundaries.boundary_f1(s, a, rules.tolerance_s),
            "phrase_ratio": len(s) / len(a) if len(a) else math.nan,
            "frames_right": agreement.share_right(*labels),
            "kappa": agreement.kappa(*labels),
        }
        counts = {"n_actual": len(a), "n_synthesised": len(s)}
        rows += [common | counts | {"measure": measure, "value": value} for measure, value in values.items()]
    return rows


def _fit(sequence: Phrases, n_frames: int) -> Phrases:
    """Return the sequence with ``n_frames`` frames."""
    kept = sequence.starts[:-1] < n_frames
    return Phrases(np.append(sequence.starts[:-1][kept], n_frames), sequence.labels[kept])


def _starts_in(sequence: Phrases, low: int, high: int) -> Integers:
    starts = sequence.starts[:-1]
    return starts[(starts >= low) & (starts < high)]


def _similarities(actual: Phrases, synthesised: Phrases, low: int, high: int, rules: Rules) -> list[dict[str, Any]]:
    n_gestures = len(rules.gestures)
    counted = []
    for side in (actual, synthesised):
        inside = (side.starts[:-1] >= low) & (side.starts[1:] <= high)
        counted.append((np.diff(side.starts)[inside] * rules.frame_s, side.labels[inside]))
    counts = [np.bincount(labels, minlength=n_gestures).tolist() for _, labels in counted]
    rows = []
    for bin_s in rules.bins_s:
        histograms = [
            similarity.duration_histograms(durations_s, labels, n_gestures, bin_s, rules.max_duration_s)
            for durations_s, labels in counted
        ]
        values = similarity.similarities(*histograms).tolist()
        for gesture, value, n_actual, n_synthesised in zip(rules.gestures, values, *counts, strict=True):
            rows.append(
                {"measure": "S", "gesture": gesture, "bin_s": bin_s, "value": value}
                | {"n_actual": n_actual, "n_synthesised": n_synthesised}
            )
    return rows
