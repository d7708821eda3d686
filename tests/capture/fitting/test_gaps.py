"""Gaps are interpolated in the frame of the trunk, and detected positions do not change."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cospeech.capture.fitting.gaps import bridge_gaps


def walk(n_frames=40):
    """Return a rotating and translating trunk, and markers: one fixed to it, one moving on it, one never seen."""
    time = np.linspace(0.0, 1.0, n_frames)[:, None]
    rotations = Rotation.from_rotvec(time * (0.3, 1.2, -0.4)).as_matrix()
    shifts = time * (0.5, 0.1, -0.2)
    own = np.stack(
        [np.tile((0.2, -0.3, 0.1), (n_frames, 1)), time**2 * (0.4, 0.3, 0.2), np.full((n_frames, 3), np.nan)], axis=1
    )
    return (rotations, shifts), np.einsum("tij,tmj->tmi", rotations, own) + shifts[:, None]


def test_a_marker_fixed_to_the_trunk_is_recovered_exactly_and_a_moving_one_nearly():
    trunk, places = walk()
    holed = places.copy()
    holed[12:20, :2] = np.nan
    filled = bridge_gaps(holed, trunk)
    assert filled[:, 0] == pytest.approx(places[:, 0], abs=1e-12)
    assert np.abs(filled[:, 1] - places[:, 1]).max() < 0.003  # of a path of 130 mm in the gap
    assert np.isnan(filled[:, 2]).all()


def test_gaps_are_not_filled_where_the_trunk_is_lost():
    trunk, places = walk()
    holed = places.copy()
    holed[12:20, 0] = np.nan
    trunk[0][15], trunk[1][15] = np.nan, np.nan
    filled = bridge_gaps(holed, trunk)
    assert np.isnan(filled[15, 0]).all()
    assert np.isfinite(filled[[14, 16], 0]).all()


@given(st.sets(st.integers(0, 39), max_size=36))
def test_detected_positions_do_not_change_and_gaps_do_not_overshoot(lost):
    trunk, places = walk()
    holed = places.copy()
    holed[sorted(lost), 1] = np.nan
    filled = bridge_gaps(holed, trunk)
    kept = [frame for frame in range(40) if frame not in lost]
    assert np.array_equal(filled[kept], holed[kept], equal_nan=True)
    own = np.einsum("tji,tj->ti", trunk[0], filled[:, 1] - trunk[1])
    true = np.einsum("tji,tj->ti", trunk[0], places[:, 1] - trunk[1])
    assert (own.min(axis=0) >= true[kept].min(axis=0) - 1e-12).all()
    assert (own.max(axis=0) <= true[kept].max(axis=0) + 1e-12).all()
