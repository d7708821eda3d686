"""How systems are run: trained once, driven by speech, and checked against what they declare."""

from __future__ import annotations

import importlib
import logging
import traceback
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple, get_args

import numpy as np
import pandas as pd

from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.motion import skeleton
from cospeech.synthesis import live
from cospeech.synthesis.declaration import Output, System
from cospeech.synthesis.interface import Method, Model, Speech, Synthesis, Training, decoding
from cospeech.synthesis.registry import settings_of
from cospeech.synthesis.speech import Streams, Wrong, driving_speeches

log = logging.getLogger("cospeech")


class Trained(NamedTuple):
    """A model and the method that decodes it."""

    method: Method
    model: Model


class Driving(NamedTuple):
    """What drives the systems of one record.

    Attributes
    ----------
    streams : speech of the actor's records. record : the record to synthesise. frame_s : prosody frame in seconds.
    seed : the run's seed. wrong : how matched controls are driven by the wrong speech.
    motion_fps, n_motion_frames : the record's motion, for systems that make motion.
    """

    streams: Streams
    record: str
    frame_s: float
    seed: int
    wrong: Wrong = Wrong(0.0)
    motion_fps: float = 0.0
    n_motion_frames: int = 0

    def speeches(self, system: System) -> list[Speech]:
        """Return the speech that drives a system, once per draw; none if a matched control leaves the record out."""
        drawn = driving_speeches(
            self.streams, self.record, self.frame_s, system.drive, self.seed, self.wrong, system.draws
        )
        return [replace(speech, motion_fps=self.motion_fps, n_motion_frames=self.n_motion_frames) for speech in drawn]


def method_of(system: System) -> Method:
    """Return the module behind a declaration."""
    module: Any = importlib.import_module(system.method)
    return module


class Session:
    """The systems of one record: each is trained on the same fold, and those that share a model train it once.

    Parameters
    ----------
    training : what the systems learn from.
    shared : the section ``synthesis`` of the configuration.
    own : settings of single systems, by name.
    """

    def __init__(self, training: Training, shared: Mapping[str, Any], own: Mapping[str, Any]) -> None:
        self.training = training
        self.shared = shared
        self.own = own
        self._models: dict[str, Model] = {}

    def trained(self, system: System) -> Trained:
        """Return the method of a system and its model."""
        with naming(system):
            method = method_of(system)
            if system.model not in self._models:
                settings = settings_of(system, self.own.get(system.decoder))
                self._models[system.model] = method.train(self.training, {**self.shared, **settings})
            return Trained(method, self._models[system.model])

    def tables(self, system: System) -> dict[str, pd.DataFrame]:
        """Return the tables of a system's model.

        Raises
        ------
        UserError : if they are not the tables that it declares.
        """
        method, model = self.trained(system)
        with naming(system):
            found = method.to_tables(model)
            problem = table_fault(system, found)
        if problem:
            raise UserError(
                f"system '{system.name}' declares that its model consists of the tables "
                f"{', '.join(system.tables) or 'none'}, but {problem}"
            )
        return found

    def reports(self, system: System, driving: Driving) -> dict[str, pd.DataFrame]:
        """Return the reports of a system about its first draw.

        Raises
        ------
        UserError : if they are not those that it declares.
        """
        trained = self.trained(system)
        method: Any = trained.method
        with naming(system):
            found = method.report(self.training, trained.model, driving.speeches(system)[0], driving.seed)
            problem = _tables_fault(found, system.report_schemas)
        if problem:
            raise UserError(f"system '{system.name}' declares the reports {', '.join(system.reports)}, but {problem}")
        return found

    def synthesise(self, system: System, driving: Driving) -> list[Synthesis]:
        """Return what a system makes of the speech that drives it, once per draw; see ``perform``."""
        trained = self.trained(system)
        return [
            perform(system, trained, speech, driving.seed, self.training.labels)
            for speech in driving.speeches(system)
        ]

    def attempt(self, system: System, driving: Driving) -> list[Synthesis]:
        """Return what a system of another package makes; if it or its model is wrong, nothing, with the reason."""
        speeches = driving.speeches(system)
        try:
            made = self.synthesise(system, driving)
            self.tables(system)
            for one in made:
                self._check_units(system, one)
        except UserError as error:
            return [nothing(system, speech, str(error)) for speech in speeches[:1]]
        return made

    def _check_units(self, system: System, made: Synthesis) -> None:
        """Raise UserError if no phrase has a label of the training records, from which unit selection takes units."""
        learnt = {label for table in self.training.gestures.values() for label in table["label"]}
        if made.phrases is not None and not made.phrases["label"].isin(learnt).any():
            raise UserError(f"system '{system.name}': no label of its phrases occurs in the training records")


def perform(
    system: System, trained: Trained, speech: Speech, seed: int, labels: Collection[str] | None = None
) -> Synthesis:
    """Return what a trained system makes of speech, checked against its declaration.

    Parameters
    ----------
    labels : the gesture classes that phrases may have; None: any.

    Raises
    ------
    UserError : if it returns something other than what it declares, or something of the wrong length.
    """
    with naming(system):
        made = synthesise(system, trained, speech, seed)
    problem = fault(system, made, speech, labels)
    if problem:
        raise UserError(f"system '{system.name}' declares that it makes {system.makes}, but {problem}")
    return made


def synthesise(system: System, trained: Trained, speech: Speech, seed: int) -> Synthesis:
    """Return what a trained system makes of speech; a live system takes it frame by frame."""
    if system.live:
        method: Any = trained.method
        return live.by_steps(method, system.makes, trained.model, speech, seed)
    return trained.method.synthesise(trained.model, speech, seed)


