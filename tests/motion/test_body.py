"""Bodies of any shape: their forward kinematics, tables, and what is refused."""

import numpy as np
import pytest
from dancer import motion

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD, Body


def test_the_standard_body_moves_as_the_skeleton_does():
    table = motion(n_frames=20, walk_m=0.01, turn_deg=40)
    poses = library.from_motion(table)
    turned, placed = STANDARD.world(poses.root_m, poses.rotations)
    expected = skeleton.chain(table[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(table))
    assert turned == pytest.approx(expected[0], abs=1e-12)
    assert placed == pytest.approx(expected[1], abs=1e-12)


def test_a_body_survives_its_table():
    table = STANDARD.to_table()
    tables.validate(table, "body", "here")
    again = Body.from_table(table)
    assert again.joints == STANDARD.joints
    assert np.array_equal(again.parents, STANDARD.parents)
    assert np.array_equal(again.offsets_m, STANDARD.offsets_m)


@pytest.mark.parametrize(
    ("joints", "parents", "offsets", "complaint"),
    [
        ((), [], np.zeros((0, 3)), "at least one joint"),
        (("a", "b"), [-1], np.zeros((2, 3)), "one parent and one offset"),
        (("a", "a"), [-1, 0], np.zeros((2, 3)), "several joints with the name 'a'"),
        (("a", "b"), [-1, -1], np.zeros((2, 3)), "joint 'b' of the body has an impossible parent"),
        (("a", "b"), [-1, 1], np.zeros((2, 3)), "joint 'b' of the body has an impossible parent"),
        (("a", "b"), [0, 0], np.zeros((2, 3)), "joint 'a' of the body has an impossible parent"),
        (("a", "b"), [-1, 0], np.array([[0, 0, 0], [0, np.nan, 0]]), "offset of joint 'b'"),
    ],
)
def test_impossible_bodies_are_refused(joints, parents, offsets, complaint):
    with pytest.raises(UserError, match=complaint):
        Body(joints, np.array(parents), offsets)


def test_a_parent_that_is_not_a_joint_is_named():
    table = STANDARD.to_table().replace({"parent": {"chest": "thorax"}})
    with pytest.raises(UserError, match="'neck' has the parent 'thorax'"):
        Body.from_table(table)
