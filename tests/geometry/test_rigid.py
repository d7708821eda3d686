"""Rigid alignment against scipy, similarities against planted ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cospeech.geometry.rigid import align, fit_similarity


def test_alignment_is_that_of_scipy_and_left_out_where_fewer_than_three_markers_are_seen():
    draw = np.random.default_rng(0)
    template = draw.normal(0, 0.1, (4, 3))
    turns, shifts = Rotation.random(20, rng=draw).as_matrix(), draw.normal(0, 1, (20, 3))
    places = np.einsum("tij,mj->tmi", turns, template) + shifts[:, None] + draw.normal(0, 0.002, (20, 4, 3))
    places[3, 1], places[4, :2] = np.nan, np.nan
    rotations, found = align(template, places)
    assert np.isnan(rotations[4]).all()
    assert np.isnan(found[4]).all()
    for t in set(range(20)) - {4}:
        seen = ~np.isnan(places[t, :, 0])
        middle, middles = places[t, seen].mean(axis=0), template[seen].mean(axis=0)
        best, _ = Rotation.align_vectors(places[t, seen] - middle, template[seen] - middles)
        np.testing.assert_allclose(rotations[t], best.as_matrix(), atol=1e-9)
        np.testing.assert_allclose(found[t], middle - best.apply(middles), atol=1e-9)


@pytest.mark.parametrize("flat", [False, True])
def test_a_planted_similarity_is_found_also_from_points_in_a_plane(flat):
    draw = np.random.default_rng(1)
    points = draw.normal(0, 1, (6, 3)) * [1, 1, not flat]
    turn, shift = Rotation.random(rng=draw).as_matrix(), draw.normal(0, 1, 3)
    found = fit_similarity(points, 2.5 * points @ turn.T + shift)
    assert found.scale == pytest.approx(2.5, abs=1e-12)
    np.testing.assert_allclose(found.rotation, turn, atol=1e-12)
    np.testing.assert_allclose(found.shift, shift, atol=1e-12)


def test_mirrored_points_are_turned_and_not_mirrored_back():
    points = np.random.default_rng(2).normal(0, 1, (20, 3))
    mirrored = points * [1, 1, -1]
    found = fit_similarity(points, mirrored)
    turns, _ = align(points, mirrored[None])
    for rotation in (found.rotation, turns[0]):
        assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert found.scale < 1.0
