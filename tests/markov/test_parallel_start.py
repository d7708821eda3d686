"""Initial models: segments split into states, seeded clusters, and the floor of the variances."""

from __future__ import annotations

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.markov import parallel_start


def test_a_branch_is_what_its_segments_show():
    segments = [np.array([[0.0], [2.0], [10.0], [12.0]]), np.array([[1.0], [11.0]])]
    model = parallel_start.from_segments([segments, [np.arange(6.0)[:, None]]], 2, np.array([0.5]))
    np.testing.assert_allclose(model.entry, [2 / 3, 1 / 3])
    np.testing.assert_allclose(model.mean[:, :, 0], [[1.0, 11.0], [1.0, 4.0]])
    np.testing.assert_allclose(model.variance[:, :, 0], [[2 / 3, 2 / 3], [2 / 3, 2 / 3]])
    np.testing.assert_allclose(model.stay, [[1 - 2 / 4, 1 - 2 / 4], [1 - 1 / 4, 1 - 1 / 4]])


def test_clusters_follow_the_course_and_the_seed():
    rng = np.random.default_rng(0)
    rise, fall = np.linspace(0, 1, 30), np.linspace(1, 0, 30)
    pieces = [np.column_stack([rise if rng.random() < 0.5 else fall, rng.normal(size=30)]) for _ in range(20)]
    sequences = [np.concatenate(pieces) + rng.normal(0, 0.01, (600, 2))]
    floor = parallel_start.variance_floor(sequences, ("a", "b"), 0.01)
    one, two = (parallel_start.from_clusters(sequences, 4, 3, 15, floor, np.random.default_rng(1)) for _ in range(2))
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one, two, strict=True))
    slopes = one.mean[:, 2, 0] - one.mean[:, 0, 0]
    assert slopes.min() < -0.2
    assert slopes.max() > 0.2


def test_the_floor_is_a_share_of_the_variance_over_all_frames():
    # The variance of 0, 2, 4, 6 is 5 and that of 0, 0, 10, 10 is 25; each sequence by itself has less.
    sequences = [np.array([[0.0, 0.0], [2.0, 0.0]]), np.array([[4.0, 10.0], [6.0, 10.0]])]
    assert parallel_start.variance_floor(sequences, ("a", "b"), 0.1).tolist() == pytest.approx([0.5, 2.5])


def test_k_means_leaves_no_cluster_empty():
    rng = np.random.default_rng(0)
    same = np.zeros((7, 3))
    assert np.unique(parallel_start.k_means(same, 5, rng)).tolist() == [0, 1, 2, 3, 4]
    blobs = np.repeat(np.eye(4) * 10, 25, axis=0) + rng.normal(0, 0.1, (100, 4))
    labels = parallel_start.k_means(blobs, 4, rng).reshape(4, 25)
    assert (labels == labels[:, :1]).all()
    assert len(np.unique(labels[:, 0])) == 4


def test_refusals_name_what_is_wrong():
    frames = np.column_stack([np.arange(50.0), np.full(50, 3.0)])
    with pytest.raises(UserError, match="'b' never changes"):
        parallel_start.variance_floor([frames], ("a", "b"), 0.01)
    with pytest.raises(UserError, match="too few for 8 clusters"):
        parallel_start.from_clusters([frames], 8, 3, 15, np.ones(2), np.random.default_rng(0))