@contextmanager
def naming(system: System) -> Iterator[None]:
    """Turn an error in the code of another package into a UserError that names the system and what it declares.

    The log gets the traceback. Errors in the code of cospeech pass unchanged.
    """
    try:
        yield
    except (Exception, SystemExit) as error:
        if system.method.split(".")[0] == __name__.split(".")[0]:
            raise
        log.info(traceback.format_exc())
        reason = str(error) if isinstance(error, UserError) else f"{type(error).__name__}: {error}"
        words = " ".join(reason.split())
        raise UserError(f"system '{system.name}', which declares that it {declared(system)}: {words}") from error


def declared(system: System) -> str:
    """Return in words what a system declares."""
    return f"needs {', '.join(system.needs) or 'nothing'} and makes {system.makes}"


def fault(system: System, made: Any, speech: Speech, labels: Collection[str] | None = None) -> str | None:
    """Return what is wrong with what a system returned for the speech, or None.

    Parameters
    ----------
    labels : the gesture classes that phrases may have; None: any.
    """
    if not isinstance(made, Synthesis):
        return f"it returned an object of type {type(made).__name__}, not Synthesis"
    if not isinstance(getattr(made, system.makes), pd.DataFrame):
        return f"it returned no {system.makes}"
    for other in get_args(Output):
        if other != system.makes and getattr(made, other) is not None:
            return f"it also returned {other}"
    try:
        problem = _phrases_fault(made.phrases, speech, labels) if made.phrases is not None else None
        problem = problem or (_motion_fault(made.motion, speech) if made.motion is not None else None)
        problem = problem or (_head_fault(made.head, speech) if made.head is not None else None)
        return problem or _decoding_fault(made.decoding, speech)
    except UserError as error:
        return str(error)


def _motion_fault(motion: pd.DataFrame, speech: Speech) -> str | None:
    where = f"its motion for record '{speech.record}'"
    if len(motion) != speech.n_motion_frames:
        return f"{where} has {len(motion)} frames; expected {speech.n_motion_frames}"
    missing = [name for name in skeleton.columns() if name not in motion.columns]
    if missing:
        return f"{where} lacks the column '{missing[0]}'"
    unknown = [name for name in motion.columns if name not in skeleton.columns()]
    if unknown:
        return f"{where} has an unknown column '{unknown[0]}'"
    tables.validate(motion, "motion", where)
    return _times_fault(motion, speech, where)


def _head_fault(head: pd.DataFrame, speech: Speech) -> str | None:
    where = f"its head angles for record '{speech.record}'"
    if len(head) != speech.n_motion_frames:
        return f"{where} have {len(head)} frames; expected {speech.n_motion_frames}"
    tables.validate(head, "head", where)
    return _times_fault(head, speech, where)


def _times_fault(table: pd.DataFrame, speech: Speech, where: str) -> str | None:
    times_s = segments.frame_times(speech.n_motion_frames, speech.motion_fps)
    in_order = np.array_equal(table["frame"], np.arange(len(table)))
    if not (in_order and np.allclose(table["time_s"], times_s, rtol=0.0, atol=1e-6)):
        return f"the frames of {where} are not those of {speech.motion_fps:g} frames per second"
    return None


def _phrases_fault(phrases: pd.DataFrame, speech: Speech, labels: Collection[str] | None) -> str | None:
    where = "its phrases"
    tables.validate(phrases, "segments", where)
    segments.check(phrases, where)
    if labels is not None and not phrases["label"].isin(list(labels)).all():
        strange = next(label for label in phrases["label"] if label not in labels)
        return f"{where} have an unknown label '{strange}'; known are {', '.join(labels)}"
    others = [record for record in phrases["record"] if record != speech.record]
    if others:
        return f"{where} are those of record '{others[0]}'; expected '{speech.record}'"
    end = int(phrases["end_frame"].iloc[-1])
    if end != speech.n_frames:
        return f"{where} for record '{speech.record}' end at frame {end}; expected {speech.n_frames}"
    edges_s = phrases[["start_frame", "end_frame"]].to_numpy() * speech.frame_s
    if not np.allclose(phrases[["start_s", "end_s"]], edges_s, rtol=0.0, atol=1e-6):
        return f"the times of {where} are not those of frames of {speech.frame_s:g} s"
    return None


def _decoding_fault(row: Any, speech: Speech) -> str | None:
    if not (isinstance(row, pd.DataFrame) and len(row) == 1):
        return "its decoding is not a table of one row"
    tables.validate(row, "decoding", "its decoding")
    record = row["record"].iloc[0]
    return None if record == speech.record else f"its decoding is that of record '{record}'"


def table_fault(system: System, found: Any) -> str | None:
    """Return what is wrong with the tables of a system's model, or None."""
    return _tables_fault(found, system.table_schemas)


def _tables_fault(found: Any, schemas: Mapping[str, str]) -> str | None:
    """Return what is wrong with tables that should have these schemas, by name, or None."""
    if not (isinstance(found, Mapping) and all(isinstance(table, pd.DataFrame) for table in found.values())):
        return "it returned no tables by name"
    if set(found) != set(schemas):
        return f"it returned {', '.join(found) or 'none'}"
    try:
        for name, schema in schemas.items():
            tables.validate(found[name], schema, f"its table '{name}'")
    except UserError as error:
        return str(error)
    return None


def nothing(system: System, speech: Speech, reason: str) -> Synthesis:
    """Return what stands for a system that failed: a table without a row, and the reason."""
    row = decoding(speech, failure=" ".join(reason.split()))
    if system.makes == "motion":
        return Synthesis(row, motion=tables.empty("motion"))
    if system.makes == "head":
        return Synthesis(row, head=tables.empty("head"))
    return Synthesis(row, phrases=tables.empty("segments"))
