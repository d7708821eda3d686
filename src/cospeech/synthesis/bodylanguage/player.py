"""Body language as speech is heard: observations in, poses out (Levine 2009, chapter 5).

Head, arms and legs are streams of their own, each with its own decisions. Their subunits are joined to one desired
pose per frame, and the body that is shown follows it by blending (5.5).
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.motion import skeleton
from cospeech.motion.blending import Blender, Transitions
from cospeech.motion.library import Library
from cospeech.synthesis.bodylanguage import forward
from cospeech.synthesis.bodylanguage.model import SECTIONS, Model
from cospeech.synthesis.bodylanguage.observations import (
    N_OBSERVATIONS,
    PRIOR_SYLLABLES,
    Listener,
    Statistics,
)
from cospeech.synthesis.bodylanguage.player_kernels import (
    NONE,
    Beliefs,
    Memory,
    Rules,
    Sections,
    advance,
    begin,
    known,
)
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.live import Heard, Stream

N_UNIFORMS = 1024
"""Number of random numbers that are drawn at once."""

NOTHING = np.empty(0, dtype=np.int64)
"""No observations."""

MOST_OBSERVED = 16
"""Number of observations that are handled at once."""

MOST_UNIFORMS = 2 * len(SECTIONS) * (MOST_OBSERVED + 1)
"""Number of random numbers that are needed at once."""


class Player:
    """The state of a live system: what has been heard, what is believed, and what is shown.

    Parameters
    ----------
    model : the actor's model.
    stream : what is known of the speech before it is heard.
    seed : seed of the run.
    by_model, at_syllables : how subunits are selected, see ``player_kernels.Rules``.

    Attributes
    ----------
    listener, sections, beliefs, memory : what has been heard, the packed models, what is believed, what is shown.
    n_frames : number of frames of motion that have been made.
    """

    def __init__(self, model: Model, stream: Stream, seed: int, *, by_model: bool, at_syllables: bool) -> None:
        library = model.library.at_rate(stream.motion_fps)
        self._fps, self._frame_s = stream.motion_fps, stream.frame_s
        self.listener = Listener(Statistics(model.mean, model.deviation, PRIOR_SYLLABLES), model.wait_s)
        mode = forward.MODES.index(model.mode)
        rules = Rules(by_model, at_syllables, mode, float(np.radians(model.tolerance_deg)))
        initial, sections = _sections(model, library)
        self._rng = random_source(seed, "bodylanguage", stream.record)
        memory = _memory(initial.shape[1], len(sections.members), self._rng)
        self._known, self.sections, self.beliefs, self.memory = known(
            sections, _beliefs(initial, mode), memory, rules
        )
        self._observed_s = 0.0
        self.n_frames = 0
        n_joints = len(library.body.joints)
        self._desired = np.empty((2, 3 + 4 * n_joints))
        self._poses = [part for row in self._desired for part in (row[:3], row[3:].reshape(n_joints, 4))]
        self._nothing = np.empty((0, 3 + 4 * n_joints))
        smooth = model.blending == "smooth"
        self._blender = Transitions(library.body, self._fps) if smooth else Blender(library.body)
        begin(self.sections, initial, self.memory)

    def hear(self, heard: Heard) -> Floats:
        """Return the frames of motion up to the end of a prosody frame, (n, 3 + 4 J)."""
        time_s = (heard.frame + 1) * self._frame_s
        observed = self.listener.hear(time_s, heard.syllables)
        end = int(time_s * self._fps + 0.5 + 1e-9)
        if not observed:
            return self._frames(end, NOTHING, 0.0)
        passed_s, self._observed_s = time_s - self._observed_s, time_s
        return self._frames(end, np.array([one.observation for one in observed], dtype=np.int64), passed_s)

    def frames(self, end: int) -> Floats:
        """Return the frames of motion from those that have been shown up to ``end``, (n, 3 + 4 J)."""
        return self._frames(end, NOTHING, 0.0)

    def _frames(self, end: int, observations: Integers, passed_s: float) -> Floats:
        """Return the frames of motion up to ``end``, after some observations."""
        n = max(end - self.n_frames, 0)
        if n == 0 and len(observations) == 0:
            return self._nothing
        while len(observations) > MOST_OBSERVED:
            self._advance(observations[:MOST_OBSERVED], passed_s, False)
            observations, passed_s = observations[MOST_OBSERVED:], 0.0
        self._advance(observations, passed_s, n > 0)
        made = np.empty((n, self._nothing.shape[1]))
        for place in range(n):
            if place > 0:
                self._advance(NOTHING, 0.0, True)
            made[place] = self._blender.step(*self._poses)
        self.n_frames += n
        return made

    def _advance(self, observations: Integers, passed_s: float, wanted: bool) -> None:
        self._refill()
        advance(*self._known, self._blender.pose, observations, passed_s, wanted, self._desired)

    def _refill(self) -> None:
        if self.memory.used[0] > N_UNIFORMS - MOST_UNIFORMS:
            self._rng.random(out=self.memory.uniforms)
            self.memory.used[0] = 0


def step(state: Player, heard: Heard) -> Floats:
    """Return the frames of motion up to the end of a prosody frame, (n, 3 + 4 J)."""
    return state.hear(heard)


def end(state: Player, speech: Speech) -> Floats:
    """Return the frames of motion that are missing when the speech ends, (n, 3 + 4 J)."""
    return state.frames(speech.n_motion_frames)


def _sections(model: Model, library: Library) -> tuple[Floats, Sections]:
    """Return the initial distributions (S, N) and the packed models of all sections."""
    chains = [model.chains[section] for section in SECTIONS]
    n = max(len(chain.initial) for chain in chains)
    rows = library.table["segment"].to_numpy(dtype=np.int64)
    begin, n_frames = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    begin[rows], n_frames[rows] = library.start, library.end - library.start
    section = model.subunits["section"].map(SECTIONS.index).to_numpy(dtype=np.int64)
    cluster = model.subunits["cluster"].to_numpy(dtype=np.int64)
    members = np.lexsort((cluster, section))
    key = (section * (n + 1) + cluster)[members]
    first = np.searchsorted(key, np.arange(len(SECTIONS))[:, None] * (n + 1) + np.arange(n + 1))
    emissions = np.zeros((len(SECTIONS), N_OBSERVATIONS + 1, 2, n))
    for s, chain in enumerate(chains):
        emissions[s, :N_OBSERVATIONS, :, : len(chain.initial)] = chain.emissions
        emissions[s, N_OBSERVATIONS, :, : len(chain.initial)] = 1.0
    after_start, after = (_padded([getattr(chain, name) for chain in chains], n) for name in ("after_start", "after"))
    sparse = [forward.successors(*matrices) for matrices in zip(after_start, after, strict=True)]
    links = max(one.cluster.shape[1] for one in sparse)
    successor = np.zeros((len(chains), n, links), dtype=np.int64)
    more = np.zeros((len(chains), n, links, 2))
    for s, one in enumerate(sparse):
        successor[s, :, : one.cluster.shape[1]], more[s, :, : one.cluster.shape[1]] = one.cluster, one.more
    joints = np.array([[joint in skeleton.SECTIONS[name] for joint in library.body.joints] for name in SECTIONS])
    return _padded([chain.initial for chain in chains], n), Sections(
        _padded([chain.continuing for chain in chains], n),
        after_start,
        after,
        np.stack([one.base for one in sparse]),
        np.stack([one.n_more for one in sparse]),
        successor,
        more,
        np.stack([_padded(list(chain.logit.T), n).T for chain in chains]).copy(),
        _padded([chain.length_s for chain in chains], n, 1.0),
        emissions,
        members,
        first,
        cluster,
        begin,
        n_frames,
        joints,
        library.poses.root_m,
        library.poses.rotations,
        library.before,
    )


def _padded(arrays: list[Floats], n: int, value: float = 0.0) -> Floats:
    """Return arrays, (N_i,) or (N_i, N_i), padded to n along each axis and stacked."""
    padded = np.full((len(arrays), *(n for _ in arrays[0].shape)), value)
    for row, array in zip(padded, arrays, strict=True):
        row[tuple(slice(size) for size in array.shape)] = array
    return padded


def _memory(n_clusters: int, n_members: int, rng: np.random.Generator) -> Memory:
    n_sections = len(SECTIONS)
    return Memory(
        segment=np.zeros(n_sections, dtype=np.int64),
        frame=np.zeros(n_sections, dtype=np.int64),
        started=np.zeros(n_sections, dtype=np.int64),
        ended=np.zeros((n_sections, n_clusters), dtype=np.int64),
        probability=np.zeros(n_sections),
        now=np.zeros(1, dtype=np.int64),
        observation=np.full(1, NONE, dtype=np.int64),
        passed_s=np.zeros(1),
        uniforms=rng.random(N_UNIFORMS),
        used=np.zeros(1, dtype=np.int64),
        gamma=np.empty(n_clusters + 1),
        distances=np.empty(n_members),
    )


def _beliefs(initial: Floats, mode: int) -> Beliefs:
    """Return the beliefs before the first observation, in both halves."""
    first = [[forward.first(row, mode) for row in initial] for _ in range(2)]
    return Beliefs(*(np.array([[one[part] for one in half] for half in first]) for part in range(5)))
