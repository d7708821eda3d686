"""Semantic labels against value iteration on a table that has the label as a dimension."""

import numpy as np
import pytest
from controller.tiny import random_tiny

from cospeech.errors import UserError
from cospeech.synthesis.controller import lookahead, policy, semantics

DISCOUNT, SEMANTIC_COST, PENALTY = 0.7, 5.0, 0.4


def case(rng, segments, matching, states=2):
    tiny = random_tiny(rng, segments, states, longest=9)
    lengths = np.bincount(tiny.cut.segment, tiny.cut.length).astype(int)
    pose = rng.normal(size=(len(tiny.cut.segment), 3))
    poses = {a: rng.normal(size=(lengths[a], 3)) for a in matching}
    known = semantics.entrances(tiny.cut, pose, PENALTY, poses)
    found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, DISCOUNT)
    rest = lookahead.rest_values(found, tiny.cut, tiny.rows, tiny.distances, tiny.transitions, DISCOUNT)
    label = semantics.solve(
        tiny.cut, tiny.rows, rest, known, tiny.distances, tiny.transitions, DISCOUNT, SEMANTIC_COST
    )
    return tiny, pose, poses, found, rest, label


def table_with_labels(tiny, known, sweeps):
    """Values (label, segment, frame, I) of showing the rest of a piece, its label pending (1) or not (0)."""
    cut, transitions = tiny.cut, tiny.transitions
    lengths = np.bincount(cut.segment, cut.length).astype(int)
    powers = [np.linalg.matrix_power(transitions, n) for n in range(lengths.max() + 2)]
    table = {(w, a, f): np.zeros(len(transitions)) for w in (0, 1) for a, n in enumerate(lengths) for f in range(n)}
    for _ in range(sweeps):
        new = {}
        for w, a, f in table:
            b = cut.first[a] + np.searchsorted(cut.end[cut.first[a] : cut.first[a + 1]], f)
            n = int(cut.end[b]) - f + 1
            shown = sum(DISCOUNT**g * powers[g] @ tiny.distances[a] for g in range(n)) + w * SEMANTIC_COST
            options = [tiny.costs[b, other] + powers[n] @ table[w, other, 0] for other in range(len(lengths))]
            if not cut.closing[b]:
                options.append(powers[n] @ table[w, a, int(cut.end[b]) + 1])
            if w:
                matching = zip(known.segment, known.frame[b], known.cost[b], strict=True)
                options += [cost + powers[n] @ table[0, int(other), int(g)] for other, g, cost in matching]
            new[w, a, f] = shown + DISCOUNT**n * np.min(options, axis=0)
        table = new
    return table


def test_pending_values_equal_the_table_with_labels():
    rng = np.random.default_rng(1)
    for trial in range(8):
        segments = 2 + trial % 3
        tiny, _, _, found, rest, label = case(rng, segments, list(range(1 + trial % 2)))
        table = table_with_labels(tiny, label.entrances, 90)
        for b, (a, begin) in enumerate(zip(tiny.cut.segment, tiny.cut.begin, strict=True)):
            np.testing.assert_allclose(found.values[b], table[0, a, begin], rtol=1e-9)
            np.testing.assert_allclose(label.pending.values[b], table[1, a, begin], rtol=1e-9)
        frames = [value for (w, _, _), value in table.items() if w == 0]
        np.testing.assert_allclose(rest, frames, rtol=1e-9)


def test_entrances_are_the_nearest_poses_of_the_first_part():
    rng = np.random.default_rng(2)
    for _ in range(20):
        tiny, pose, poses, _, _, label = case(rng, 5, [1, 4])
        for b in range(len(pose)):
            for n, (a, frames) in enumerate(poses.items()):
                allowed = max(1, len(frames) // 2)
                apart = [np.linalg.norm(pose[b] - frame) for frame in frames[:allowed]]
                assert label.entrances.segment[n] == a
                assert label.entrances.frame[b, n] == int(np.argmin(apart))
                interrupted = 0.0 if tiny.cut.closing[b] else PENALTY
                assert label.entrances.cost[b, n] == pytest.approx(min(apart) + interrupted)


def test_a_heard_word_is_followed_by_a_matching_gesture_once():
    rng = np.random.default_rng(3)
    entered_late = 0
    for _ in range(20):
        tiny, _, _, found, rest, label = case(rng, 8, [2, 5], states=3)
        beliefs = rng.dirichlet(np.ones(3), 80)
        words = [""] * 80
        words[30], words[50] = "big", "unknown"
        path = semantics.play(found, {"big": label}, tiny.cut, tiny.rows, rest, beliefs, words)
        plain = policy.play(found, tiny.cut, tiny.rows, beliefs)
        np.testing.assert_array_equal(path.segment[:30], plain.segment[:30])
        exits = {(int(a), int(f)) for a, f in zip(tiny.cut.segment, tiny.cut.end, strict=True)}
        jumps = np.flatnonzero((np.diff(path.segment) != 0) | (np.diff(path.frame) != 1)) + 1
        assert all((int(path.segment[t - 1]), int(path.frame[t - 1])) in exits for t in jumps)
        after = [t for t in jumps if t >= 30]
        assert path.segment[after[0]] in (2, 5)  # at the first opportunity, as C_sem is large
        assert after[0] - 30 <= 9
        late = [t for t in jumps if path.frame[t] > 0]
        assert set(late) <= {after[0]}  # only once, and only a matching segment
        entered_late += len(late)
    assert entered_late > 0


def test_keywords_without_a_segment_of_the_library_are_refused():
    tiny = random_tiny(np.random.default_rng(4), 3, 2)
    pose = np.zeros((len(tiny.cut.segment), 3))
    with pytest.raises(UserError, match="has no segment"):
        semantics.entrances(tiny.cut, pose, PENALTY, {})
    with pytest.raises(UserError, match=r"segment 7 .* 3 segments"):
        semantics.entrances(tiny.cut, pose, PENALTY, {7: np.zeros((4, 3))})
