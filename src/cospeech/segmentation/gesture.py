"""Semi-supervised clustering of joint angles into gesture phrases (Özkul 2012, 4.3)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.markov import labelled_hmm, parallel, parallel_start
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.markov.parallel import FREE, MUST, NEVER, Clamp, ParallelHMM
from cospeech.motion import skeleton

REST = "rest"
OTHER = "everything else"
"""Label of the branch for all classes that have not been added yet; the final model does not contain it."""

MIN_DEVIATION_DEG = 1e-6
"""A joint angle with a smaller standard deviation is locked and not used as a feature."""


class Training(NamedTuple):
    """The trained model, its training history (schema ``hmm_fit``), and notes for the log."""

    model: LabelledHMM
    fit: pd.DataFrame
    notes: tuple[str, ...]


def features(motion: pd.DataFrame) -> pd.DataFrame:
    """Return the 24 gesture features of a motion table, one row per frame (Özkul 2012, eq. 4.7-4.8).

    The features are the joint angles of both arms and forearms in degrees, and their first differences ``d_<angle>``
    in degrees per frame, which are 0 in the first frame.
    """
    angles = motion[skeleton.angle_columns(skeleton.ARM_JOINTS)]
    return pd.concat([angles, angles.diff().fillna(0.0).add_prefix("d_")], axis=1)


def spans(annotations: pd.DataFrame, fps: float, n_frames: int, states: int) -> pd.DataFrame:
    """Return a record's annotations in frames: start, end, gesture, and whether they cover the whole phrase.

    An annotation consists of the frames whose centres lie in [start, end).
    Examples proposed by a rule cover only the clear part of a phrase. Annotations of fewer than ``states`` frames are
    dropped, because a pass through a branch has at least one frame per state.
    """
    centres = annotations[["start_s", "end_s"]].to_numpy() * fps - 0.5
    edges = (
        np.ceil(centres.round(6)).clip(0, n_frames).astype(np.int64)
    )  # rounded: a boundary may be a frame's centre
    table = pd.DataFrame(
        {
            "start": edges[:, 0],
            "end": edges[:, 1],
            "gesture": annotations["gesture"].to_numpy(),
            "whole": (annotations["origin"] != "rule").to_numpy(),
        }
    )
    return table[table["end"] - table["start"] >= states].sort_values("start", ignore_index=True)


def clamp(labelled: pd.DataFrame, labels: tuple[str, ...], n_frames: int, states: int) -> Clamp:
    """Return the constraints that the ``labelled`` spans of a record put on the path through its frames.

    A span of a class in ``labels`` lies within one segment of that branch; if it covers the whole phrase, it is that
    segment. A span of any other class belongs to the branch ``OTHER``, if present. A gap between two phrases that is
    too short for a segment is added to the preceding phrase (at the start of a record, to the following one).
    """
    allowed = np.ones((n_frames, len(labels)), dtype=bool)
    cuts = np.full(n_frames + 1, FREE, dtype=np.int8)
    previous = 0
    for start, end, gesture, whole in labelled.itertuples(index=False):
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
    """Train one branch per gesture class from annotated examples and all frames (Özkul 2012, 4.3, steps (i) to (vi)).

    The steps run without manual intervention. The initial model has two branches, rest and everything else. The other
    classes are added one by one, in the order of ``labels``: the branch of a class is initialised from its examples,
    each divided evenly into states; then Baum-Welch runs over all frames, with each example clamped to its branch.
    After the last class, the branch for everything else is removed and Baum-Welch runs once more.

    Parameters
    ----------
    motions : motion tables by record.
    annotations : annotated examples (schema ``annotations``) of these records.
    settings : ``phrases.gesture`` of the configuration: labels, states, iterations, variance_floor, first_examples.

    Raises
    ------
    UserError : if there are no examples, or all joint angles are constant.
    """
    labels, states = tuple(settings["labels"]), settings["states"]
    if settings["first_examples"] == "rules":
        from cospeech.segmentation import first_examples  # imported here because its dependencies load slowly

        annotations = first_examples.add_proposals(annotations, motions, labels)
    tables = {record: features(motion) for record, motion in motions.items()}
    names, notes = _varying_features(tables)
    sequences = {record: labelled_hmm.feature_matrix(table, names) for record, table in tables.items()}
    labelled = {
        record: spans(
            annotations[annotations["record"] == record], skeleton.frame_rate(motions[record]), len(frames), states
        )
        for record, frames in sequences.items()
    }
    annotated = set(pd.concat(labelled.values())["gesture"])
    classes = tuple(dict.fromkeys(label for label in (REST, *labels) if label in annotated))
    if not classes:
        if settings["first_examples"] == "rules":
            raise UserError(
                f"{', '.join(motions)}: the rules find no gesture of {states} frames or more in the joint angles; "
                "check that the arms move as they did in the recording, or annotate some phrases of each class"
            )
        raise UserError(
            f"{', '.join(motions)}: no annotated example of any gesture class lasts {states} frames or more; "
            "annotate some phrases of each class, or set phrases.gesture.first_examples to rules"
        )
    notes += [f"class '{label}' has no examples and is left out" for label in labels if label not in classes]
    floor = parallel_start.variance_floor(list(sequences.values()), names, settings["variance_floor"])

    remainder = _uncovered(sequences, labelled, classes[:1], states)
    groups = [_examples(sequences, labelled, classes[0])] + ([remainder] if remainder else [])
    present = (classes[0], OTHER)[: len(groups)]
    hmm = parallel_start.from_segments(groups, states, floor)
    rows = []
    for added in range(1, len(classes) + 1):
        if added > 1:
            branch = parallel_start.from_segments([_examples(sequences, labelled, classes[added - 1])], states, floor)
            hmm, present = _add_branch(hmm, branch), (*present, classes[added - 1])
        fit = _baum_welch(hmm, present, sequences, labelled, floor, settings["iterations"])
        rows.append(labelled_hmm.fit_table(fit, list(sequences.values()), added))
        hmm = fit.model
    if OTHER in present:
        keep = np.array(present) != OTHER
        hmm, present = _select_branches(hmm, np.flatnonzero(keep)), tuple(np.array(present)[keep])
        fit = _baum_welch(hmm, present, sequences, labelled, floor, settings["iterations"])
        rows.append(labelled_hmm.fit_table(fit, list(sequences.values()), len(classes) + 1))
        hmm = fit.model
    table = pd.concat(rows, ignore_index=True)
    table["chosen"] = table["restart"] == table["restart"].max()
    in_order = [label for label in labels if label in present]
    hmm = _select_branches(hmm, np.array([present.index(label) for label in in_order]))
    return Training(LabelledHMM(hmm, tuple(in_order), names), table, tuple(notes))


def phrases(model: LabelledHMM, record: str, motion: pd.DataFrame, annotations: pd.DataFrame) -> pd.DataFrame:
    """Return the gesture phrases (schema ``segments``) of a record at its motion frame rate by Viterbi decoding.

    The annotations of the record constrain the path, so manual corrections are preserved. Consecutive rest
    segments are merged, because rest has no phases from which the start of another one could be recognised.
    """
    fps, states = skeleton.frame_rate(motion), model.hmm.stay.shape[1]
    labelled = spans(annotations[annotations["record"] == record], fps, len(motion), states)
    constraints = clamp(labelled, model.labels, len(motion), states)
    return labelled_hmm.phrases(model, record, features(motion), fps, constraints, merged=(REST,))


def _varying_features(tables: dict[str, pd.DataFrame]) -> tuple[tuple[str, ...], list[str]]:
    """Return the features that vary, and a note on those that do not."""
    deviation = pd.concat(tables.values()).std()
    varying = deviation > MIN_DEVIATION_DEG
    if not varying.any():
        raise UserError(f"{', '.join(tables)}: all joint angles of the arms are constant; check the motion files")
    locked = [str(name) for name in deviation.index[~varying]]
    notes = [f"locked joint angles are not used as features: {', '.join(locked)}"] if locked else []
    return tuple(str(name) for name in deviation.index[varying]), notes


def leave_one_out(
    motions: dict[str, pd.DataFrame], annotations: pd.DataFrame, settings: dict[str, Any]
) -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Segment the records of one actor with a model trained on all of them, and with the model of each fold.

    Parameters
    ----------
    motions, annotations, settings : as in ``train``, for one actor.

    Returns
    -------
    The segments of all records by the model of all records; and for each held-out record, the segments of the other
    records by a model that was trained without it.
    """

    def segment(records: list[str]) -> pd.DataFrame:
        selected = {record: motions[record] for record in records}
        model = train(selected, annotations[annotations["record"].isin(records)], settings).model
        return pd.concat([phrases(model, record, motion, annotations) for record, motion in selected.items()])

    records = list(motions)
    return segment(records), {
        held_out: segment([record for record in records if record != held_out]) for held_out in records
    }


