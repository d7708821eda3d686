"""Retargeting preserves the direction of every limb, whatever the axes, rest pose and joints of the source."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cospeech.corpus.retarget import AXES, SMPLX, MotionConventions, motion_table
from cospeech.errors import UserError
from cospeech.formats import bvh, smplx
from cospeech.formats.bvh import Clip
from cospeech.motion import skeleton

LIMBS = [
    (f"{side}_{part}", f"{side}_{child}")
    for side in ("left", "right")
    for part, child in (("arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot"))
]

# A different skeleton: other names, collar bones and an additional vertebra; offsets in its T-pose, y up.
OTHER = {
    "Hips": (None, (0, 95, 0)), "Spine": ("Hips", (0, 10, 0)), "Spine1": ("Spine", (0, 8, 0)),
    "Chest": ("Spine1", (0, 8, 0)), "Neck": ("Chest", (0, 25, 0)), "Head": ("Neck", (0, 10, 2)),
    "LCollar": ("Chest", (5, 20, 0)), "LArm": ("LCollar", (12, 0, 0)), "LElbow": ("LArm", (28, 0, 0)),
    "LWrist": ("LElbow", (25, 0, 0)),
    "RCollar": ("Chest", (-5, 20, 0)), "RArm": ("RCollar", (-12, 0, 0)), "RElbow": ("RArm", (-28, 0, 0)),
    "RWrist": ("RElbow", (-25, 0, 0)),
    "LHip": ("Hips", (9, -3, 0)), "LKnee": ("LHip", (0, -43, 0)), "LAnkle": ("LKnee", (0, -42, 0)),
    "RHip": ("Hips", (-9, -3, 0)), "RKnee": ("RHip", (0, -43, 0)), "RAnkle": ("RKnee", (0, -42, 0)),
}  # fmt: skip
OURS = {
    "hips": "Hips", "spine": "Spine", "chest": "Chest", "neck": "Neck", "head": "Head",
    "left_arm": "LArm", "left_forearm": "LElbow", "left_hand": "LWrist",
    "right_arm": "RArm", "right_forearm": "RElbow", "right_hand": "RWrist",
    "left_thigh": "LHip", "left_shin": "LKnee", "left_foot": "LAnkle",
    "right_thigh": "RHip", "right_shin": "RKnee", "right_foot": "RAnkle",
}  # fmt: skip
SWAP = {"left": "right", "right": "left"}
SWAPPED = {"_".join(SWAP.get(word, word) for word in ours.split("_")): theirs for ours, theirs in OURS.items()}


def other_clip(seed, up="y", n_frames=20, largest=0.9):
    """The other skeleton in random motion, in a file with y up or z up."""
    rng = np.random.default_rng(seed)
    names = tuple(OTHER)
    parents = tuple(-1 if parent is None else names.index(parent) for parent, _ in OTHER.values())
    to_file = AXES[up].T
    offsets = np.array([offset for _, offset in OTHER.values()], dtype=float) @ to_file.T
    turns = rng.uniform(-largest, largest, (n_frames, len(names), 3))
    turns[:, [names.index(name) for name in ("Hips", "Spine", "Spine1", "Chest")]] *= (
        0.2  # the trunk stays roughly upright
    )
    rotations = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(n_frames, len(names), 3, 3)
    root = rng.normal(0, 5, (n_frames, 3)) + np.array([3, 95, 7]) @ to_file.T
    return Clip(names, parents, rotations, {0: root}, 30.0, offsets, {})


def places_by_hand(clip):
    """World positions (T, J, 3) of all joints of ``clip``, by following the chain frame by frame."""
    n_frames, n_joints = clip.rotations.shape[:2]
    places, world = np.zeros((n_frames, n_joints, 3)), np.zeros((n_frames, n_joints, 3, 3))
    for t in range(n_frames):
        for j, parent in enumerate(clip.parents):
            local = clip.places[j][t] if j in clip.places else clip.offsets[j]
            above = np.eye(3) if parent < 0 else world[t, parent]
            places[t, j] = (0 if parent < 0 else places[t, parent]) + above @ local
            world[t, j] = above @ clip.rotations[t, j]
    return places


def placed(motion):
    return skeleton.forward(motion[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(motion))


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def check_limbs(motion, theirs, names, joints, axes):
    ours = placed(motion)
    for joint, child in LIMBS:
        bone = theirs[:, names.index(joints[child])] - theirs[:, names.index(joints[joint])]
        np.testing.assert_allclose(unit(ours[child] - ours[joint]), unit(bone @ axes.T), atol=1e-7, err_msg=joint)


@pytest.mark.parametrize("zero", ["t_pose", "offsets"])
@pytest.mark.parametrize("up", ["y", "z"])
def test_every_limb_keeps_its_direction_in_the_world(up, zero):
    clip = other_clip(1, up)
    motion, notes = motion_table(clip, MotionConventions(up, "cm", OURS, zero), "a.bvh")
    check_limbs(motion, places_by_hand(clip), clip.names, OURS, AXES[up])
    assert notes == []


@pytest.mark.parametrize("up", ["y", "z"])
def test_a_rest_pose_with_bent_limbs_is_read_from_the_offsets(up):
    clip = other_clip(2, up)
    bent = clip.offsets.copy()
    for name, degrees in (("LElbow", -40), ("LWrist", -55), ("RElbow", 40), ("RWrist", 30), ("LKnee", 12)):
        joint = clip.names.index(name)
        turn = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
        bent[joint] = AXES[up].T @ turn @ AXES[up] @ bent[joint]
    clip = Clip(clip.names, clip.parents, clip.rotations, clip.places, clip.fps, bent, {})
    motion, _ = motion_table(clip, MotionConventions(up, "cm", OURS, "offsets"), "a.bvh")
    check_limbs(motion, places_by_hand(clip), clip.names, OURS, AXES[up])


def test_a_lying_rest_pose_is_made_upright_by_the_rotations():
    # the same body, described with its trunk along x and made upright by its root rotation
    clip = other_clip(3)
    lay = Rotation.from_euler("z", -90, degrees=True).as_matrix()  # y to x
    rotations = np.einsum("ij,tajk,lk->tail", lay, clip.rotations, lay)
    rotations[:, 0] = clip.rotations[:, 0] @ lay.T
    lying = Clip(clip.names, clip.parents, rotations, clip.places, clip.fps, clip.offsets @ lay.T, {})
    upright, _ = motion_table(clip, MotionConventions("y", "cm", OURS, "offsets"), "a.bvh")
    stood, _ = motion_table(lying, MotionConventions("y", "cm", OURS, "offsets"), "b.bvh")
    np.testing.assert_allclose(skeleton.angles(stood), skeleton.angles(upright), atol=1e-6)


def test_our_skeleton_is_read_back_unchanged(tmp_path):
    rng = np.random.default_rng(4)
    angles = rng.uniform(-40, 40, (30, len(skeleton.JOINTS), 3))
    root = rng.normal(0, 0.05, (30, 3))
    motion = skeleton.motion_table(root - root.mean(axis=0), angles, 20.0)
    bvh.write(motion, tmp_path / "a.bvh")
    for zero in ("hanging", "offsets"):
        back, _ = motion_table(bvh.read(tmp_path / "a.bvh"), MotionConventions("y", "m", "cospeech", zero), "a.bvh")
        np.testing.assert_allclose(back.to_numpy(), motion.to_numpy(), atol=2e-6)  # six decimals in the file


def test_smplx_arms_hang_and_elbows_bend_like_ours():
    turns = np.zeros((2, len(smplx.NAMES), 3))
    for side, sign in (("left", -1), ("right", 1)):
        turns[:, smplx.NAMES.index(f"{side}_collar"), 2] = sign * np.radians(10)
        turns[:, smplx.NAMES.index(f"{side}_shoulder"), 2] = sign * np.radians(80)
        turns[1, smplx.NAMES.index(f"{side}_elbow"), 1] = sign * np.radians(90)
    rotations = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(2, -1, 3, 3)
    clip = Clip(smplx.NAMES, smplx.PARENTS, rotations, {0: np.zeros((2, 3))}, 30.0)
    motion, _ = motion_table(clip, MotionConventions("y", "m", "smplx", "t_pose"), "a.npz")
    expected = np.zeros((2, len(skeleton.JOINTS), 3))
    expected[1, [skeleton.JOINTS.index(f"{side}_forearm") for side in ("left", "right")], 0] = -90
    np.testing.assert_allclose(skeleton.angles(motion), expected, atol=1e-6)
    hands = placed(motion)
    for side in ("left", "right"):  # forearms point forward: the hand is in front of the elbow, at the same height
        np.testing.assert_allclose(hands[f"{side}_hand"][1] - hands[f"{side}_forearm"][1], [0, 0, 0.25], atol=1e-7)


def test_smplx_in_a_world_with_z_up_gives_the_same_motion():
    rng = np.random.default_rng(5)
    turns = rng.uniform(-0.4, 0.4, (10, len(smplx.NAMES), 3))
    rotations = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(10, -1, 3, 3)
    trans = rng.normal(0, 0.02, (10, 3))
    clip = Clip(smplx.NAMES, smplx.PARENTS, rotations, {0: trans}, 30.0)
    in_z = rotations.copy()
    in_z[:, 0] = AXES["z"].T @ rotations[:, 0]
    other = Clip(smplx.NAMES, smplx.PARENTS, in_z, {0: trans @ AXES["z"]}, 30.0)
    one, _ = motion_table(clip, MotionConventions("y", "m", "smplx", "t_pose"), "a.npz")
    two, _ = motion_table(other, MotionConventions("z", "m", "smplx", "t_pose"), "b.npz")
    np.testing.assert_allclose(two.to_numpy(), one.to_numpy(), atol=1e-9)


def test_hip_displacement_is_relative_to_the_mean_in_metres_and_our_axes():
    clip = other_clip(6, "z")
    motion, _ = motion_table(clip, MotionConventions("z", "cm", OURS, "t_pose"), "a.bvh")
    x, y, z = (clip.places[0] - clip.places[0].mean(axis=0)).T / 100
    np.testing.assert_allclose(motion[list(skeleton.ROOT_COLUMNS)], np.column_stack([x, z, -y]), atol=1e-12)


def test_hips_below_a_reference_joint_keep_their_position_and_orientation():
    clip = other_clip(7)
    turn = Rotation.from_euler("y", 20, degrees=True).as_matrix()
    names = ("Reference", *clip.names)
    parents = (-1, *(parent + 1 for parent in clip.parents))
    rotations = np.concatenate([np.broadcast_to(turn, (20, 1, 3, 3)), clip.rotations], axis=1)
    places = {0: np.full((20, 3), 11.0), 1: clip.places[0]}
    below = Clip(names, parents, rotations, places, clip.fps, np.vstack([np.zeros(3), clip.offsets]), {})
    motion, _ = motion_table(below, MotionConventions("y", "cm", OURS, "t_pose"), "a.bvh")
    theirs = places_by_hand(below)
    check_limbs(motion, theirs, names, OURS, np.eye(3))
    hips = theirs[:, 1] / 100
    np.testing.assert_allclose(motion[list(skeleton.ROOT_COLUMNS)], hips - hips.mean(axis=0), atol=1e-12)


def test_missing_joints_have_zero_angles_and_are_noted():
    clip = other_clip(8)
    some = {ours: theirs for ours, theirs in OURS.items() if "hand" not in ours and ours != "spine"}
    motion, notes = motion_table(clip, MotionConventions("y", "cm", some, "t_pose"), "a.bvh")
    assert (motion[skeleton.angle_columns(("spine", "left_hand", "right_hand"))] == 0).all(axis=None)
    assert notes == ["joints at zero angles, as the file lacks them: spine, left_hand, right_hand"]
    whole, _ = motion_table(clip, MotionConventions("y", "cm", OURS, "t_pose"), "a.bvh")
    ours, full = placed(motion), placed(whole)
    np.testing.assert_allclose(
        ours["left_hand"] - ours["left_forearm"], full["left_hand"] - full["left_forearm"], atol=1e-9
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joints": OURS | {"left_arm": "LArn"}}, "unknown joint 'LArn'; did you mean 'LArm'"),
        ({"joints": OURS | {"left_am": "LArm"}}, "config.*unknown joint 'left_am'; did you mean 'left_arm'"),
        ({"joints": {"hips": "Hips"}}, "no joint is mapped to 'chest'"),
        ({"joints": "cospeech"}, "no joint is mapped to 'hips'"),
        ({"unit": "m"}, "upper arm is 28 m long if the unit is m; correct corpus.motion.unit|hips rise"),
        ({"unit": "mm"}, "corpus.motion.unit"),
        ({"up": "z", "zero": "offsets"}, "leans .* degrees from upright"),
        ({"joints": SWAPPED}, "'RArm' is on the actor's right"),
        ({"joints": SWAPPED, "zero": "offsets"}, "swap left and right"),
        ({"zero": "hanging"}, "'LArm' does not point as in hanging"),
    ],
)
def test_conventions_that_do_not_fit_the_file_are_rejected(changes, message):
    fitting = {"up": "y", "unit": "cm", "joints": OURS, "zero": "t_pose"}
    with pytest.raises(UserError, match=message) as caught:
        motion_table(other_clip(9), MotionConventions(**fitting | changes), "a.bvh")
    assert len(str(caught.value).splitlines()) == 1


def test_offsets_that_leave_the_axial_rotation_undetermined_are_rejected():
    clip = other_clip(10)
    offsets = clip.offsets.copy()
    offsets[clip.names.index("LKnee")] = [0, 43, 0]  # all bones along one axis, as written by some exporters
    clip = Clip(clip.names, clip.parents, clip.rotations, clip.places, clip.fps, offsets, {})
    with pytest.raises(UserError, match=r"'LHip' points up"):
        motion_table(clip, MotionConventions("y", "cm", OURS, "offsets"), "a.bvh")


def test_an_unusual_heading_is_noted():
    clip = other_clip(11, largest=0.1)
    clip.rotations[:, 0] = Rotation.from_euler("y", 90, degrees=True).as_matrix() @ clip.rotations[:, 0]
    _, notes = motion_table(clip, MotionConventions("y", "cm", OURS, "t_pose"), "a.bvh")
    assert len(notes) == 1
    assert 80 < int(notes[0].split()[1]) < 100
    assert "left of +z" in notes[0]


def extended(clip, above, name, offset, turns):
    """The clip with a further joint (offset, rotations) between ``above`` and its only child."""
    at = clip.names.index(above) + 1
    child = clip.parents.index(at - 1)
    parents = [parent + (parent >= at) for parent in clip.parents]
    parents[child] = at
    offsets = clip.offsets.copy()
    offsets[child] -= offset
    return Clip(
        (*clip.names[:at], name, *clip.names[at:]),
        (*parents[:at], at - 1, *parents[at:]),
        np.insert(clip.rotations, at, turns, axis=1),
        clip.places,
        clip.fps,
        np.insert(offsets, at, offset, axis=0),
        {},
    )


@pytest.mark.parametrize("zero", ["t_pose", "offsets"])
def test_a_collar_bone_is_not_an_upper_arm(zero):
    collar = OURS | {"left_arm": "LCollar", "right_arm": "RCollar"}
    with pytest.raises(
        UserError, match=r"'LCollar' is mapped to left_arm, but 'LArm', which it skips, moves 'LElbow'"
    ):
        motion_table(other_clip(12), MotionConventions("y", "cm", collar, zero), "a.bvh")


def test_a_joint_that_bends_the_forearm_must_be_mapped():
    bent = Rotation.from_euler("y", np.linspace(0, 25, 20)[:, None], degrees=True).as_matrix()
    clip = extended(other_clip(13), "LElbow", "LMid", [12, 0, 0], bent)
    with pytest.raises(
        UserError, match=r"'LElbow' is mapped to left_forearm, but 'LMid', .* moves 'LWrist' by up to 1"
    ):
        motion_table(clip, MotionConventions("y", "cm", OURS, "t_pose"), "a.bvh")


def test_a_joint_that_hardly_bends_may_be_skipped():
    bent = Rotation.from_euler("y", np.linspace(0, 9, 20)[:, None], degrees=True).as_matrix()
    clip = extended(other_clip(13), "LElbow", "LMid", [12, 0, 0], bent)
    motion_table(clip, MotionConventions("y", "cm", OURS, "t_pose"), "a.bvh")


def test_a_joint_that_twists_a_limb_may_be_skipped():
    twist = Rotation.from_euler("x", np.linspace(0, 90, 20)[:, None], degrees=True).as_matrix()
    clip = extended(other_clip(13), "LElbow", "LTwist", [12, 0, 0], twist)
    motion, _ = motion_table(clip, MotionConventions("y", "cm", OURS, "t_pose"), "a.bvh")
    check_limbs(motion, places_by_hand(clip), clip.names, OURS, np.eye(3))


def test_a_forearm_belongs_to_its_arm():
    crossed = OURS | {"left_forearm": "RElbow", "right_forearm": "LElbow"}
    with pytest.raises(UserError, match=r"'LArm' is mapped to left_arm, but does not carry 'RElbow' .left_forearm."):
        motion_table(other_clip(12), MotionConventions("y", "cm", crossed, "t_pose"), "a.bvh")
    joints = SMPLX | {"left_hand": "right_wrist"}
    with pytest.raises(UserError, match="but does not carry 'right_wrist'"):
        motion_table(smplx_clip(), MotionConventions("y", "m", joints, "t_pose"), "a.npz")


def smplx_clip(turned=(), n_frames=10, trans=None):
    """An SMPL-X clip at zero angles, but for some joints that turn by 0.5 rad about x over time."""
    rotations = np.broadcast_to(np.eye(3), (n_frames, len(smplx.NAMES), 3, 3)).copy()
    for name in turned:
        turns = np.linspace(0, 0.5, n_frames)[:, None] * [1, 0, 0]
        rotations[:, smplx.NAMES.index(name)] = Rotation.from_rotvec(turns).as_matrix()
    trans = np.zeros((n_frames, 3)) if trans is None else np.asarray(trans)
    return Clip(smplx.NAMES, smplx.PARENTS, rotations, {0: trans}, 30.0)


def test_a_collar_bone_without_offsets_is_not_an_upper_arm_either():
    collar = {**SMPLX, "left_arm": "left_collar"}
    still = smplx_clip()
    motion_table(still, MotionConventions("y", "m", collar, "t_pose"), "a.npz")
    with pytest.raises(
        UserError, match="'left_collar' is mapped to left_arm, but 'left_shoulder', which it skips, moves"
    ):
        motion_table(smplx_clip(["left_shoulder"]), MotionConventions("y", "m", collar, "t_pose"), "a.npz")


def test_the_chest_of_smplx_is_the_vertebra_that_bears_neck_and_arms():
    for vertebra, joint in (("spine1", "spine"), ("spine2", "chest"), ("spine3", "chest")):
        motion, _ = motion_table(smplx_clip([vertebra]), MotionConventions("y", "m", "smplx", "t_pose"), "a.npz")
        turned = motion[skeleton.angle_columns(("spine", "chest", "neck", "head"))].iloc[-1]
        moving = {name for name in turned.index if abs(turned[name]) > 1e-6}
        assert moving == {f"{joint}_x_deg"}, vertebra


@pytest.mark.parametrize(
    ("unit", "trans", "message"),
    [
        ("m", [[0, 900 + frame / 100, 0] for frame in range(10)], "hips are 900 m above the ground if the unit is m"),
        (
            "m",
            [[0, frame, 0] for frame in range(10)],
            "hips rise by 9 m if the unit is m; correct corpus.motion.unit",
        ),
        ("m", [[8 * frame, 0, 0] for frame in range(10)], "hips travel 72 m"),
        ("m", [[frame % 2, 0, 0] for frame in range(10)], "hips move at 30 m/s"),
        ("mm", [[0, 0.9, 0] for frame in range(10)], "hips are 0.0009 m above the ground if the unit is mm"),
        (0.01, [[0, 0.9, 0] for frame in range(10)], "hips are 0.009 m above the ground if the unit is 0.01 m"),
    ],
)
def test_a_path_of_the_hips_that_is_impossible_in_the_unit_is_rejected(unit, trans, message):
    with pytest.raises(UserError, match=message):
        motion_table(smplx_clip(trans=trans), MotionConventions("y", unit, "smplx", "t_pose"), "a.npz")


@pytest.mark.parametrize(("unit", "metres"), [("inch", 0.0254), ("in", 0.0254), (0.056444, 0.056444), ("cm", 0.01)])
def test_hip_displacement_has_the_size_of_the_unit(unit, metres):
    clip = other_clip(14)
    scaled = Clip(clip.names, clip.parents, clip.rotations, {0: clip.places[0] / 100 / metres}, clip.fps,
                  clip.offsets / 100 / metres, {})  # fmt: skip
    motion, _ = motion_table(scaled, MotionConventions("y", unit, OURS, "t_pose"), "a.bvh")
    expected = (clip.places[0] - clip.places[0].mean(axis=0)) / 100
    np.testing.assert_allclose(motion[list(skeleton.ROOT_COLUMNS)], expected, atol=1e-12)


def test_declared_names_match_in_either_unicode_composition_and_with_quotation_marks():
    clip = other_clip(15)
    names = tuple("Bras lev\u00e9" if name == "LArm" else name for name in clip.names)
    clip = Clip(names, clip.parents, clip.rotations, clip.places, clip.fps, clip.offsets, {})
    for written in ("Bras lev\u00e9", "Bras leve\u0301", '"Bras lev\u00e9"'):
        motion_table(clip, MotionConventions("y", "cm", OURS | {"left_arm": written}, "t_pose"), "a.bvh")


def test_a_name_that_two_joints_share_cannot_be_mapped():
    clip = other_clip(16)
    names = tuple("LArm" if name == "Head" else name for name in clip.names)
    clip = Clip(names, clip.parents, clip.rotations, clip.places, clip.fps, clip.offsets, {})
    others = {ours: theirs for ours, theirs in OURS.items() if ours != "head"}
    with pytest.raises(UserError, match="2 joints are called 'LArm'; give each its own name"):
        motion_table(clip, MotionConventions("y", "cm", others, "t_pose"), "a.bvh")
    names = tuple("Toe" if name in ("LAnkle", "RAnkle") else name for name in other_clip(16).names)
    clip = Clip(names, clip.parents, clip.rotations, clip.places, clip.fps, clip.offsets, {})
    unmapped = {ours: theirs for ours, theirs in OURS.items() if "foot" not in ours}
    motion_table(clip, MotionConventions("y", "cm", unmapped, "t_pose"), "a.bvh")
