"""How systems are run: trained once, given the speech that drives them, and held to what they declare."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd

from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.motion import skeleton
from cospeech.synthesis.declaration import System
from cospeech.synthesis.interface import Method, Model, Speech, Synthesis, Training, decoding, phrases_of
from cospeech.synthesis.registry import settings_of
from cospeech.synthesis.speech import Streams, driving_speech


class Trained(NamedTuple):
    """A model and the method that decodes it."""

    method: Method
    model: Model


class Driving(NamedTuple):
    """What drives the systems of one record.

    Attributes
    ----------
    streams : speech of the actor's records. record : the record to synthesise. frame_s : prosody frame in seconds.
    seed : the run's seed. shift_s : least shift of the control under its own, shifted speech.
    motion_fps, n_motion_frames : the record's motion, for systems that make motion.
    """

    streams: Streams
    record: str
    frame_s: float
    seed: int
    shift_s: float = 0.0
    motion_fps: float = 0.0
    n_motion_frames: int = 0

    def speech(self, system: System) -> Speech:
        """Return the speech that a system listens to."""
        speech = driving_speech(self.streams, self.record, self.frame_s, system.drive, self.seed, self.shift_s)
        return replace(speech, motion_fps=self.motion_fps, n_motion_frames=self.n_motion_frames)


def method_of(system: System) -> Method:
    """Return the module behind a declaration."""
    module: Any = importlib.import_module(system.method)
    return module


class Session:
    """The systems of one record: each is trained on what a fold knows, and those that share a model train it once.

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
        method = method_of(system)
        if system.model not in self._models:
            settings = settings_of(system, self.own.get(system.decoder))
            self._models[system.model] = method.train(self.training, {**self.shared, **settings})
        return Trained(method, self._models[system.model])

    def tables(self, system: System) -> dict[str, pd.DataFrame]:
        """Return the tables of a system's model."""
        method, model = self.trained(system)
        return method.to_tables(model)

    def synthesise(self, system: System, driving: Driving) -> Synthesis:
        """Return what a system makes of the speech that drives it, checked against its declaration.

        Raises
        ------
        UserError : where it returns something else than it declares, or of the wrong length.
        """
        speech = driving.speech(system)
        method, model = self.trained(system)
        made = method.synthesise(model, speech, driving.seed)
        problem = fault(system, made, speech)
        if problem:
            raise UserError(f"system '{system.name}' declares that it makes {system.makes}, but {problem}")
        return made

    def attempt(self, system: System, driving: Driving) -> Synthesis:
        """Return what a system of another package makes; where it fails, nothing, with the reason in ``decoding``."""
        try:
            return self.synthesise(system, driving)
        except UserError as error:
            reason = str(error)
        except Exception as error:  # whatever another package raises is its own failure, and not the run's
            reason = f"system '{system.name}', which declares {declared(system)}: {type(error).__name__}: {error}"
        return nothing(system, driving.speech(system), " ".join(reason.split()))


def declared(system: System) -> str:
    """Return in words what a system declares."""
    return f"needs {', '.join(system.needs) or 'nothing'} and makes {system.makes}"


def fault(system: System, made: Any, speech: Speech) -> str | None:
    """Return what is wrong with what a system returned, or None."""
    if not isinstance(made, Synthesis):
        return f"returned {type(made).__name__} where a Synthesis is expected"
    table = made.motion if system.makes == "motion" else made.phrases
    if not isinstance(table, pd.DataFrame):
        return "returned none"
    if system.makes == "motion":
        if len(table) != speech.n_motion_frames:
            return (
                f"its motion for record '{speech.record}' has {len(table)} frames; expected {speech.n_motion_frames}"
            )
        missing = [name for name in skeleton.columns() if name not in table.columns]
        return f"its motion lacks the column '{missing[0]}'" if missing else None
    try:
        segments.check(table, "its phrases")
    except UserError as error:
        return str(error)
    end = int(table["end_frame"].iloc[-1])
    if end != speech.n_frames:
        return f"its phrases for record '{speech.record}' end at frame {end}; expected {speech.n_frames}"
    return None


def nothing(system: System, speech: Speech, reason: str) -> Synthesis:
    """Return what stands for a system that failed: no phrase or frame, and the reason."""
    row = decoding(speech, failure=reason)
    if system.makes == "motion":
        return Synthesis(row, motion=skeleton.standing(1, 1.0).iloc[:0])
    return Synthesis(row, phrases=phrases_of(speech, [0], [""]).iloc[:0])
