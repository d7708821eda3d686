"""Forward probabilities against the enumeration of all paths, and the expectation of the elapsed share."""

import numpy as np
import pytest
from small_chain import continuation, enumerated, random_chain

from cospeech.synthesis.bodylanguage import forward, observations


def run(model, mode, seen, passed_s, ended=None):
    """The belief after each observation; ``ended`` concerns the last one."""
    n = len(model.initial)
    beliefs = [forward.first(model.initial, mode)]
    for t, (observation, passed) in enumerate(zip(seen, passed_s, strict=True)):
        new = forward.empty(n, mode)
        over = ended if ended is not None and t == len(seen) - 1 else np.zeros(n, dtype=bool)
        forward.update(
            model.continuing, forward.successors(model.after_start, model.after), model.emissions[observation],
            model.logit, model.length_s, passed, over, mode, beliefs[-1], new,
        )  # fmt: skip
        beliefs.append(new)
    return beliefs


def case(rng, n_clusters, n_steps):
    seen = rng.choice(observations.OCCURRING, n_steps)
    return random_chain(rng, n_clusters), seen, rng.uniform(0.05, 0.5, n_steps)


def test_exact_probabilities_and_elapsed_shares_equal_the_enumeration_of_paths():
    rng = np.random.default_rng(0)
    for trial in range(40):
        n_clusters = 1 + trial % 3
        model, seen, passed_s = case(rng, n_clusters, 5 - n_clusters)
        ended = rng.random(len(model.initial)) < 0.5 if trial % 2 else None
        alpha, share = enumerated(model, seen, passed_s, ended)
        belief = run(model, forward.EXACT, seen, passed_s, ended)[-1]
        np.testing.assert_allclose(forward.probabilities(belief), alpha, atol=1e-11)
        known = alpha[1] > 1e-6
        np.testing.assert_allclose(forward.expected_share(belief)[known], share[known], atol=1e-6)


def written_out(model, seen, passed_s, printed):
    """Equations 5.1 and 5.3, term by term: alpha (2, N) and tau (N,) after each observation."""
    n = len(model.initial)
    alpha, tau, found = np.stack([model.initial, np.zeros(n)]), np.zeros(n), []
    for observation, passed in zip(seen, passed_s, strict=True):
        emission = model.emissions[observation]
        step = passed / model.length_s
        reached = tau + step
        onward = np.array([continuation(model, i, reached[i]) for i in range(n)])
        from_start, from_continuation = alpha[0] * model.continuing, alpha[1] * onward
        starts = alpha[0] @ model.after_start + (alpha[1] * (1.0 - onward)) @ model.after
        new = np.stack([emission[0] * starts, emission[1] * (from_start + from_continuation)])
        new /= new.sum()
        denominator = new[1] if printed else from_start + from_continuation
        tau = (from_continuation * reached + from_start * step) / denominator
        alpha = new
        found.append((alpha, tau))
    return found