def unconstrained_phrases(model: LabelledHMM, record: str, motion: pd.DataFrame) -> pd.DataFrame:
    """Return the gesture phrases of a motion without annotations (see ``phrases``)."""
    no_annotations = pd.DataFrame({name: [] for name in ("record", "start_s", "end_s", "gesture", "origin")})
    return phrases(model, record, motion, no_annotations)


def _examples(sequences: dict[str, Floats], labelled: dict[str, pd.DataFrame], label: str) -> list[Floats]:
    return [
        frames[start:end]
        for record, frames in sequences.items()
        for start, end, gesture, _ in labelled[record].itertuples(index=False)
        if gesture == label
    ]


def _uncovered(
    sequences: dict[str, Floats], labelled: dict[str, pd.DataFrame], classes: tuple[str, ...], states: int
) -> list[Floats]:
    """Return the parts of the records that are not covered by examples of ``classes``."""
    parts = []
    for record, frames in sequences.items():
        covered = labelled[record][labelled[record]["gesture"].isin(classes)]
        starts = np.append(0, covered["end"])
        ends = np.append(covered["start"], len(frames))
        parts += [frames[a:b] for a, b in zip(starts, ends, strict=True) if b - a >= states]
    return parts


def _add_branch(hmm: ParallelHMM, branch: ParallelHMM) -> ParallelHMM:
    """Return the model with one more branch, whose entry probability is the mean of all branches."""
    share = 1.0 / (len(hmm.entry) + 1)
    return ParallelHMM(
        np.append(hmm.entry * (1 - share), share),
        *(np.concatenate(pair) for pair in zip(hmm[1:], branch[1:], strict=True)),
    )


def _select_branches(hmm: ParallelHMM, which: npt.NDArray[np.int64]) -> ParallelHMM:
    """Return the model with only the branches ``which``, in that order, its entry probabilities normalised."""
    entry, *others = (values[which] for values in hmm)
    return ParallelHMM(entry / entry.sum(), *others)


def _baum_welch(
    hmm: ParallelHMM,
    present: tuple[str, ...],
    sequences: dict[str, Floats],
    labelled: dict[str, pd.DataFrame],
    floor: Floats,
    iterations: int,
) -> parallel.Fit:
    states = hmm.stay.shape[1]
    clamps = [clamp(labelled[record], present, len(frames), states) for record, frames in sequences.items()]
    return parallel.fit(hmm, list(sequences.values()), floor, iterations, clamps=clamps)
