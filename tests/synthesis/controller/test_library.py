"""Pieces and successor costs of a motion library against their definitions."""

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.synthesis.controller import library


def test_pieces_cover_each_segment_and_are_of_about_the_same_length():
    cut = library.pieces(np.arange(1, 60))
    for a, n in enumerate(range(1, 60)):
        inside = slice(cut.first[a], cut.first[a + 1])
        shown = [
            f for begin, end in zip(cut.begin[inside], cut.end[inside], strict=True) for f in range(begin, end + 1)
        ]
        assert shown == list(range(n))
        assert len(cut.end[inside]) == min(n, 4)
        assert np.ptp(cut.length[inside]) <= 1
        assert cut.closing[inside].tolist() == [False] * (min(n, 4) - 1) + [True]


def test_a_library_without_segments_or_frames_is_refused():
    with pytest.raises(UserError, match="no segment"):
        library.pieces(np.array([], dtype=int))
    with pytest.raises(UserError, match=r"segment 1 .* no frame"):
        library.pieces(np.array([3, 0]))


def test_successor_costs_equal_their_definition():
    rng = np.random.default_rng(1)
    for trial in range(30):
        segments, poses, signs = int(rng.integers(1, 9)), int(rng.integers(1, 10)), int(rng.integers(1, 10))
        cut = library.pieces(rng.integers(1, 9, segments))
        record = np.sort(rng.integers(0, 3, segments))
        signature = rng.normal(size=(segments, signs))
        known = library.Successors(
            rng.normal(size=(len(cut.segment), poses)), rng.normal(size=(segments, poses)), signature,
            *library.with_neighbours(signature, record), 0.5,
        )  # fmt: skip
        found = library.successor_costs(cut, known)
        for b, (a, closing) in enumerate(zip(cut.segment, cut.closing, strict=True)):
            for other in range(segments):
                jump = np.linalg.norm(known.pose[b] - known.start_pose[other])
                followed = a + 1 < segments and record[a + 1] == record[a]
                preceded = other > 0 and record[other - 1] == record[other]
                true = np.inf if a == other else jump + 0.5
                if closing:
                    true = np.linalg.norm(signature[a + 1] - signature[other]) if followed else jump
                    true += np.linalg.norm(signature[a] - signature[other - 1]) if preceded else jump
                assert found[b, other] == pytest.approx(true, rel=1e-12, abs=1e-12), trial
            if closing and a + 1 < segments and record[a + 1] == record[a]:
                assert found[b, a + 1] == 0.0
