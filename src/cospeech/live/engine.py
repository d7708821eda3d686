"""The engine: sound is read, heard, turned into motion and shown, in one thread and in constant memory."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from cospeech.api import ActorModel, HeadModel
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.sound import FEW_CLIPPED
from cospeech.live.changes import Changing, Listener
from cospeech.live.delays import Delays
from cospeech.live.hearing import Hearing
from cospeech.live.outputs import Output
from cospeech.live.performing import Performer, performer
from cospeech.live.recogniser import Recogniser
from cospeech.live.sound import Source
from cospeech.synthesis.live import Heard

PIECE_S = 0.025
"""Length of the pieces in which longer chunks of sound are processed, in seconds."""

WAIT_S = 0.1
"""Longest time in seconds that the engine waits for sound before it looks whether it was stopped."""

STALL_S = 2.0
"""Time without sound after which the engine says that it waits, in seconds."""

AHEAD_S, FASTER = 0.1, 1.05
"""How far sound may be ahead of the time since it began, in seconds and as a factor.

Clocks differ, and a program that records may have begun a little earlier.
"""

WARM_UP_HZ = 48000
"""Sampling rate of the sound that everything is tried with, which is not the internal one."""

Note = Callable[[str], None]


class Engine:
    """Runs until the sound ends or ``stop`` is called.

    Where somebody watches an output, sound that arrives faster than it is spoken is held back, so that the motion has
    the right speed. After a stall, the engine catches up with what has piled up.

    Parameters
    ----------
    source : where the sound comes from.
    hearing : what hears it.
    performer : what makes motion.
    outputs : where the motion goes.
    fps : frame rate of the motion.
    note : says in one line what the user should know.
    listeners : where changes of style and keywords come from.
    recogniser : what recognises keywords in the sound; it is one of the listeners, too.

    Attributes
    ----------
    n_frames : number of frames shown.
    arrived_s : when the sound arrived that is processed, as ``time.perf_counter`` tells it.
    out_delays : from the arrival of the sound until the motion that it completed is out. Sound that is held back
        arrives when it would have been spoken.
    syllable_delays : from the peak of a syllable until it is known.
    """

    def __init__(
        self,
        source: Source,
        hearing: Hearing,
        performer: Performer,
        outputs: Sequence[Output],
        fps: float,
        note: Note,
        listeners: Sequence[Listener] = (),
        recogniser: Recogniser | None = None,
    ) -> None:
        self._source, self._hearing, self._performer, self._outputs = source, hearing, performer, outputs
        self._fps, self._note, self._recogniser = fps, note, recogniser
        self._listeners = listeners if recogniser is None else (*listeners, recogniser)
        self._changing = Changing(performer.prepare, note)
        self._stopped = False
        self._watched = source.in_real_time or any(output.in_real_time for output in outputs)
        self._n_heard = 0
        self._begin_s = self.arrived_s = 0.0
        self.n_frames = 0
        self.out_delays, self.syllable_delays = Delays(), Delays()

    def stop(self) -> None:
        """End the run soon; may be called by a signal handler or another thread."""
        self._stopped = True

    def run(self) -> None:
        """Run until the sound ends or ``stop`` is called, and complete all outputs.

        Raises
        ------
        UserError : if the system fails, or an output cannot be completed. All others are completed all the same.
        """
        gc.collect()
        gc.freeze()  # what is loaded stays, so that collections need not look at it
        try:
            for piece in self._pieces():
                if self._recogniser is not None:
                    self._recogniser.hear(piece)
                self._process(self._hearing.push(piece))
            self._end()
        finally:
            gc.unfreeze()
            self._close()

    def _pieces(self) -> Iterator[Floats]:
        """Yield the sound in pieces, none before its time."""
        size = max(1, round(PIECE_S * self._source.rate_hz))
        heard_s = time.perf_counter()
        self._begin_s = heard_s if self._source.begun_s is None else self._source.begun_s
        waiting = False
        while not self._stopped:
            self._changing.listen(self._listeners)
            samples = self._source.read(WAIT_S)
            if samples is None:
                return
            now_s = time.perf_counter()
            if not len(samples):
                if not waiting and now_s - heard_s > STALL_S:
                    waiting = True
                    self._note(f"no sound for {STALL_S:g} s; waiting for more")
                continue
            if waiting:
                waiting = False
                self._note(f"sound again after {now_s - heard_s:.1f} s")
            for first in range(0, len(samples), size):
                piece = samples[first : first + size]
                self._n_heard += len(piece)
                self.arrived_s = now_s
                self._wait()
                if self._stopped:
                    return
                yield piece
            heard_s = time.perf_counter()

    def _wait(self) -> None:
        """Wait until the sound read so far would have been spoken, if somebody watches."""
        if not self._watched:
            return
        spoken_s = self._n_heard / self._source.rate_hz
        due_s = self._begin_s + (spoken_s if self._source.in_real_time else spoken_s / FASTER - AHEAD_S)
        while not self._stopped and (left_s := due_s - time.perf_counter()) > 0:
            time.sleep(min(left_s, WAIT_S))
            self.arrived_s = due_s

    def _process(self, frames: Iterator[Heard]) -> None:
        for heard in frames:
            for syllable in heard.syllables:
                self.syllable_delays.add(syllable["known_s"] - syllable["peak_s"])
            self._show(self._performer.step(heard))

    def _show(self, frames: Floats) -> None:
        for pose in frames:
            time_s = (self.n_frames + 0.5) / self._fps
            for output in self._outputs:
                output.show(self.n_frames, time_s, pose)
            self.n_frames += 1
            self.out_delays.add(time.perf_counter() - self.arrived_s)

    def _end(self) -> None:
        """Hear and show what is left."""
        self.arrived_s = time.perf_counter()
        self._process(self._hearing.finish())
        if self._hearing.n_frames:
            self._show(self._performer.end(self._hearing.n_samples))

    def remarks(self) -> list[str]:
        """Return what was wrong with the sound, one line each."""
        troubles = self._hearing.troubles
        lines = []
        if troubles.n_not_finite:
            lines.append(f"{troubles.n_not_finite} samples were not finite numbers, and counted as silence")
        if troubles.n_full_scale > FEW_CLIPPED:
            lines.append(f"{troubles.n_full_scale} samples at full scale: recorded too loud")
        if self._source.n_lost:
            lines.append(f"{self._source.n_lost} blocks of sound were lost because the machine is too slow")
        return lines

    def _close(self) -> None:
        """Complete all outputs, and raise the first error only then."""
        errors: list[UserError] = []
        self._source.close()
        self._changing.close()
        for listener in self._listeners:
            listener.close()
        for output in self._outputs:
            try:
                output.close()
            except UserError as error:
                errors.append(error)
        for other in errors[1:]:
            self._note(str(other))
        if errors:
            raise errors[0]


def warm_up(model: ActorModel | HeadModel) -> None:
    """Run a model on a second of buzzing, so that everything is loaded before somebody speaks."""
    hearing = listening(model, WARM_UP_HZ)
    made = performer(model, hearing, 0)
    time_s = np.arange(WARM_UP_HZ) / WARM_UP_HZ
    buzz = (0.3 + 0.2 * np.sin(8 * np.pi * time_s)) * (2.0 * (120.0 * time_s % 1.0) - 1.0)
    for heard in hearing.push(buzz):
        made.step(heard)
    for heard in hearing.finish():
        made.step(heard)
    made.end(hearing.n_samples)


def listening(model: ActorModel | HeadModel, rate_hz: int) -> Hearing:
    """Return what hears sound of a sampling rate for a model."""
    clusters = model.prosody_model if isinstance(model, ActorModel) else None
    return Hearing(rate_hz, model.system.needs, model.card["speech"], clusters, model.card["seed"])