@pytest.mark.parametrize("mode", [forward.EXPECTED, forward.PRINTED])
def test_expectations_equal_equation_5_3_written_out(mode):
    rng = np.random.default_rng(1)
    for trial in range(40):
        model, seen, passed_s = case(rng, 1 + trial % 5, 12)
        expected = written_out(model, seen, passed_s, mode == forward.PRINTED)
        for belief, (alpha, tau) in zip(run(model, mode, seen, passed_s)[1:], expected, strict=True):
            np.testing.assert_allclose(forward.probabilities(belief), alpha, rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(belief.elapsed[:, 0], tau, rtol=1e-9)


def test_all_modes_agree_until_a_subunit_may_have_been_entered_at_two_times():
    """At the second observation, all continuations were entered at the start or at the first one."""
    rng = np.random.default_rng(2)
    for trial in range(20):
        model, seen, passed_s = case(rng, 1 + trial % 4, 2)
        exact, expected = (
            [forward.probabilities(belief) for belief in run(model, mode, seen, passed_s)]
            for mode in (forward.EXACT, forward.EXPECTED)
        )
        np.testing.assert_allclose(exact[1], expected[1], atol=1e-12)
        np.testing.assert_allclose(exact[2], expected[2], atol=1e-12)


def test_printed_expectation_is_wrong_and_the_derived_one_close():
    rng = np.random.default_rng(3)
    off = {forward.EXPECTED: [], forward.PRINTED: []}
    for _ in range(30):
        model, seen, passed_s = case(rng, 6, 40)
        exact = run(model, forward.EXACT, seen, passed_s)
        for mode, differences in off.items():
            for right, wrong in zip(exact, run(model, mode, seen, passed_s), strict=True):
                differences.append(0.5 * np.abs(forward.probabilities(right) - forward.probabilities(wrong)).sum())
    assert np.mean(off[forward.EXPECTED]) < 0.02
    assert np.mean(off[forward.PRINTED]) > 3 * np.mean(off[forward.EXPECTED])


def test_more_entries_than_are_kept_are_combined_with_the_oldest(monkeypatch):
    """Where the elapsed share does not matter, this changes nothing."""
    rng = np.random.default_rng(4)
    model = random_chain(rng, 3)
    model.logit[:] = [2.5, 0.0]
    seen = rng.choice(observations.OCCURRING, 3 * forward.N_ENTRIES)
    model.emissions[:] = model.emissions + 0.3
    passed_s = rng.uniform(0.1, 0.3, len(seen))
    some = run(model, forward.EXACT, seen, passed_s)
    assert max(belief.n_entries.max() for belief in some) == forward.N_ENTRIES
    monkeypatch.setattr(forward, "N_ENTRIES", len(seen))
    for kept, all_kept in zip(some, run(model, forward.EXACT, seen, passed_s), strict=True):
        np.testing.assert_allclose(forward.probabilities(kept), forward.probabilities(all_kept), atol=1e-9)
        np.testing.assert_allclose(forward.expected_share(kept), forward.expected_share(all_kept), atol=1e-6)


def test_sparse_successors_are_those_of_the_matrices():
    rng = np.random.default_rng(7)
    for n in (1, 3, 8):
        tables = np.where(rng.random((2, n, n)) < 0.4, rng.random((2, n, n)), 0.0) + 1e-3
        found = forward.successors(*tables)
        for i in range(n):
            row = np.tile(found.base[i], (n, 1))
            row[found.cluster[i, : found.n_more[i]]] += found.more[i, : found.n_more[i]]
            np.testing.assert_allclose(row.T, tables[:, i])


def test_direct_probabilities_equal_equation_4_1():
    rng = np.random.default_rng(5)
    for trial in range(60):
        n = 1 + trial % 4
        model, seen, _ = case(rng, n, 1)
        emission = model.emissions[seen[0]]
        shown, started, ended = int(rng.integers(n)), trial % 2 == 0, trial % 3 == 0
        share = rng.uniform(0.0, 1.2)
        gamma = np.empty(n + 1)
        forward.direct(
            model.continuing, model.after_start, model.after, emission, model.logit, shown, started, share, ended,
            gamma,
        )  # fmt: skip
        if ended:
            stay, others = 0.0, model.after[shown]
        elif started:
            stay, others = model.continuing[shown], model.after_start[shown]
        else:
            stay = continuation(model, shown, share)
            others = (1.0 - stay) * model.after[shown]
        np.testing.assert_allclose(gamma, [*(others * emission[0]), stay * emission[1, shown]])


def test_product_of_forward_and_direct_probabilities_is_normalised():
    rng = np.random.default_rng(6)
    for trial in range(40):
        n = 1 + trial % 4
        model, seen, passed_s = case(rng, n, 3)
        belief = run(model, forward.EXACT, seen, passed_s)[-1]
        shown = int(rng.integers(n))
        gamma = rng.random(n + 1)
        product = gamma * np.append(belief.start, forward.probabilities(belief)[1, shown])
        combined = gamma.copy()
        forward.combine(belief, shown, combined)
        np.testing.assert_allclose(combined, product / product.sum())
    alone = np.append(np.zeros(n), 2.0)
    nothing = forward.empty(n, forward.EXACT)
    forward.combine(nothing, shown, alone)
    np.testing.assert_array_equal(alone, [*np.zeros(n), 1.0])


def test_draws_have_the_distribution_they_are_drawn_from():
    distribution = np.array([0.0, 0.3, 0.0, 0.3, 0.4, 0.0])
    uniforms = (np.arange(10_000) + 0.5) / 10_000
    counts = np.bincount([forward.draw(distribution, uniform) for uniform in uniforms], minlength=6)
    np.testing.assert_allclose(counts / len(uniforms), distribution, atol=1e-4)
    assert forward.draw(distribution, 1.0) == 4
