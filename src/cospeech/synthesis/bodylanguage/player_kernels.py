"""Compiled decisions of all body sections: which subunit to show next, and the pose that it asks for."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit
from cospeech.synthesis.bodylanguage import forward
from cospeech.synthesis.bodylanguage.observations import N_OBSERVATIONS
from cospeech.synthesis.bodylanguage.packing import four, one, pack, three, two

NONE = N_OBSERVATIONS
"""The observation before the first one, which says nothing."""

N_MOTION = 3
"""Number of the fields of ``Sections`` that are the motion of a library, which is too large for another copy."""


class Rules(NamedTuple):
    """How subunits are selected (2009, chapters 5 to 7).

    Attributes
    ----------
    by_model : whether the model selects the next subunit; otherwise, all of the section are equally likely.
    at_syllables : whether an observation can interrupt a subunit; otherwise, all run to completion.
    mode : how the elapsed share is treated, see ``forward``.
    tolerance : difference between the least pose distance and that of a subunit that may be selected, in radians.
    """

    by_model: bool
    at_syllables: bool
    mode: int
    tolerance: float


class Sections(NamedTuple):
    """The models of S body sections, their M subunits and the motion of these.

    N is the largest number of clusters of a section; what the other sections lack is zero.

    Attributes
    ----------
    continuing (S, N), after_start, after (S, N, N), logit (S, N, 2), length_s (S, N) : see ``chain.Chain``.
    base (S, N, 2), n_more (S, N), successor (S, N, L), more (S, N, L, 2) : see ``forward.Successors``.
    emissions : (S, 37, 2, N) with 1 for the observation ``NONE``.
    members : (M,) subunits sorted by section and cluster. first : (S, N + 1) where the members of each cluster begin.
    cluster : (M,) cluster of each subunit. begin : (M,) its first frame in the library. n_frames : (M,) its length.
    joints : (S, J) 1 where a joint belongs to a section. The root position belongs to the last one.
    root_m (F, 3), rotations (F, J, 4), before (F,) : see ``motion.library.Library``.
    """

    continuing: Floats
    after_start: Floats
    after: Floats
    base: Floats
    n_more: Integers
    successor: Integers
    more: Floats
    logit: Floats
    length_s: Floats
    emissions: Floats
    members: Integers
    first: Integers
    cluster: Integers
    begin: Integers
    n_frames: Integers
    joints: Integers
    root_m: Floats
    rotations: Floats
    before: Integers


class Beliefs(NamedTuple):
    """The forward probabilities of S sections before and after the last observation; see ``forward.Belief``.

    ``Memory.now`` is the index of those after it on the first axis, which has length 2.
    """

    start: Floats
    entry: Floats
    elapsed: Floats
    odds: Floats
    n_entries: Integers


class Memory(NamedTuple):
    """What is shown, section by section, and working memory.

    Attributes
    ----------
    segment : (S,) subunit. frame : (S,) number of its frames that have been shown. started : (S,) 1 if no
        observation has continued it yet. ended : (S, N) 1 for clusters whose subunits ended after the last
        observation.
    probability : (S,) probability of the last decision.
    now : (1,) see ``Beliefs``. observation : (1,) the last one. passed_s : (1,) time between it and the one before.
    uniforms : (U,) random numbers. used : (1,) number of those that are used.
    gamma, distances : (N + 1,) and (M,) working memory.
    """

    segment: Integers
    frame: Integers
    started: Integers
    ended: Integers
    probability: Floats
    now: Integers
    observation: Integers
    passed_s: Floats
    uniforms: Floats
    used: Integers
    gamma: Floats
    distances: Floats


Known = tuple[Floats, Integers, Integers, Floats, Floats, Integers, bool, bool, int, float]
"""What compiled code receives: the fields of ``packing.Packed``, which contain everything but the motion; the motion
(see ``Sections``); and the fields of ``Rules``. Named tuples would take microseconds to receive."""


def known(
    sections: Sections, beliefs: Beliefs, memory: Memory, rules: Rules
) -> tuple[Known, Sections, Beliefs, Memory]:
    """Return what compiled code receives, and sections, beliefs and memory as views of it."""
    n, m = len(Sections._fields) - N_MOTION, len(Beliefs._fields)
    packed, views = pack([*sections[:n], *beliefs, *memory])
    return (
        (*packed, sections.root_m, sections.rotations, sections.before, *rules),
        Sections(*views[:n], *sections[n:]),
        Beliefs(*views[n : n + m]),
        Memory(*views[n + m :]),
    )


@njit
def _unpacked(floats: Any, integers: Any, at: Any, root_m: Any, rotations: Any, before: Any) -> Any:
    """Return sections, beliefs and memory."""
    sections = Sections(
        two(floats, at, 0), three(floats, at, 1), three(floats, at, 2), three(floats, at, 3), two(integers, at, 4),
        three(integers, at, 5), four(floats, at, 6), three(floats, at, 7), two(floats, at, 8), four(floats, at, 9),
        one(integers, at, 10), two(integers, at, 11), one(integers, at, 12), one(integers, at, 13),
        one(integers, at, 14), two(integers, at, 15), root_m, rotations, before,
    )  # fmt: skip
    beliefs = Beliefs(
        three(floats, at, 16),
        four(floats, at, 17),
        four(floats, at, 18),
        four(floats, at, 19),
        three(integers, at, 20),
    )
    memory = Memory(
        one(integers, at, 21), one(integers, at, 22), one(integers, at, 23), two(integers, at, 24),
        one(floats, at, 25), one(integers, at, 26), one(integers, at, 27), one(floats, at, 28), one(floats, at, 29),
        one(integers, at, 30), one(floats, at, 31), one(floats, at, 32),
    )  # fmt: skip
    return sections, beliefs, memory


@njit
def _uniform(memory: Any) -> float:
    memory.used[0] += 1
    return memory.uniforms[memory.used[0] - 1]


@njit
def _any_of(members: Any, memory: Any) -> int:
    """Return one of the members, each with equal probability."""
    return members[min(int(_uniform(memory) * len(members)), len(members) - 1)]


@njit
def pose_distance(rotations: Any, pose: Any, joints: Any) -> float:
    """Return the root mean square angle in radians between the joints of a section in two poses.

    Parameters
    ----------
    rotations : (J, 4). pose : (3 + 4 J,) root position and rotations. joints : (J,) the joints that count.
    """
    total, count = 0.0, 0
    for joint in range(len(joints)):
        if joints[joint]:
            at = 3 + 4 * joint
            cosine = 0.0
            for axis in range(4):
                cosine += rotations[joint, axis] * pose[at + axis]
            total += (2.0 * np.arccos(min(1.0, abs(cosine)))) ** 2
            count += 1
    return np.sqrt(total / count)


@njit
def _similar(members: Any, sections: Any, memory: Any, s: int, pose: Any, tolerance: float) -> int:
    """Return one of the members that begin in a pose similar to the current one, each with equal probability (5.5).

    These are the members whose pose distance exceeds the least one by at most ``tolerance``.
    """
    least = np.inf
    for k in range(len(members)):
        begin = sections.begin[members[k]]
        memory.distances[k] = pose_distance(sections.rotations[begin], pose, sections.joints[s])
        least = min(least, memory.distances[k])
    n_near = 0
    for k in range(len(members)):
        if memory.distances[k] <= least + tolerance:
            n_near += 1
    place = min(int(_uniform(memory) * n_near), n_near - 1)
    for k in range(len(members)):
        if memory.distances[k] <= least + tolerance:
            if place == 0:
                return members[k]
            place -= 1
    return members[0]


@njit
def _half(beliefs: Any, half: int, s: int) -> Any:
    start, entry, elapsed, odds, n_entries = beliefs
    return start[half, s], entry[half, s], elapsed[half, s], odds[half, s], n_entries[half, s]


@njit
def _update(sections: Any, beliefs: Any, memory: Any, s: int, mode: int) -> None:
    """Write the belief after the last observation of one section."""
    now = memory.now[0]
    forward.update(
        sections.continuing[s],
        (sections.base[s], sections.n_more[s], sections.successor[s], sections.more[s]),
        sections.emissions[s, memory.observation[0]], sections.logit[s], sections.length_s[s], memory.passed_s[0],
        memory.ended[s], mode, _half(beliefs, 1 - now, s), _half(beliefs, now, s),
    )  # fmt: skip


@njit
def _decide(sections: Any, rules: Any, beliefs: Any, memory: Any, s: int, pose: Any) -> None:
    """Update the belief of one section; continue the shown subunit, or start another one.

    A subunit that is over cannot continue, which is evidence for the belief, too (5.4).
    """
    gamma, segment = memory.gamma, memory.segment[s]
    n, cluster = len(gamma) - 1, sections.cluster[segment]
    over = memory.frame[s] >= sections.n_frames[segment]
    if over:
        memory.ended[s, cluster] = 1
    if rules.by_model:
        _update(sections, beliefs, memory, s, rules.mode)
    forward.direct(
        sections.continuing[s], sections.after_start[s], sections.after[s],
        sections.emissions[s, memory.observation[0]], sections.logit[s], cluster, memory.started[s],
        memory.frame[s] / sections.n_frames[segment], over, gamma,
    )  # fmt: skip
    if rules.by_model:
        forward.combine(_half(beliefs, memory.now[0], s), cluster, gamma)
    else:  # all other subunits together are the first alternative
        total = 0.0
        for k in range(n + 1):
            total += gamma[k]
            gamma[k] = 0.0 if k < n else gamma[n] / total
        gamma[0] = 1.0 - gamma[n]
    chosen = forward.draw(gamma, _uniform(memory))
    memory.probability[s] = gamma[chosen]
    if chosen == n:
        memory.started[s] = 0
        return
    if rules.by_model:
        members = sections.members[sections.first[s, chosen] : sections.first[s, chosen + 1]]
        memory.segment[s] = _similar(members, sections, memory, s, pose, rules.tolerance)
    else:
        memory.segment[s] = _any_of(sections.members[sections.first[s, 0] : sections.first[s, n]], memory)
    memory.frame[s] = 0
    memory.started[s] = 1


@njit
def begin(sections: Any, initial: Any, memory: Any) -> None:
    """Start a random subunit of each section, of a cluster that is drawn from its initial distribution (S, N)."""
    for s in range(len(initial)):
        chosen = forward.draw(initial[s], _uniform(memory))
        memory.segment[s] = _any_of(
            sections.members[sections.first[s, chosen] : sections.first[s, chosen + 1]], memory
        )
        memory.frame[s] = 0
        memory.started[s] = 1
        memory.probability[s] = initial[s, chosen]


@njit
def advance(
    floats: Any,
    integers: Any,
    layout: Any,
    root_m: Any,
    rotations: Any,
    before: Any,
    by_model: bool,
    at_syllables: bool,
    mode: int,
    tolerance: float,
    pose: Any,
    observations: Any,
    passed_s: float,
    wanted: bool,
    desired: Any,
) -> None:
    """Make the decisions of observations (5.2 and 5.3), and find the next desired pose.

    The shown subunits may be interrupted by an observation. A subunit that is over between two observations was not
    expected to be: then, the last observation is examined again (5.4).

    Parameters
    ----------
    floats, ..., tolerance : see ``Known``.
    pose : (3 + 4 J,) the frame shown last.
    observations : (n,) observations that become known at the same time.
    passed_s : time between the first of them and the one before.
    wanted : whether there is a next frame.
    desired : (2, 3 + 4 J) for the pose and the one before it in its recordings.
    """
    sections, beliefs, memory = _unpacked(floats, integers, layout, root_m, rotations, before)
    rules = Rules(by_model, at_syllables, mode, tolerance)
    for k in range(len(observations)):
        memory.now[0] = 1 - memory.now[0]
        memory.observation[0] = observations[k]
        memory.passed_s[0] = passed_s if k == 0 else 0.0
        for s in range(len(memory.segment)):
            for i in range(memory.ended.shape[1]):
                memory.ended[s, i] = 0
            if rules.at_syllables:
                _decide(sections, rules, beliefs, memory, s, pose)
            else:
                memory.started[s] = 0
                if rules.by_model:
                    _update(sections, beliefs, memory, s, rules.mode)
    if not wanted:
        return
    for s in range(len(memory.segment)):
        if memory.frame[s] >= sections.n_frames[memory.segment[s]]:
            _decide(sections, rules, beliefs, memory, s, pose)
        frame = sections.begin[memory.segment[s]] + memory.frame[s]
        memory.frame[s] += 1
        for row in range(2):
            if row == 1:
                frame = sections.before[frame]
            for joint in range(sections.joints.shape[1]):
                if sections.joints[s, joint]:
                    for axis in range(4):
                        desired[row, 3 + 4 * joint + axis] = sections.rotations[frame, joint, axis]
            if s == len(memory.segment) - 1:
                for axis in range(3):
                    desired[row, axis] = sections.root_m[frame, axis]
