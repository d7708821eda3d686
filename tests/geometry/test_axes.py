"""Axes that a file declares, and the rotation from them to ours."""

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.geometry import axes


@pytest.mark.parametrize("up", axes.DIRECTIONS)
@pytest.mark.parametrize("facing", axes.DIRECTIONS)
def test_axes_form_a_right_handed_frame_or_are_rejected(up, facing):
    if up[-1] == facing[-1]:
        with pytest.raises(UserError, match=r"corpus\.head: .* must lie along different axes"):
            axes.world_rotation(up, facing, "corpus.head")
    else:
        turn = axes.world_rotation(up, facing, "corpus.head")
        np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
        assert np.linalg.det(turn) == pytest.approx(1)


def test_our_own_axes_stay():
    np.testing.assert_array_equal(axes.world_rotation("y", "z", "corpus.markers"), np.eye(3))


def test_another_word_is_no_axis():
    with pytest.raises(UserError, match="'up' is not an axis"):
        axes.world_rotation("up", "z", "corpus.markers")
