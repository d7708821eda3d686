"""The offline controller against all paths, and against the paper's frame-by-frame table."""

import numpy as np
import pytest
from controller.tiny import all_path_costs, frame_viterbi, random_tiny

from cospeech.synthesis.controller import library, offline


def test_equals_the_best_of_all_paths():
    rng = np.random.default_rng(1)
    for _ in range(60):
        tiny = random_tiny(rng, int(rng.integers(1, 4)), 2, longest=3)
        beliefs = rng.dirichlet(np.ones(2), int(rng.integers(1, 7)))
        found = offline.animate(tiny.cut, tiny.rows, tiny.distances, beliefs)
        assert found.cost == pytest.approx(min(all_path_costs(tiny, beliefs)), rel=1e-13)


def test_equals_the_frame_by_frame_table_and_its_path_costs_what_it_says():
    rng = np.random.default_rng(2)
    for trial in range(150):
        states = int(rng.integers(1, 4))
        tiny = random_tiny(rng, 1 + trial % 8, states, longest=12)
        beliefs = rng.dirichlet(np.ones(states), int(rng.integers(1, 60)))
        found = offline.animate(tiny.cut, tiny.rows, tiny.distances, beliefs)
        assert found.cost == pytest.approx(frame_viterbi(tiny, beliefs), rel=1e-13)
        assert library.path_cost(found.path, tiny.cut, tiny.rows, tiny.distances, beliefs) == pytest.approx(
            found.cost, rel=1e-12
        )
