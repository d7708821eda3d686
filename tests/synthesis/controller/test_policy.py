"""The policy against value iteration on the paper's full table, and against the recursion over single frames."""

import numpy as np
import pytest
from controller.tiny import frame_values, full_table, random_tiny

from cospeech.errors import UserError
from cospeech.synthesis.controller import library, offline, policy


@pytest.mark.parametrize("discounts", ["corrected", "printed"])
def test_factored_values_equal_the_full_table_of_appendix_a(discounts):
    rng = np.random.default_rng(1)
    for trial in range(12):
        states = 1 + trial % 3
        tiny = random_tiny(rng, 1 + trial % 4, states, longest=9, shortest=8 if discounts == "printed" else 1)
        found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.6, discounts)
        table = full_table(tiny, 0.6, discounts, 60)
        for b, (a, closing) in enumerate(zip(tiny.cut.segment, tiny.cut.closing, strict=True)):
            factored = tiny.costs[b][:, None] + found.entering
            if not closing:
                factored[a] = found.values[b + 1]
            np.testing.assert_allclose(factored, table[:, b], rtol=1e-10)


def test_equals_the_recursion_over_single_frames_if_the_state_does_not_change():
    rng = np.random.default_rng(2)
    for trial in range(60):
        states = 1 + trial % 4
        tiny = random_tiny(rng, 1 + trial % 7, states, longest=10)._replace(transitions=np.eye(states))
        found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.9)
        known, values = frame_values(tiny, 0.9, 300)
        first = [index for index, (_, f) in enumerate(known) if f == 0]
        np.testing.assert_allclose(found.entering, values[first], rtol=2e-10)


def test_printed_discounts_do_not_equal_it():
    rng = np.random.default_rng(3)
    off = []
    for _ in range(30):
        tiny = random_tiny(rng, 5, 2, longest=14, shortest=10)._replace(transitions=np.eye(2))
        corrected, printed = (
            policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.95, discounts)
            for discounts in ("corrected", "printed")
        )
        off.append(np.abs(printed.entering / corrected.entering - 1.0).mean())
    assert min(off) > 0.01


def test_values_of_7_2_do_not_exceed_those_of_appendix_a():
    """Over single frames, each decision knows the state of the frame before it; over pieces, of an earlier frame."""
    rng = np.random.default_rng(4)
    for trial in range(40):
        tiny = random_tiny(rng, 2 + trial % 5, 3, longest=8)
        found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.9)
        known, values = frame_values(tiny, 0.9, 300)
        first = [index for index, (_, f) in enumerate(known) if f == 0]
        assert (values[first] <= found.entering * (1 + 1e-9)).all()


def test_printed_discounts_refuse_a_piece_of_one_frame():
    tiny = random_tiny(np.random.default_rng(5), 3, 2, longest=4)
    with pytest.raises(UserError, match="discounts: corrected"):
        policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.9, "printed")


def library_of(rng, segments, dimensions=5):
    cut = library.pieces(rng.integers(1, 15, segments))
    signature = rng.normal(size=(segments, dimensions))
    following, preceding = library.with_neighbours(signature, np.sort(rng.integers(0, 3, segments)))
    pose, start = rng.normal(size=(len(cut.segment), 9)), rng.normal(size=(segments, 9))
    return cut, library.Successors(pose, start, signature, following, preceding, 0.7)


def test_blocks_of_costs_give_the_same_policy_as_their_table(monkeypatch):
    rng = np.random.default_rng(6)
    cut, known = library_of(rng, 40)
    distances, transitions = rng.uniform(0, 4, (40, 5)), rng.dirichlet(np.ones(5), 5)
    table = policy.solve(cut, library.cost_rows(cut, known), distances, transitions, 0.97)
    monkeypatch.setattr(library, "TABLE_BYTES", 0)
    monkeypatch.setattr(policy, "BLOCK_BYTES", 8 * 40 * 7)
    blocks = policy.solve(cut, library.cost_rows(cut, known), distances, transitions, 0.97)
    np.testing.assert_array_equal(blocks.values, table.values)


def test_share_of_undominated_entries_equals_counting_them():
    rng = np.random.default_rng(7)
    for _ in range(20):
        tiny = random_tiny(rng, 6, 2)
        found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.9)
        kept = total = 0
        for b, (a, closing) in enumerate(zip(tiny.cut.segment, tiny.cut.closing, strict=True)):
            options = tiny.costs[b][:, None] + found.entering
            if not closing:
                options[a] = found.values[b + 1]
            kept += sum(not (options < option).all(axis=1).any() for option in options)
            total += len(options)
        assert policy.undominated_share(found, tiny.cut, tiny.rows) == kept / total


def test_decides_as_the_full_table_says():
    rng = np.random.default_rng(8)
    for trial in range(10):
        tiny = random_tiny(rng, 3, 3)
        found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.6)
        table = full_table(tiny, 0.6, "corrected", 60)
        for b, (a, closing) in enumerate(zip(tiny.cut.segment, tiny.cut.closing, strict=True)):
            belief = rng.dirichlet(np.ones(3))
            decision = policy.decide(found, tiny.cut, tiny.costs[b], b, belief)
            expected = table[:, b] @ belief
            segment = a if decision.segment == policy.CONTINUE else decision.segment
            assert (decision.segment == policy.CONTINUE) == (segment == a and not closing), trial
            assert expected[segment] == pytest.approx(expected.min(), rel=1e-8)
            assert decision.cost == pytest.approx(expected.min(), rel=1e-8)


def test_played_paths_are_allowed_and_no_cheaper_than_the_optimum():
    rng = np.random.default_rng(9)
    for _ in range(40):
        tiny = random_tiny(rng, int(rng.integers(1, 9)), 3, longest=12)
        beliefs = rng.dirichlet(np.ones(3), 50)
        found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, 0.9)
        path = policy.play(found, tiny.cut, tiny.rows, beliefs)
        played = library.path_cost(path, tiny.cut, tiny.rows, tiny.distances, beliefs)
        best = offline.animate(tiny.cut, tiny.rows, tiny.distances, beliefs).cost
        assert np.isfinite(played)
        assert played >= best - 1e-9
        for t in np.flatnonzero(path.frame[1:] == 0):
            last = slice(tiny.cut.first[path.segment[t]], tiny.cut.first[path.segment[t] + 1])
            assert path.frame[t] in tiny.cut.end[last]
