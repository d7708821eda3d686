"""What makes motion of the speech that is heard: a live system, or another one that decodes again at every hop.

- A live system takes one prosody frame after another, exactly as when it synthesises a whole record. What it makes is
  therefore the same to the last bit.
- A system that plans the phrases of a whole record, such as the hidden semi-Markov model, decodes the speech of the
  last minute again at every hop of ``HOP_S``. The class of the last phrase is the gesture of this moment. What was
  shown before is not changed, even if it is decoded otherwise now. The last phrase is often revised: without a
  shortest duration, the bundled model makes 85 phrases per minute of five LibriVox sentences, compared with 27 from
  the whole recording. With the second of ``SHORTEST_S`` there are 39, which agree with those of the recording as well
  as without it.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import pandas as pd

from cospeech.api import ActorModel, HeadModel
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats.sound import RATE_HZ
from cospeech.kernels.jit import njit
from cospeech.live.changes import Make
from cospeech.live.hearing import STREAM, Hearing
from cospeech.live.phrases import Player
from cospeech.motion import library
from cospeech.motion.body import STANDARD, Body
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.live import ANGLES, Controls, Heard, Stream
from cospeech.synthesis.session import naming, synthesise

HOP_S = 0.25
"""Time between decodings of a system that is not live, in seconds."""

SHORTEST_S = 1.0
"""Shortest duration of a phrase of such a system, in seconds."""

N_ANGLES = len(ANGLES)

WHAT = {"motion": "motion", "head": "angles of the head"}
"""What a frame is, by what a system makes."""

SPEECH_NEEDS = {"prosody", "prosody_labels"}
"""The speech that a system which decodes again may need."""


class Performer(Protocol):
    """Makes motion, or angles of a head.

    Attributes
    ----------
    body : the body that moves.
    width : number of columns of a frame: 3 + 4 J of motion, or 3 of a head alone (see ``heads``).
    controls : what can be changed while it moves.
    """

    body: Body
    width: int
    controls: Controls

    def step(self, heard: Heard) -> Floats:
        """Return the next frames (n, width), possibly none, after something was heard."""

    def end(self, n_samples: int) -> Floats:
        """Return the last frames (n, width); ``n_samples`` is the length of the sound at 16 kHz."""

    def prepare(self, name: str, value: Any) -> Make:
        """Return a function that makes a change: of ``style:<name>`` to a number, or the ``keyword`` to a word.

        The preparation of a style takes time. It changes nothing and may run in another thread, while motion is made.

        Raises
        ------
        UserError : if there is no such style or keyword.
        """


def performer(model: ActorModel | HeadModel, hearing: Hearing, seed: int) -> Performer:
    """Return what makes motion, or moves the head, with a model.

    Raises
    ------
    UserError : if the system of the model needs the whole recording.
    """
    if model.system.live and model.system.makes != "phrases":
        return LiveFrames(model, hearing, seed)
    if isinstance(model, ActorModel) and model.system.makes == "phrases":
        if model.system.live:
            return Phrases(model, hearing, LiveSteps(model, hearing, seed))
        if set(model.system.needs) - {"gestures", "motion"} <= SPEECH_NEEDS:
            return Phrases(model, hearing, Redecoding(model, hearing, seed))
    raise UserError(
        f"the system '{model.system.name}' of this model needs the whole recording and cannot run live; "
        "use 'cospeech synthesize'"
    )


class LiveSteps:
    """A live system.

    Parameters
    ----------
    model : its model. hearing : what hears the speech. seed : seed of random draws.
    """

    def __init__(self, model: ActorModel | HeadModel, hearing: Hearing, seed: int) -> None:
        self._system, self._hearing = model.system, hearing
        method: Any = model.trained.method
        self._method = method
        self._fps = float(model.card["motion_fps"])
        with naming(self._system):
            self._state = method.start(model.trained.model, Stream(STREAM, hearing.frame_s, self._fps), seed)
            self.controls = method.controls(model.trained.model) if hasattr(method, "controls") else Controls()

    def step(self, heard: Heard) -> Any:
        """Return what the system makes of a prosody frame."""
        recent = self._hearing.recent
        if recent is not None:
            label, features = recent.latest("prosody_labels" in self._system.needs)
            heard = heard._replace(label=label, features=features | {"time_s": heard.time_s})
        try:
            return self._method.step(self._state, heard)
        except (Exception, SystemExit):
            with naming(self._system):  # entered only now, as this is called for every frame
                raise

    def end(self, n_samples: int) -> Any:
        """Return what the system makes when the speech ends."""
        frame_s = self._hearing.frame_s
        n_motion_frames = motion_frames(n_samples, self._fps)
        speech = Speech(
            STREAM, frame_s, self._hearing.n_frames, motion_fps=self._fps, n_motion_frames=n_motion_frames
        )
        with naming(self._system):
            return self._method.end(self._state, speech)

    def prepare(self, name: str, value: Any) -> Make:
        """Let the system prepare a change; see ``Performer``."""
        if not hasattr(self._method, "prepare"):
            raise UserError(_no_controls(self._system.name))
        with naming(self._system):
            made: Make = self._method.prepare(self._state, name, value)
        return made


@njit
def _finite(frames: Floats) -> bool:
    """Return whether all numbers of frames (n, W) are finite."""
    return bool(np.isfinite(frames).all())


class LiveFrames:
    """A live system that makes motion, or angles of the head; see ``LiveSteps`` for the parameters."""

    def __init__(self, model: ActorModel | HeadModel, hearing: Hearing, seed: int) -> None:
        self._name, self._makes = model.system.name, model.system.makes
        self._steps = LiveSteps(model, hearing, seed)
        self.prepare, self.controls = self._steps.prepare, self._steps.controls
        body_of = getattr(model.trained.method, "body", None)
        self.body: Body = STANDARD if body_of is None else body_of(model.trained.model)
        self.width = N_ANGLES if self._makes == "head" else 3 + 4 * len(self.body.joints)

    def step(self, heard: Heard) -> Floats:
        """Return the next frames; see ``Performer``."""
        return self._frames(self._steps.step(heard))

    def end(self, n_samples: int) -> Floats:
        """Return the last frames; see ``Performer``."""
        return self._frames(self._steps.end(n_samples))

    def _frames(self, made: Any) -> Floats:
        """Return what a step made as frames; it may be a motion table (see ``synthesis.live.Made``).

        Raises
        ------
        UserError : if it is not motion of the body, or not angles of a head, which outputs could not show.
        """
        if len(made) == 0:
            return np.empty((0, self.width))
        frames = library.from_motion(made).frames if isinstance(made, pd.DataFrame) else np.asarray(made)
        if frames.ndim != 2 or frames.shape[1] != self.width or not _finite(frames):
            raise UserError(
                f"system '{self._name}' declares that it makes {WHAT[self._makes]}, but it returned an array of "
                f"shape {frames.shape}, or one with NaN; its frames have {self.width} finite numbers"
            )
        return frames


class Redecoding:
    """A system that plans phrases, and decodes the speech of the last minute again at every hop.

    See ``LiveSteps`` for the parameters.
    """

    def __init__(self, model: ActorModel, hearing: Hearing, seed: int) -> None:
        assert hearing.recent is not None
        self._system, self._trained, self._seed = model.system, model.trained, seed
        self._recent = hearing.recent
        self._n_hop = max(1, round(HOP_S / hearing.frame_s))
        self._n_shortest = round(SHORTEST_S / hearing.frame_s)
        self._label: str | None = None
        self._start = -self._n_shortest
        self.controls = Controls()

    def step(self, heard: Heard) -> list[tuple[int, str]]:
        """Return the phrase that starts with this frame: none between hops, without speech, or too early."""
        if (heard.frame + 1) % self._n_hop or heard.frame < self._start + self._n_shortest:
            return []
        table = self._recent.table()
        if table is None:
            return []
        speech = Speech(
            STREAM,
            self._recent.frame_s,
            len(table),
            labels=self._recent.labels(table),
            prosody=table,
            driving_record=STREAM,
        )
        with naming(self._system):
            made = synthesise(self._system, self._trained, speech, self._seed)
        assert made.phrases is not None
        label = str(made.phrases["label"].iloc[-1])
        if label == self._label:
            return []
        self._label, self._start = label, heard.frame
        return [(heard.frame, label)]

    def end(self, n_samples: int) -> list[tuple[int, str]]:
        """Return no phrase: none starts when the speech ends."""
        return []

    def prepare(self, name: str, value: Any) -> Make:
        """Raise UserError: the system has no style and no keywords."""
        raise UserError(_no_controls(self._system.name))


class Phrases:
    """Makes motion of the phrases that a system starts.

    Parameters
    ----------
    model : the model of the system, with recorded gestures.
    hearing : what hears the speech.
    planner : returns phrases, as rows or pairs of start frame and class.
    """

    body = STANDARD
    width = 3 + 4 * len(STANDARD.joints)

    def __init__(self, model: ActorModel, hearing: Hearing, planner: LiveSteps | Redecoding) -> None:
        self._planner, self._frame_s = planner, hearing.frame_s
        self._fps = float(model.card["motion_fps"])
        self._player = Player(model.gestures, model.motions, self._fps)
        self._n_shown = 0
        self.prepare, self.controls = planner.prepare, planner.controls

    def step(self, heard: Heard) -> Floats:
        """Return the frames whose middle has been heard; see ``Performer``."""
        return self._play(self._planner.step(heard), int((heard.frame + 1) * self._frame_s * self._fps + 0.5))

    def end(self, n_samples: int) -> Floats:
        """Return the last frames; see ``Performer``."""
        return self._play(self._planner.end(n_samples), motion_frames(n_samples, self._fps))

    def _play(self, starting: Any, n_frames: int) -> Floats:
        """Start phrases, and return the frames before ``n_frames`` that were not shown yet."""
        if len(starting):
            for label in pd.DataFrame(starting, columns=["start_frame", "label"])["label"]:
                self._player.play(str(label))
        frames = [self._player.frame() for _ in range(n_frames - self._n_shown)]
        self._n_shown += len(frames)
        return np.array(frames).reshape(len(frames), self.width)


def motion_frames(n_samples: int, fps: float) -> int:
    """Return the number of motion frames of a sound of ``n_samples`` at 16 kHz."""
    return max(1, round(n_samples / RATE_HZ * fps))


def _no_controls(system: str) -> str:
    return f"the system '{system}' of this model has no styles and no keywords; leave out --style and --osc"
