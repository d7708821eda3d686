"""Hands that keep their places relative to the shoulders on bodies of other proportions."""

from dataclasses import replace

import numpy as np
import pytest
from skeletons import ARM_DEG, motion_of, target

from cospeech import cli
from cospeech.corpus import onto, onto_hands, retarget
from cospeech.errors import UserError
from cospeech.formats import bvh
from cospeech.geometry import rotation
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses

OURS = {name: joint for joint, name in enumerate(STANDARD.joints)}
WRISTS = [OURS["left_hand"], OURS["right_hand"]]


def meeting():
    """A pose in which both wrists are in the same place in front of the chest: (1,) poses."""

    def posed(inward_deg):
        turns = np.tile(np.eye(3), (len(OURS), 1, 1))
        for side, sign in (("left", 1.0), ("right", -1.0)):
            turns[OURS[f"{side}_arm"]] = rotation.from_euler("X", np.array([-40.0]))
            turns[OURS[f"{side}_forearm"]] = rotation.from_euler("YX", np.array([-sign * inward_deg, -70.0]))
        return Poses(np.zeros((1, 3)), rotation.to_quaternions(turns[None]))

    low, high = 0.0, 90.0
    for _ in range(60):
        middle = (low + high) / 2
        x = STANDARD.world(np.zeros((1, 3)), posed(middle).rotations)[1][0, OURS["left_hand"], 0]
        low, high = (middle, high) if x > 0 else (low, middle)
    return posed(low)


def even(theirs):
    """The same skeleton with a right arm like the left one."""
    offsets = theirs.offsets.copy()
    for part in ("arm", "forearm", "hand"):
        offsets[OURS[f"right_{part}"]] = offsets[OURS[f"left_{part}"]] * [-1, 1, 1]
    return replace(theirs, offsets=offsets)


@pytest.mark.parametrize("pose", ARM_DEG)
@pytest.mark.parametrize("seed", [3, 5])
def test_hands_that_meet_do_so_on_other_bodies(pose, seed):
    poses, theirs = meeting(), even(target(pose, "z", seed))
    own = STANDARD.world(poses.root_m, poses.rotations)[1][0, WRISTS]
    assert np.linalg.norm(own[0] - own[1]) < 1e-6
    source = onto.joint_map(theirs.names, None, "theirs")
    root, local = onto.retargeted(poses, theirs, source)
    apart_cm = [np.linalg.norm(np.subtract(*theirs.world(root, local)[1][0, WRISTS]))]
    local, missed = onto_hands.kept(poses, theirs, source, root, local)
    apart_cm.append(np.linalg.norm(np.subtract(*theirs.world(root, local)[1][0, WRISTS])))
    assert missed.max() < 1e-6
    assert apart_cm[0] > 3.0
    assert apart_cm[1] < 1e-3


def test_wrists_are_at_their_places_and_the_rest_of_the_body_stays(recordings):
    poses, theirs = motion_of(recordings / "talk_1.bvh"), even(target("A", "z", 5))
    source = onto.joint_map(theirs.names, None, "theirs")
    root, before = onto.retargeted(poses, theirs, source)
    after, missed = onto_hands.kept(poses, theirs, source, root, before)
    turned, placed = theirs.world(root, after)
    old_turned, old_placed = theirs.world(root, before)
    own_turned, own = STANDARD.world(poses.root_m, poses.rotations)
    chest, axes = own_turned[:, OURS["chest"]], retarget.AXES["z"]
    rest = theirs.world(theirs.offsets[:1], theirs.rotations[None])[1][0] @ axes.T
    shoulders = [OURS["left_arm"], OURS["right_arm"]]
    wide = [np.linalg.norm(np.subtract(*one[shoulders])) / 2 for one in (onto.standard_rest(), rest)]
    length = [
        sum(
            np.linalg.norm(one[OURS[f"{side}_{a}"]] - one[OURS[f"{side}_{b}"]])
            for side in ("left", "right")
            for a, b in (("arm", "forearm"), ("forearm", "hand"))
        )
        for one in (onto.standard_rest(), rest)
    ]
    for number, wrist in enumerate(WRISTS):
        for frame in range(0, len(own), 7):
            if missed[frame, number] > 1e-6:
                continue
            middle = [one[frame, shoulders].mean(axis=0) for one in (own, placed @ axes.T)]
            ours = chest[frame].T @ (own[frame, wrist] - middle[0])
            found = chest[frame].T @ (placed[frame, wrist] @ axes.T - middle[1])
            scale = length[1] / length[0]
            across = min(abs(ours[0]), wide[0]) * wide[1] / wide[0] + scale * max(abs(ours[0]) - wide[0], 0)
            np.testing.assert_allclose(found, [np.sign(ours[0]) * across, *scale * ours[1:]], atol=0.1)  # cm
    assert np.mean(missed < 1e-6) > 0.5
    assert missed.max() < 0.05
    others = [joint for joint, name in enumerate(STANDARD.joints) if "forearm" not in name and "hand" not in name]
    np.testing.assert_allclose(placed[:, others], old_placed[:, others], atol=1e-9)
    np.testing.assert_allclose(turned[:, WRISTS], old_turned[:, WRISTS], atol=1e-9)


def test_on_a_body_of_our_proportions_nothing_changes(recordings):
    poses = motion_of(recordings / "talk_1.bvh")
    still = np.tile(np.eye(3), (len(OURS), 1, 1))
    theirs = onto.Target(
        STANDARD.joints, tuple(STANDARD.parents.tolist()), STANDARD.offsets_m, still, {}, "y", "ours"
    )
    root, before = onto.retargeted(poses, theirs, OURS)
    after, missed = onto_hands.kept(poses, theirs, OURS, root, before)
    assert missed.max() < 1e-6
    np.testing.assert_allclose(theirs.world(root, after)[1], theirs.world(root, before)[1], atol=2e-3)


def test_the_command_keeps_the_hands(recordings, tmp_path, capsys):
    theirs = target("T", "y", 7)
    still, root = np.tile(np.eye(3), (2, len(theirs.names), 1, 1)), np.tile(theirs.offsets[0], (2, 1))
    clip = bvh.Clip(theirs.names, theirs.parents, still, {0: root}, 30.0, theirs.offsets, dict(theirs.tips))
    bvh.write_clip(clip, tmp_path / "theirs.bvh")
    given = ["retarget", str(recordings / "talk_1.bvh"), "--to", str(tmp_path / "theirs.bvh"), "--out"]
    assert cli.main([*given, str(tmp_path / "a.bvh")]) == 0
    assert cli.main([*given, str(tmp_path / "b.bvh"), "--keep", "hands"]) == 0
    assert "hands keep their places relative to the shoulders" in capsys.readouterr().err
    one, other = (bvh.read(tmp_path / name) for name in ("a.bvh", "b.bvh"))
    changed = np.abs(one.rotations - other.rotations).max(axis=(0, 2, 3))
    moved = {name for name, most in zip(one.names, changed, strict=True) if most > 1e-6}
    assert moved == {f"{side}_{part}" for side in ("left", "right") for part in ("arm", "forearm", "hand")}


def test_a_skeleton_without_hands_is_refused():
    with pytest.raises(UserError, match="'left_hand', needed by --keep hands"):
        onto_hands.check_joints({"hips": 0}, "theirs")
