"""Hidden markers of a rigid part are predicted from the visible ones."""

import numpy as np
from scipy.spatial.transform import Rotation

from cospeech.capture.tracking import rigid_parts
from cospeech.motion.markers import NAMES


def test_a_hidden_marker_moves_with_its_part():
    reference = np.random.default_rng(0).normal(0, 0.3, (15, 3))
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    moved = reference @ turn.T + [0.1, 0.2, -0.3]
    back = NAMES.index("back")
    hidden = moved.copy()
    hidden[back] = np.nan
    hidden[NAMES.index("left_hand")] = np.nan
    found = rigid_parts.carried(reference, hidden)
    np.testing.assert_allclose(found[back], moved[back], atol=1e-12)
    assert np.isnan(np.delete(found, back, axis=0)).all()
    hidden[NAMES.index("chest")] = np.nan
    assert np.isnan(rigid_parts.carried(reference, hidden)).all()
