"""The segments that a controller selects from: where they may end, and the cost of following one by another (7.1).

A segment of n time steps is shown from its first step on and may end at its last step or at one of three interruption
frames at uniform intervals. These ends cut it into *pieces*, which are numbered through the whole library, segment
by segment. "Frame" below is a frame of the controller, which makes one decision per time step of 1/15 to 1/10 s; the
motion itself has more frames.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Flags, Floats, Integers
from cospeech.errors import UserError
from cospeech.kernels.jit import njit

INTERRUPTIONS = 3

Rows = Callable[[slice], Floats]
"""Returns the successor costs S (block, A) of a block of pieces."""

TABLE_BYTES = 64_000_000
"""Successor costs of up to this size are kept as a table; those of larger libraries are computed when needed."""


class Pieces(NamedTuple):
    """The pieces of A segments, B in all.

    Attributes
    ----------
    first : (A + 1,) the first piece of each segment, and B.
    segment : (B,) the segment of each piece.
    begin, end : (B,) first and last frame of each piece, counted from the start of its segment.
    closing : (B,) whether the piece is the last of its segment.
    """

    first: Integers
    segment: Integers
    begin: Integers
    end: Integers
    closing: Flags

    @property
    def length(self) -> Integers:
        """Number of frames of each piece."""
        return self.end - self.begin + 1


class Successors(NamedTuple):
    """What the successor cost S(a, f, a') of Levine et al. 2010, 7.1, is computed from; distances are Euclidean.

    Attributes
    ----------
    pose : (B, P) weighted pose at the end of each piece.
    start_pose : (A, P) weighted pose at the start of each segment.
    signature : (A, Q) weighted description of each segment: its length, initial pose, and the logarithms of its
        velocity and displacement. The distance of two of them is D_seg.
    next_signature, previous_signature : (A, Q) the same for the segments that follow and precede each segment in the
        recording; NaN where there is none.
    penalty : added to each interruption.
    """

    pose: Floats
    start_pose: Floats
    signature: Floats
    next_signature: Floats
    previous_signature: Floats
    penalty: float


class Path(NamedTuple):
    """A path through the library: the segment and its frame at each of T time steps, (T,) each."""

    segment: Integers
    frame: Integers


def pieces(n_frames: Integers, interruptions: int = INTERRUPTIONS) -> Pieces:
    """Return the pieces of segments of ``n_frames`` (A,) frames, cut at ``interruptions`` uniform intervals.

    A segment with fewer frames than pieces has one piece per frame.

    Raises
    ------
    UserError : if there is no segment, or a segment without frames.
    """
    if len(n_frames) == 0:
        raise UserError("the motion library has no segment; at least one is needed")
    if np.min(n_frames) < 1:
        raise UserError(f"segment {int(np.argmin(n_frames))} of the motion library has no frame; leave it out")
    ends = [
        np.unique(np.round(np.arange(1, interruptions + 2) * (n / (interruptions + 1))).astype(np.int64)) - 1
        for n in n_frames
    ]
    ends = [end[end >= 0] for end in ends]
    counts = np.array([len(end) for end in ends])
    first = np.concatenate([[0], np.cumsum(counts)])
    end = np.concatenate(ends)
    begin = np.concatenate([np.append(0, one[:-1] + 1) for one in ends])
    closing = np.zeros(len(end), dtype=bool)
    closing[first[1:] - 1] = True
    return Pieces(first, np.repeat(np.arange(len(counts)), counts), begin, end, closing)


def with_neighbours(signature: Floats, record: Integers) -> tuple[Floats, Floats]:
    """Return the signatures of the segments that follow and precede each segment, NaN at the ends of recordings.

    Parameters
    ----------
    signature : (A, Q), in the order of the recordings.
    record : (A,) the recording that each segment comes from; consecutive segments of one recording are neighbours.
    """
    following, preceding = np.full_like(signature, np.nan), np.full_like(signature, np.nan)
    together = record[1:] == record[:-1]
    following[:-1][together] = signature[1:][together]
    preceding[1:][together] = signature[:-1][together]
    return following, preceding


@njit
def _add_distances(one: Floats, others: Floats, squares: Floats, sums: Floats) -> None:
    """Add the distances of a vector (P,) from the columns of ``others`` (P, A) to ``sums`` (A,)."""
    squares[:] = 0.0
    d = 0
    while d + 4 <= len(one):  # four at a time, so that the sums are read and written less often
        v0, v1, v2, v3 = one[d], one[d + 1], one[d + 2], one[d + 3]
        r0, r1, r2, r3 = others[d], others[d + 1], others[d + 2], others[d + 3]
        for a in range(len(squares)):
            x0, x1, x2, x3 = v0 - r0[a], v1 - r1[a], v2 - r2[a], v3 - r3[a]
            squares[a] += (x0 * x0 + x1 * x1) + (x2 * x2 + x3 * x3)
        d += 4
    while d < len(one):
        value, row = one[d], others[d]
        for a in range(len(squares)):
            squares[a] += (value - row[a]) ** 2
        d += 1
    for a in range(len(squares)):
        sums[a] += np.sqrt(squares[a])


@njit(nogil=True)
def _costs(
    segment: Integers,
    closing: Flags,
    pose: Floats,
    signature: Floats,
    following: Floats,
    start_poses: Floats,
    signatures: Floats,
    preceding: Floats,
    penalty: float,
    costs: Floats,
) -> None:
    """Fill ``costs`` (B, A); see ``successor_costs``. The last three arrays of vectors are transposed, (., A)."""
    n_segments = start_poses.shape[1]
    squares, jump = np.empty(n_segments), np.empty(n_segments)
    for b in range(len(segment)):
        a, row = segment[b], costs[b]
        row[:] = 0.0
        jump[:] = 0.0
        _add_distances(pose[b], start_poses, squares, jump)
        if not closing[b]:
            for other in range(n_segments):
                row[other] = jump[other] + penalty
            row[a] = np.inf
            continue
        _add_distances(signature[a], preceding, squares, row)
        for other in range(n_segments):
            if np.isnan(row[other]):
                row[other] = jump[other]
        if np.isnan(following[a, 0]):
            for other in range(n_segments):
                row[other] += jump[other]
        else:
            _add_distances(following[a], signatures, squares, row)


def successor_costs(cut: Pieces, known: Successors, chosen: Integers | None = None) -> Floats:
    """Return S(a, f_k, a') from the end of each piece to the start of each segment, (B, A) (Levine et al. 2010, 7.1).

    After the last piece of a segment, S is D_s-p, the distance of a' from the true successor of a plus that of a from
    the true predecessor of a'. Where a recording ends or begins, and one of these is missing, the distance between
    the last pose of a and the first pose of a' takes its place. After any other piece, S is D_int, the distance
    between the two poses, plus the penalty. A segment is not interrupted by itself: this cost is infinite, as
    in appendix A, where a' = a at an interruption frame means to continue.

    Parameters
    ----------
    chosen : the pieces to compute the costs for; all if None.
    """
    one = np.arange(len(cut.segment)) if chosen is None else chosen
    costs = np.empty((len(one), len(known.start_pose)))
    start_poses, signatures, preceding = (
        np.ascontiguousarray(vectors.T) for vectors in (known.start_pose, known.signature, known.previous_signature)
    )
    _costs(
        cut.segment[one], cut.closing[one], np.ascontiguousarray(known.pose[one]), known.signature,
        known.next_signature, start_poses, signatures, preceding, known.penalty, costs,
    )  # fmt: skip
    return costs


def cost_rows(cut: Pieces, known: Successors) -> Rows:
    """Return the successor costs of a library by blocks of pieces, from a table if that is not too large."""
    n_pieces = len(cut.segment)
    if 8 * n_pieces * len(known.start_pose) <= TABLE_BYTES:
        return successor_costs(cut, known).__getitem__

    def rows(block: slice) -> Floats:
        return successor_costs(cut, known, np.arange(n_pieces)[block])

    return rows


def path_cost(path: Path, cut: Pieces, rows: Rows, distances: Floats, beliefs: Floats) -> float:
    """Return the sum of expected distances and successor costs along a path, the objective of 7.1.

    Parameters
    ----------
    distances : (A, I) delta.
    beliefs : (T, I).
    """
    total = float(np.einsum("ti,ti->", beliefs, distances[path.segment]))
    starts = np.flatnonzero(path.frame == 0)
    for t in starts[starts > 0]:
        last, frame = path.segment[t - 1], path.frame[t - 1]
        inside = slice(cut.first[last], cut.first[last + 1])
        piece = int(cut.first[last] + np.searchsorted(cut.end[inside], frame))
        total += float(rows(slice(piece, piece + 1))[0, path.segment[t]])
    return total
