"""Semantic gestures: a word that is recognised calls for a gesture with its meaning (Levine et al. 2010, 8.1).

While a label is pending, each piece of a segment that does not match it costs C_sem more. A recogniser reports a word
after it was spoken. A matching segment is therefore entered not at its first frame but where its pose is nearest to
the current one, within its first part, so that the stroke is not missed. Once it is entered, the label is reset.

A label leaves most of the decision process as it is: to enter a matching segment a' at its frame f' is a further
continuation, and what it is worth is known from the policy without labels,

    D_int(a, f_k, a', f') + sum over j of P_n(j | i) * (expected discounted cost from f' on in state j).

The values while the label is pending follow from the same policy iteration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.synthesis.controller import policy
from cospeech.synthesis.controller.library import Path, Pieces, Rows
from cospeech.synthesis.controller.policy import CONTINUE, Policy

LATEST_START = 0.5
"""A segment is entered within this share of its length; the paper does not state its fraction."""

COST = 100.0
"""C_sem of a piece of a segment that does not match; in the paper, "a large value"."""


class Entrances(NamedTuple):
    """How the N segments that match a label are entered after each of B pieces.

    Attributes
    ----------
    segment : (N,) the matching segments.
    frame : (B, N) f'_start, the frame at which each is entered.
    cost : (B, N) D_int to that frame.
    """

    segment: Integers
    frame: Integers
    cost: Floats


class Label(NamedTuple):
    """What a controller needs while a label is pending: the entrances of its segments, and the policy until then."""

    entrances: Entrances
    pending: Policy


def entrances(
    cut: Pieces, pose: Floats, penalty: float, frame_poses: Mapping[int, Floats], latest: float = LATEST_START
) -> Entrances:
    """Return the best frame of each matching segment to enter it after each piece.

    Parameters
    ----------
    pose : (B, P) weighted pose at the end of each piece; penalty : of an interruption (see ``library.Successors``).
    frame_poses : weighted pose at each frame, (n, P), of the segments that match the label.
    latest : share of the length of a segment after which it may not be entered.

    Raises
    ------
    UserError : if no segment matches, or one is not in the library.
    """
    if not frame_poses:
        raise UserError("a keyword has no segment; assign one in the file of keywords, or remove the keyword")
    n_segments = len(cut.first) - 1
    unknown = [a for a in frame_poses if not 0 <= a < n_segments]
    if unknown:
        raise UserError(f"segment {unknown[0]} of a keyword is not in the library, which has {n_segments} segments")
    frames, costs = [], []
    for poses in frame_poses.values():
        allowed = poses[: max(1, int(latest * len(poses)))]
        apart = np.linalg.norm(pose[:, None] - allowed[None], axis=2)
        frames.append(apart.argmin(axis=1))
        costs.append(apart.min(axis=1) + np.where(cut.closing, 0.0, penalty))
    return Entrances(np.array([*frame_poses]), np.array(frames).T, np.array(costs).T)


def solve(
    cut: Pieces,
    rows: Rows,
    rest: Floats,
    known: Entrances,
    distances: Floats,
    transitions: Floats,
    discount: float,
    cost: float = COST,
) -> Label:
    """Return the policy while a label is pending.

    Parameters
    ----------
    rows, distances, transitions, discount : see ``policy.solve``.
    rest : values of the policy without labels from each frame on, see ``lookahead.rest_values``.
    cost : C_sem.
    """
    entered = rest[_frame_index(cut, known)]
    offers = np.empty((len(cut.segment), len(transitions)))
    for n in np.unique(cut.length):
        power = np.linalg.matrix_power(transitions, int(n)).T
        at = cut.length == n
        offers[at] = (known.cost[at][:, :, None] + entered[at] @ power).min(axis=1)
    pending = policy.solve(
        cut, rows, distances, transitions, discount, offers=offers, surcharge=np.full(len(cut.segment), cost)
    )
    return Label(known, pending)


def _frame_index(cut: Pieces, known: Entrances) -> Integers:
    """Return the index of the entrances among the frames of all segments, (B, N)."""
    started = np.concatenate([[0], np.cumsum(np.bincount(cut.segment, cut.length)).astype(np.int64)[:-1]])
    return started[known.segment] + known.frame


class Step(NamedTuple):
    """What is shown at one time step.

    Attributes
    ----------
    segment, frame : the segment, and its frame.
    decided : whether there was a decision, which is the case at the end of each piece.
    cost : expected discounted cost from this step on, at the last decision.
    """

    segment: int
    frame: int
    decided: bool
    cost: float


class Repetition(NamedTuple):
    """What a segment costs in addition when it has been shown recently.

    Attributes
    ----------
    cost : right after it was entered. decay : factor of this cost per time step, below 1.
    """

    cost: float
    decay: float


class Player:
    """The online controller, one time step at a time.

    Parameters
    ----------
    found : the policy without labels.
    labels : by word.
    rest : see ``solve``; None if there are no labels.
    repetition : None: recently shown segments cost no more than others, as in the paper.
    """

    def __init__(
        self,
        found: Policy,
        labels: Mapping[str, Label],
        cut: Pieces,
        rows: Rows,
        rest: Floats | None = None,
        repetition: Repetition | None = None,
    ) -> None:
        self._cut, self._rows = cut, rows
        self._begin, self._end, self._segment = cut.begin.tolist(), cut.end.tolist(), cut.segment.tolist()
        self._repetition = repetition or Repetition(0.0, 0.0)
        self._repeated, self._since = np.zeros(len(cut.first) - 1), 0
        self._piece, self._frame, self._pending, self._cost = -1, -1, "", 0.0
        self.change(found, labels, rest)

    def change(self, found: Policy, labels: Mapping[str, Label], rest: Floats | None = None) -> None:
        """Continue with another policy of the same library; a pending word stays pending."""
        self._found, self._labels, self._rest = found, labels, rest
        self._index = {word: _frame_index(self._cut, label.entrances) for word, label in labels.items()}

    def hear(self, word: str) -> None:
        """Note that a word was heard. It replaces a pending one, and is ignored if it has no label."""
        if word in self._labels:
            self._pending = word

    def step(self, belief: Floats) -> Step:
        """Return what to show at the next time step, given the belief (I,) of the forward algorithm."""
        cut, piece = self._cut, self._piece
        self._since += 1
        if piece >= 0 and self._frame < self._end[piece]:
            self._frame += 1
            return Step(self._segment[piece], self._frame, False, self._cost)
        current = self._labels[self._pending].pending if self._pending else self._found
        if piece < 0:
            decision = policy.begin(current, belief)
        else:
            self._repeated *= self._repetition.decay**self._since
            self._since = 0
            row = self._rows(slice(piece, piece + 1))[0] + self._repeated
            decision = policy.decide(current, cut, row, piece, belief)
        following = piece + 1 if decision.segment == CONTINUE else int(cut.first[decision.segment])
        start, cost = self._begin[following], decision.cost
        if self._pending and piece >= 0 and self._rest is not None:
            known = self._labels[self._pending].entrances
            costs = known.cost[piece] + self._rest[self._index[self._pending][piece]] @ belief
            best = int(np.argmin(costs))
            if costs[best] < decision.cost:
                a, start, cost = int(known.segment[best]), int(known.frame[piece, best]), float(costs[best])
                self._pending = ""
                ends = cut.end[cut.first[a] : cut.first[a + 1]]
                following = int(cut.first[a] + np.searchsorted(ends, start))
        if following != piece + 1 or cut.closing[piece]:
            self._repeated[self._segment[following]] = self._repetition.cost
        self._piece, self._frame, self._cost = following, start, cost
        return Step(self._segment[following], start, True, cost)


def play(
    found: Policy,
    labels: Mapping[str, Label],
    cut: Pieces,
    rows: Rows,
    rest: Floats,
    beliefs: Floats,
    words: Sequence[str],
) -> Path:
    """Return the path of a ``Player``.

    Parameters
    ----------
    beliefs : (T, I) of the forward algorithm.
    words : T words, those that are heard at each time step; empty if none.
    others : see ``Player``.
    """
    player = Player(found, labels, cut, rows, rest)
    segment, frame = np.empty(len(beliefs), dtype=np.int64), np.empty(len(beliefs), dtype=np.int64)
    for t, (belief, word) in enumerate(zip(beliefs, words, strict=True)):
        player.hear(word)
        segment[t], frame[t] = player.step(belief)[:2]
    return Path(segment, frame)
