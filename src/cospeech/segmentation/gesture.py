"""Semi-supervised clustering of joint angles into gesture phrases (Özkul 2012, 4.3)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import parallel, parallel_start
from cospeech.markov.parallel import FREE, MUST, NEVER, Clamp, ParallelHMM
from cospeech.motion import skeleton
from cospeech.segmentation import labelled_hmm as models
from cospeech.segmentation.labelled_hmm import Labelled

REST = "rest"
OTHER = "everything else"
"""The branch that stands for all classes not yet added; it is gone from the finished model."""

LEAST_SPREAD_DEG = 1e-6
"""A joint angle that varies less is locked, and no feature."""


class Training(NamedTuple):
    """The model, how its training went (schema ``hmm_fit``), and what a user should know of it."""

    model: Labelled
    fit: pd.DataFrame
    notes: tuple[str, ...]


def features(motion: pd.DataFrame) -> pd.DataFrame:
    """Return the 24 gesture features of a motion table, one row a frame (Özkul 2012, eq. 4.7-4.8).

    The joint angles of both arms and forearms in degrees, and their first differences in degrees a frame, as
    ``d_<angle>``; the first frame's differences are 0.
    """
    angles = motion[skeleton.angle_columns(skeleton.ARM_JOINTS)]
    return pd.concat([angles, angles.diff().fillna(0.0).add_prefix("d_")], axis=1)


def spans(annotations: pd.DataFrame, fps: float, n_frames: int, states: int) -> pd.DataFrame:
    """Return a record's annotations as frames: start, end, gesture, and whether they are the whole phrase.

    What a rule proposed is the clear part of a phrase only. Annotations of fewer than ``states`` frames are left out:
    no pass through a branch is that short.
    """
    edges = np.ceil(annotations[["start_s", "end_s"]].to_numpy() * fps - 0.5).clip(0, n_frames).astype(np.int64)
    table = pd.DataFrame(
        {
            "start": edges[:, 0],
            "end": edges[:, 1],
            "gesture": annotations["gesture"].to_numpy(),
            "whole": (annotations["origin"] != "rule").to_numpy(),
        }
    )
    return table[table["end"] - table["start"] >= states].sort_values("start", ignore_index=True)


def clamp(known: pd.DataFrame, labels: tuple[str, ...], n_frames: int, states: int) -> Clamp:
    """Return what the labelled ``known`` spans of a record say about its frames.

    A span of a class in ``labels`` lies in one segment of that branch, and a whole phrase is that segment; a span of
    another class belongs to the branch of everything else, where there is one. A gap between two phrases that is too
    short for a segment goes to the phrase before it (at the start of a record, to the one after it).
    """
    allowed = np.ones((n_frames, len(labels)), dtype=bool)
    cuts = np.full(n_frames + 1, FREE, dtype=np.int8)
    previous = 0
    for start, end, gesture, whole in known.itertuples(index=False):
        if gesture in labels:
            allowed[start:end] = np.array(labels) == gesture
            cuts[start + 1 : end] = NEVER
            if whole:
                cuts[[start, end]] = MUST
                if 0 < start - previous < states:
                    cuts[previous if previous else start] = FREE
                previous = end
        elif OTHER in labels:
            allowed[start:end] = np.array(labels) == OTHER
    return Clamp(allowed, cuts[:n_frames])


def train(
    motions: dict[str, pd.DataFrame],
    annotations: pd.DataFrame,
    settings: dict[str, Any],
) -> Training:
    """Train one branch a gesture class from labelled examples and all frames (steps (i) to (vi) of 4.3, unattended).

    The model begins with rest and everything else. One class after the other is added, in the order of ``labels``:
    its branch starts from its examples, each split evenly into states; then Baum-Welch runs over all frames, with
    every example clamped to its branch. When the last class is in, everything else goes, and Baum-Welch runs again.

    Parameters
    ----------
    motions : motion tables by record.
    annotations : labelled examples (schema ``annotations``) of these records.
    settings : ``phrases.gesture`` of the configuration: labels, states, iterations, variance_floor, first_examples.

    Raises
    ------
    UserError : where there is no example at all, or no joint angle that changes.
    """
    labels, states = tuple(settings["labels"]), settings["states"]
    if settings["first_examples"] == "rules":
        from cospeech.segmentation import first_examples  # not above: what it brings along takes long to load

        annotations = first_examples.complete(annotations, motions, labels)
    tables = {record: features(motion) for record, motion in motions.items()}
    names, notes = _moving(tables)
    sequences = {record: models.frames_of(table, names) for record, table in tables.items()}
    known = {
        record: spans(
            annotations[annotations["record"] == record], skeleton.frame_rate(motions[record]), len(frames), states
        )
        for record, frames in sequences.items()
    }
    found = set(pd.concat(known.values())["gesture"])
    order = [label for label in (REST, *labels) if label in found]
    classes = tuple(dict.fromkeys(order))
    if not classes:
        raise UserError(
            f"{', '.join(motions)}: no labelled example of any gesture class; annotate some phrases of each class, "
            "or set phrases.gesture.first_examples to rules"
        )
    notes += [f"class '{label}' has no example and is left out" for label in labels if label not in classes]
    floor = parallel_start.variance_floor(list(sequences.values()), names, settings["variance_floor"])

    rest = _stretches(sequences, known, classes[:1], states)
    groups = [_examples(sequences, known, classes[0])] + ([rest] if rest else [])
    present = (classes[0], OTHER)[: len(groups)]
    hmm = parallel_start.from_segments(groups, states, floor)
    rows = []
    for added in range(1, len(classes) + 1):
        if added > 1:
            branch = parallel_start.from_segments([_examples(sequences, known, classes[added - 1])], states, floor)
            hmm, present = _with_branch(hmm, branch), (*present, classes[added - 1])
        fit = _baum_welch(hmm, present, sequences, known, floor, settings["iterations"])
        rows.append(models.fit_rows(fit, list(sequences.values()), added))
        hmm = fit.model
    if OTHER in present:
        keep = np.array(present) != OTHER
        hmm, present = _branches(hmm, np.flatnonzero(keep)), tuple(np.array(present)[keep])
        fit = _baum_welch(hmm, present, sequences, known, floor, settings["iterations"])
        rows.append(models.fit_rows(fit, list(sequences.values()), len(classes) + 1))
        hmm = fit.model
    table = pd.concat(rows, ignore_index=True)
    table["chosen"] = table["restart"] == table["restart"].max()
    in_order = [label for label in labels if label in present]
    hmm = _branches(hmm, np.array([present.index(label) for label in in_order]))
    return Training(Labelled(hmm, tuple(in_order), names), table, tuple(notes))


def phrases(model: Labelled, record: str, motion: pd.DataFrame, annotations: pd.DataFrame) -> pd.DataFrame:
    """Return the gesture phrases of a record at its motion's rate (schema ``segments``): the most likely path.

    The record's own annotations hold: what a person corrected stays as it was corrected. Rest has no phases that
    could begin anew: one rest after another is one.
    """
    fps, states = skeleton.frame_rate(motion), model.hmm.stay.shape[1]
    own = annotations[annotations["record"] == record]
    known = clamp(spans(own, fps, len(motion), states), model.labels, len(motion), states)
    return models.phrases(model, record, features(motion), fps, known, lasting=(REST,))


def _moving(tables: dict[str, pd.DataFrame]) -> tuple[tuple[str, ...], list[str]]:
    """Return the features that change, and a note on those that do not."""
    spread = pd.concat(tables.values()).std()
    moving = spread > LEAST_SPREAD_DEG
    if not moving.any():
        raise UserError(f"{', '.join(tables)}: no joint angle of the arms ever changes; check the motion files")
    locked = [str(name) for name in spread.index[~moving]]
    notes = [f"locked joint angles are no features: {', '.join(locked)}"] if locked else []
    return tuple(str(name) for name in spread.index[moving]), notes


def leave_one_out(
    motions: dict[str, pd.DataFrame], annotations: pd.DataFrame, settings: dict[str, Any]
) -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Return the phrases of all records by a model of all of them, and of each fold by a model without one record.

    Parameters
    ----------
    motions, annotations, settings : as in ``train``, of one actor.

    Returns
    -------
    Segment table of all records; and for each record that is held out, the segment table of the others.
    """

    def phrases_of(records: list[str]) -> pd.DataFrame:
        own = {record: motions[record] for record in records}
        model = train(own, annotations[annotations["record"].isin(records)], settings).model
        return pd.concat([phrases(model, record, motion, annotations) for record, motion in own.items()])

    records = list(motions)
    return phrases_of(records), {
        held_out: phrases_of([record for record in records if record != held_out]) for held_out in records
    }


