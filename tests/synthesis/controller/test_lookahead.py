"""The delayed controller against the online one, against all continuations, and its regret."""

import numpy as np
import pytest
from controller.tiny import random_tiny

from cospeech.markov import crf
from cospeech.markov.crf import CRF
from cospeech.synthesis.controller import library, lookahead, offline, policy

DISCOUNT = 0.9


def case(rng, segments, states, longest=9):
    tiny = random_tiny(rng, segments, states, longest)
    found = policy.solve(tiny.cut, tiny.rows, tiny.distances, tiny.transitions, DISCOUNT)
    rest = lookahead.rest_values(found, tiny.cut, tiny.rows, tiny.distances, tiny.transitions, DISCOUNT)
    return tiny, found, rest


def test_rest_of_a_whole_piece_is_its_value():
    rng = np.random.default_rng(1)
    for trial in range(20):
        tiny, found, rest = case(rng, 1 + trial % 6, 3)
        begun = np.concatenate([[0], np.cumsum(tiny.cut.length)[:-1]])
        np.testing.assert_allclose(rest[begun], found.values, rtol=1e-10)
        last = begun + tiny.cut.length - 1  # one frame, and the decision after it
        after = (tiny.costs[:, :, None] + found.entering @ tiny.transitions.T).min(axis=1)
        for b in np.flatnonzero(~tiny.cut.closing):
            after[b] = np.minimum(after[b], tiny.transitions @ found.values[b + 1])
        np.testing.assert_allclose(rest[last], tiny.distances[tiny.cut.segment] + DISCOUNT * after, rtol=1e-10)


def test_without_delay_it_is_the_online_controller():
    rng = np.random.default_rng(2)
    for trial in range(20):
        tiny, found, rest = case(rng, 1 + trial % 8, 3)
        beliefs = rng.dirichlet(np.ones(3), 40)
        delayed = lookahead.play(tiny.cut, tiny.rows, rest, tiny.distances, beliefs[:, None], DISCOUNT)
        online = policy.play(found, tiny.cut, tiny.rows, beliefs)
        np.testing.assert_array_equal(delayed.segment, online.segment)
        np.testing.assert_array_equal(delayed.frame, online.frame)


def best_continuation(tiny, rest, beliefs, piece):
    """The lowest cost from a decision on, by following every continuation frame by frame."""
    cut = tiny.cut
    begun = np.concatenate([[0], np.cumsum(cut.length)[:-1]])

    def show(b, frame, step):
        if step == len(beliefs) - 1:
            return rest[begun[b] + frame] @ beliefs[step]
        cost = tiny.distances[cut.segment[b]] @ beliefs[step]
        if frame + 1 < cut.length[b]:
            return cost + DISCOUNT * show(b, frame + 1, step + 1)
        return cost + DISCOUNT * min(choices(b, step + 1).values())

    def choices(b, step):
        found = {
            int(cut.first[a]): tiny.costs[b, a] + show(cut.first[a], 0, step) for a in range(len(tiny.distances))
        }
        if not cut.closing[b]:
            found[int(b + 1)] = show(b + 1, 0, step)
        return found

    return choices(piece, 0)


def test_values_equal_those_of_all_continuations():
    rng = np.random.default_rng(3)
    for trial in range(25):
        tiny, _, rest = case(rng, 1 + trial % 3, 2, longest=6)
        beliefs = rng.dirichlet(np.ones(2), 1 + trial % 6)
        shown, cut = np.empty(len(tiny.cut.segment)), tiny.cut
        begun = np.concatenate([[0], np.cumsum(cut.length)[:-1]])
        lookahead._piece_values(
            cut.first, cut.segment, cut.length, begun, cut.closing, tiny.costs, rest, tiny.distances, beliefs,
            DISCOUNT, shown,
        )  # fmt: skip
        for piece in range(len(cut.segment)):
            for b, cost in best_continuation(tiny, rest, beliefs, piece).items():
                jump = 0.0 if b == piece + 1 and not cut.closing[piece] else tiny.costs[piece, cut.segment[b]]
                assert shown[b] + jump == pytest.approx(cost, rel=1e-12)


def test_values_of_a_belief_do_not_exceed_those_of_plans_without_observations():
    """The values of a state assume that the state is known at each decision, and so are a lower bound (7.2)."""
    rng = np.random.default_rng(5)
    for trial in range(20):
        tiny, found, rest = case(rng, 2 + trial % 5, 3)
        cut, belief = tiny.cut, rng.dirichlet(np.ones(3))
        begun = np.concatenate([[0], np.cumsum(cut.length)[:-1]])
        known = [belief]
        for _ in range(60):  # planned from what the first belief predicts; what follows counts 0.9^60
            known.append(known[-1] @ tiny.transitions)
        shown = np.empty(len(cut.segment))
        lookahead._piece_values(
            cut.first, cut.segment, cut.length, begun, cut.closing, tiny.costs, rest, tiny.distances,
            np.array(known), DISCOUNT, shown,
        )  # fmt: skip
        assert (found.values @ belief <= shown + DISCOUNT**60 * rest.max()).all()


def test_regret_falls_with_the_delay():
    rng = np.random.default_rng(4)
    regrets = []
    for _ in range(12):
        tiny, _, rest = case(rng, 12, 4)
        model = CRF(np.log(tiny.transitions), rng.normal(0, 2.0, (3, 4)))
        features = np.repeat(rng.normal(size=(30, 3)), 5, axis=0)

        def lagged(delay, model=model, features=features):
            return crf.lagged(model, features, delay)

        gamma = crf.smoothed(model, features).beliefs
        curve = lookahead.regret_curve(
            tiny.cut, tiny.rows, rest, tiny.distances, lagged, gamma, DISCOUNT, 1 / 15, (0, 3, 6, 20)
        )
        optimum = offline.animate(tiny.cut, tiny.rows, tiny.distances, gamma)
        spent = library.path_cost(optimum.path, tiny.cut, tiny.rows, tiny.distances, gamma)
        assert curve[0].optimum * len(gamma) == pytest.approx(spent, rel=1e-12)
        assert [round(point.delay_ms) for point in curve] == [0, 200, 400, 1333]
        regrets.append([point.regret for point in curve])
    assert np.min(regrets) > -1e-12
    mean = np.mean(regrets, axis=0)
    assert mean[0] > mean[1] > mean[2] > mean[3]
    assert mean[3] < 0.03
