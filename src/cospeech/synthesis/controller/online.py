"""The online controller (Levine et al. 2010, 6 and 7.2): one prosody frame of speech in, the motion that is due out.

At each time step, the beliefs over the hidden states are updated with the prosody that is known then; at the end of
each piece of a motion segment, the policy selects what follows. A motion frame is made when its time is over, so that
motion is a frame behind the speech.

While it runs, ``prepare`` changes the style, for which the policy is trained again, and calls for the gestures of a
keyword. The styles that a model has are ``energetic`` and ``calm`` (see ``model``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.motion.body import Body
from cospeech.synthesis.controller import control as control_layer
from cospeech.synthesis.controller import style
from cospeech.synthesis.controller.control import NEUTRAL, Control, Labels
from cospeech.synthesis.controller.inference import Beliefs
from cospeech.synthesis.controller.model import Model, train
from cospeech.synthesis.controller.policy import Policy
from cospeech.synthesis.controller.semantics import Player, Step
from cospeech.synthesis.controller.show import Screen
from cospeech.synthesis.controller.situations import Weights
from cospeech.synthesis.controller.steps import Listener, Syllable
from cospeech.synthesis.controller.tables import from_tables, to_tables
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.live import Controls, Heard, Stream

__all__ = ["body", "controls", "end", "from_tables", "prepare", "start", "step", "to_tables", "train"]

STYLE, KEYWORD = "style:", "keyword"
"""What can be controlled: ``style:<name>`` takes a number from 0 to 1, ``keyword`` takes a word."""


class State:
    """What the controller remembers of a stream."""

    def __init__(self, model: Model, stream: Stream) -> None:
        self.layer = model.control
        self.frame_s = stream.frame_s
        self.listener = Listener(model.pause_db)
        self.beliefs = Beliefs(model.layer)
        self.situation = Weights(self.layer.situations)
        self.weights = dict.fromkeys(list(self.layer.tones)[1:], 0.0)
        tone = self.layer.tones[NEUTRAL]
        labels = control_layer.labels(self.layer, tone.distances, tone.policy)
        self.player = Player(
            tone.policy, labels.words, self.layer.cut, self.layer.rows, labels.rest, self.layer.repetition
        )
        self.screen = Screen(self.layer, stream.motion_fps)
        self.n_steps = 0
        self.shown = Step(0, 0, False, 0.0)
        self.nothing = np.empty((0, 3 + 4 * len(self.layer.library.body.joints)))

    def next_frame(self) -> Floats:
        """Return the next motion frame, after the decisions that it needs."""
        current = self.screen.step
        while self.n_steps <= current:
            belief = self.beliefs.step(self.listener.at(self.n_steps * self.layer.step_s))
            self.shown = self.player.step(self.situation.of(belief))
            self.n_steps += 1
        return self.screen.next(self.shown.segment, self.shown.frame)

    def restyle(self, weights: dict[str, float], found: Policy, labels: Labels) -> None:
        """Continue with a policy, which is optimal for these degrees of styles, and with its labels of keywords."""
        self.weights = weights
        self.player.change(found, labels.words, labels.rest)


def body(model: Model) -> Body:
    """Return the body that the model moves, which is another one than ``STANDARD`` if its library is."""
    return model.control.library.body


def start(model: Model, stream: Stream, seed: int) -> State:
    """Return the state before anything is heard."""
    return State(model, stream)


def step(state: State, heard: Heard) -> Floats:
    """Return the motion frames that are due after one more prosody frame, (n, 3 + 4 J)."""
    for syllable in heard.syllables:
        state.listener.hear(Syllable(*(syllable[name] for name in Syllable._fields)))
    for word in heard.words:
        state.player.hear(word)
    heard_s = (heard.frame + 1) * state.frame_s
    if not state.screen.due(heard_s):
        return state.nothing
    made = state.next_frame()
    if not state.screen.due(heard_s):
        return made[None]
    rest = [state.next_frame()]
    while state.screen.due(heard_s):
        rest.append(state.next_frame())
    return np.array([made, *rest])


def end(state: State, speech: Speech) -> Floats:
    """Return the motion frames that are missing at the end of the speech."""
    missing = range(state.screen.shown, speech.n_motion_frames)
    return np.array([state.next_frame() for _ in missing]) if missing else state.nothing


def controls(model: Model) -> Controls:
    """Return the keywords and the styles of the model."""
    return Controls(tuple(model.control.keywords), tuple(model.control.tones)[1:])


def prepare(state: State, name: str, value: float | str) -> Callable[[], None]:
    """Return a function that changes the style of what follows, or calls for the gestures of a keyword.

    The policy of a style is trained here, which takes half a second. Nothing changes until the function is called, so
    that this may run in another thread.

    Parameters
    ----------
    name : ``style:<style>`` or ``keyword``.
    value : the degree to which the style should be expressed, from 0 to 1, where the rest is neutral; or the word.
        Degrees of several styles are added up, and reduced in proportion if their sum exceeds 1.

    Raises
    ------
    UserError : an unknown style, a degree that is not from 0 to 1, a word without a segment, or another name.
    """
    if name == KEYWORD:
        if value not in state.layer.keywords:
            known = ", ".join(state.layer.keywords) or "none; add some with 'cospeech library --keywords'"
            raise UserError(f"keyword '{value}' has no segment of the motion library; known keywords: {known}")
        return partial(state.player.hear, str(value))
    if not name.startswith(STYLE):
        raise UserError(f"'{name}' cannot be controlled; known are {KEYWORD} and {STYLE}<name>")
    wanted = name.removeprefix(STYLE)
    if wanted not in state.weights:
        known = ", ".join(state.weights) or "none, as it was trained on too little motion"
        raise UserError(f"the model has no style '{wanted}'; its styles: {known}")
    degree = float(value)
    if not 0.0 <= degree <= 1.0:
        raise UserError(f"style '{wanted}': {degree:g} is not a degree; give a number from 0 to 1")
    weights = state.weights | {wanted: degree}
    distances, found = in_style(state.layer, weights)
    labels = control_layer.labels(state.layer, distances, found)
    return partial(state.restyle, weights, found, labels)


class Styled(NamedTuple):
    """The expected distances (A, I) of a mixture of styles, and the policy that is optimal for them."""

    distances: Floats
    policy: Policy


def in_style(layer: Control, degrees: Mapping[str, float]) -> Styled:
    """Return the distances and the policy of a mixture of styles; what is missing to 1 is neutral."""
    total = max(1.0, sum(degrees.values()))
    shares = {name: degree / total for name, degree in degrees.items()}
    shares[NEUTRAL] = 1.0 - sum(shares.values())
    pure = [name for name, share in shares.items() if share == 1.0]
    if pure:
        tone = layer.tones[pure[0]]
        return Styled(tone.distances, tone.policy)
    weights = np.array([shares[name] for name in layer.tones])
    mixed = style.mixed_distances([tone.distances for tone in layer.tones.values()], weights)
    return Styled(mixed, control_layer.solve(layer, mixed))