def seen(model: Labelled, record: str, motion: pd.DataFrame) -> pd.DataFrame:
    """Return the gesture phrases that a model sees in a motion of which nobody has annotated anything."""
    nothing = pd.DataFrame({name: [] for name in ("record", "start_s", "end_s", "gesture", "origin")})
    return phrases(model, record, motion, nothing)


def _examples(sequences: dict[str, Floats], known: dict[str, pd.DataFrame], label: str) -> list[Floats]:
    return [
        frames[start:end]
        for record, frames in sequences.items()
        for start, end, gesture, _ in known[record].itertuples(index=False)
        if gesture == label
    ]


def _stretches(
    sequences: dict[str, Floats], known: dict[str, pd.DataFrame], classes: tuple[str, ...], states: int
) -> list[Floats]:
    """Return the stretches of the records that no example of ``classes`` covers."""
    stretches = []
    for record, frames in sequences.items():
        covered = known[record][known[record]["gesture"].isin(classes)]
        starts = np.append(0, covered["end"])
        ends = np.append(covered["start"], len(frames))
        stretches += [frames[a:b] for a, b in zip(starts, ends, strict=True) if b - a >= states]
    return stretches


def _with_branch(hmm: ParallelHMM, branch: ParallelHMM) -> ParallelHMM:
    """Return the model with one branch more, entered as often as the others on average."""
    share = 1.0 / (len(hmm.entry) + 1)
    return ParallelHMM(
        np.append(hmm.entry * (1 - share), share),
        *(np.concatenate(pair) for pair in zip(hmm[1:], branch[1:], strict=True)),
    )


def _branches(hmm: ParallelHMM, which: npt.NDArray[np.int64]) -> ParallelHMM:
    entry, *others = (values[which] for values in hmm)
    return ParallelHMM(entry / entry.sum(), *others)


def _baum_welch(
    hmm: ParallelHMM,
    present: tuple[str, ...],
    sequences: dict[str, Floats],
    known: dict[str, pd.DataFrame],
    floor: Floats,
    iterations: int,
) -> parallel.Fit:
    states = hmm.stay.shape[1]
    clamps = [clamp(known[record], present, len(frames), states) for record, frames in sequences.items()]
    return parallel.fit(hmm, list(sequences.values()), floor, iterations, clamps=clamps)
