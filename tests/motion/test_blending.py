"""Velocity-preserving blending: its gap, its speed, and a second implementation with scipy's rotations."""

import numpy as np
import pytest
from dancer import motion
from scipy.spatial.transform import Rotation

from cospeech.motion import library, skeleton
from cospeech.motion.blending import LOWER_BODY, Blender
from cospeech.motion.body import STANDARD, Body
from cospeech.motion.library import Poses

TURN = 1e-9
"""Largest error of an angle in radians: that of scipy's magnitude, near zero."""

HAND_JOINTS = [STANDARD.joints.index(f"{side}_hand") for side in ("left", "right")]

SQUID = Body(
    ("mantle", "left_hand", "left_finger", "tentacle", "tip"),
    np.array([-1, 0, 1, 0, 3]),
    np.array([[0, 0.5, 0], [0.1, 0, 0], [0.05, 0, 0], [0, -0.2, 0], [0, -0.2, 0]]),
)


def wander(rng, n_frames, n_joints, spread=0.3):
    """Random motion that is fast, slow and still by turns, and the same motion one frame earlier."""
    vectors = np.empty((n_frames + 1, n_joints, 3))
    vectors[0] = rng.normal(0, spread, (n_joints, 3))
    for t in range(n_frames):  # a random walk that is drawn back to zero
        share = rng.choice([0.0, 0.01, 0.2], (n_joints, 1))
        vectors[t + 1] = (1 - share) * vectors[t] + np.sqrt(share) * rng.normal(0, spread, (n_joints, 3))
    turned = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True)
    rotations = turned.reshape(n_frames + 1, n_joints, 4)
    rotations *= rng.choice([-1.0, 1.0], (n_frames + 1, n_joints, 1))  # both quaternions of a rotation are valid
    root = np.cumsum(rng.normal(0, 0.02, (n_frames + 1, 3)) * rng.choice([0, 1], (n_frames + 1, 1)), axis=0)
    return Poses(root[1:], rotations[1:]), Poses(root[:-1], rotations[:-1])


def excerpts(rng, body, n_segments=5, longest=30, spread=0.3):
    """Excerpts of random motion, one after another: the desired poses, and the pose before each in its recording."""
    parts = [wander(rng, int(rng.integers(1, longest)), len(body.joints), spread) for _ in range(n_segments)]
    return tuple(
        Poses(np.concatenate([p.root_m for p in one]), np.concatenate([p.rotations for p in one]))
        for one in zip(*parts, strict=True)
    )


def blended_space(body, rotations, local):
    """The rotations by joint, as scipy's: in the world, except for the joints in ``local``."""
    turned = []
    for joint, parent in enumerate(body.parents):
        own = Rotation.from_quat(rotations[:, joint], scalar_first=True)
        turned.append(own if parent < 0 or joint in local else turned[parent] * own)
    return turned


def angles(a, b):
    return (a * b.inv()).magnitude()


@pytest.mark.parametrize(("body", "local"), [(STANDARD, HAND_JOINTS), (SQUID, [1, 2])], ids=["standard", "squid"])
@pytest.mark.parametrize("seed", range(4))
def test_gap_never_grows_and_the_speed_is_that_of_the_recording(body, local, seed):
    rng = np.random.default_rng(seed)
    desired, before = excerpts(rng, body, n_segments=8, spread=(0.1, 0.3, 0.6, 3.0)[seed])
    blender = Blender(body, together=())
    begin = wander(rng, 1, len(body.joints))[0]
    blender.start(begin.root_m[0], begin.rotations[0])
    shown = blender.steps(desired, before)
    earlier = Poses(
        np.concatenate([begin.root_m, shown.root_m[:-1]]), np.concatenate([begin.rotations, shown.rotations[:-1]])
    )
    spaces = [blended_space(body, poses.rotations, local) for poses in (shown, earlier, desired, before)]
    arrived = []
    for r, r_before, d, d_before in zip(*spaces, strict=True):
        gap, gap_before = angles(r, d), angles(r_before, d_before)
        speed, source = angles(r, r_before), angles(d, d_before)
        assert (gap <= gap_before + TURN).all()
        reached = gap < TURN
        assert speed[~reached] == pytest.approx(source[~reached], abs=TURN)
        assert (speed[reached] <= source[reached] + TURN).all()
        arrived.append(reached.mean())
    assert 0 < np.mean(arrived) < 0.9
    gap, gap_before = (np.linalg.norm(a.root_m - b.root_m, axis=1) for a, b in ((shown, desired), (earlier, before)))
    assert (gap <= gap_before + 1e-12).all()


@pytest.mark.parametrize(("body", "local"), [(STANDARD, HAND_JOINTS), (SQUID, [1, 2])], ids=["standard", "squid"])
def test_blending_is_that_of_the_formula_written_with_scipy(body, local):
    rng = np.random.default_rng(9)
    desired, before = excerpts(rng, body)
    blender = Blender(body, together=())
    start = wander(rng, 1, len(body.joints))[0]
    blender.start(start.root_m[0], start.rotations[0])
    frames = np.array([
        blender.step(desired.root_m[t], desired.rotations[t], before.root_m[t], before.rotations[t])
        for t in range(len(desired.root_m))
    ])  # fmt: skip
    d, d_before = (blended_space(body, poses.rotations, local) for poses in (desired, before))
    found = blended_space(body, Poses.from_frames(frames).rotations, local)
    first = blended_space(body, start.rotations, local)
    for joint in range(len(body.joints)):
        r = first[joint][0]
        for t in range(len(frames)):
            gap = (d[joint][t] * r.inv()).as_rotvec()
            angle, speed = np.linalg.norm(gap), angles(d[joint][t], d_before[joint][t])
            r = Rotation.from_rotvec(gap * (min(1.0, speed / angle) if angle > 0 else 1.0)) * r
            assert angles(found[joint][t], r) < 1e-7  # rounding errors add up, since a joint may never arrive


LOWER_JOINTS = [STANDARD.joints.index(name) for name in LOWER_BODY]

LEG_M = np.linalg.norm(
    STANDARD.offsets_m[[STANDARD.joints.index(f"left_{n}") for n in ("thigh", "shin", "foot")]], axis=1
)


def lower_body(a, b):
    """The angles between the joints of the lower body in two series of poses; the last one stands for the roots."""
    spaces = [blended_space(STANDARD, poses.rotations, HAND_JOINTS) for poses in (a, b)]
    turned = [angles(spaces[0][joint], spaces[1][joint]) for joint in LOWER_JOINTS]
    return np.array([*turned, np.linalg.norm(a.root_m - b.root_m, axis=1) / LEG_M.sum()])


@pytest.mark.parametrize("seed", range(4))
def test_the_lower_body_covers_one_share_of_all_its_gaps_and_keeps_its_speed(seed):
    rng = np.random.default_rng(seed)
    desired, before = excerpts(rng, STANDARD, n_segments=8, spread=(0.1, 0.3, 0.6, 1.0)[seed])
    start = wander(rng, 1, len(STANDARD.joints))[0]
    blender = Blender(STANDARD)
    blender.start(start.root_m[0], start.rotations[0])
    shown = blender.steps(desired, before)
    earlier = Poses(*(
        np.concatenate([one, two[:-1]])
        for one, two in ((start.root_m, shown.root_m), (start.rotations, shown.rotations))
    ))  # fmt: skip
    gap, gap_before = lower_body(shown, desired), lower_body(earlier, desired)
    total = [np.sqrt((one**2).sum(axis=0)) for one in (gap_before, lower_body(desired, before), gap)]
    share = np.minimum(1.0, total[1] / total[0])
    assert gap == pytest.approx((1 - share) * gap_before, abs=1e-7)
    assert (total[2] <= np.sqrt((lower_body(earlier, before) ** 2).sum(axis=0)) + TURN).all()
    moved = np.sqrt((lower_body(shown, earlier) ** 2).sum(axis=0))
    assert moved == pytest.approx(np.minimum(total[0], total[1]), abs=1e-7)
    assert 0 < (share == 1).mean() < 1


def crouching(knee_deg, shift_m):
    """Poses whose feet stand at the same place: both knees bent, and the hips shifted to the side."""
    angles = np.zeros((len(knee_deg), len(STANDARD.joints), 3))
    upper, lower = LEG_M[1:]
    bent = np.radians(knee_deg)
    length = np.sqrt(upper**2 + lower**2 + 2 * upper * lower * np.cos(bent))
    lean = np.arcsin(shift_m / length)
    thigh = -np.degrees(np.arctan2(lower * np.sin(bent), upper + lower * np.cos(bent)))
    for side in ("left", "right"):
        for part, x in (("thigh", thigh), ("shin", knee_deg)):
            angles[:, STANDARD.joints.index(f"{side}_{part}"), 0] = x
    turned = skeleton.rotations(angles)
    whole = skeleton.rotations(np.stack([0 * lean, 0 * lean, -np.degrees(lean)], axis=1))
    for side in ("left", "right"):
        joint = STANDARD.joints.index(f"{side}_thigh")
        turned[:, joint] = whole @ turned[:, joint]
    root = np.column_stack([shift_m, length * np.cos(lean) - upper - lower, np.zeros(len(lean))])
    table = skeleton.motion_table(root, skeleton.euler(turned), 20.0)
    return library.from_motion(table)


def test_feet_that_stand_in_both_poses_stay_where_they_are():
    phase = np.linspace(0, 4 * np.pi, 200)
    poses = crouching(12 + 8 * np.sin(phase), 0.04 * np.cos(1.7 * phase))
    feet = [STANDARD.joints.index(f"{side}_foot") for side in ("left", "right")]

    def slip_m(shown):
        places = STANDARD.world(shown.root_m, shown.rotations)[1][:, feet]
        return np.linalg.norm(places - places[0], axis=2).max()

    order = np.concatenate([np.arange(start, start + 20) for start in (100, 5, 150, 60, 20, 170)])
    desired, before = poses.at(order), poses.at(order - 1)
    slips = []
    for together in (LOWER_BODY, ()):
        blender = Blender(STANDARD, together=together)
        blender.start(poses.root_m[0], poses.rotations[0])
        slips.append(slip_m(blender.steps(desired, before)))
    assert slip_m(poses) < 1e-9
    assert slips[0] < 0.002 < 0.01 < slips[1]


def test_steps_are_the_same_alone_and_together():
    rng = np.random.default_rng(5)
    desired, before = excerpts(rng, STANDARD)
    one, many = Blender(STANDARD), Blender(STANDARD)
    alone = np.array([
        one.step(desired.root_m[t], desired.rotations[t], before.root_m[t], before.rotations[t])
        for t in range(len(desired.root_m))
    ])  # fmt: skip
    assert np.array_equal(many.steps(desired, before).frames, alone)
    assert np.array_equal(many.pose, one.pose)


def test_a_recording_that_is_followed_from_its_start_is_shown_as_it_is():
    poses = library.from_motion(motion(n_frames=60, walk_m=0.01, turn_deg=40))
    before = poses.at(np.maximum(np.arange(-1, 59), 0))
    shown = Blender(STANDARD).steps(poses, before)
    assert np.array_equal(shown.root_m, poses.root_m)
    for joint in range(len(STANDARD.joints)):
        a, b = (Rotation.from_quat(one.rotations[:, joint], scalar_first=True) for one in (shown, poses))
        assert angles(a, b) == pytest.approx(0, abs=1e-9)


def test_a_pose_is_held_while_the_recording_rests():
    rng = np.random.default_rng(6)
    poses = wander(rng, 2, len(STANDARD.joints))[0]
    still = poses.at(np.zeros(5, dtype=int))
    blender = Blender(STANDARD)
    blender.start(poses.root_m[1], poses.rotations[1])
    shown = blender.steps(still, still)
    assert shown.root_m == pytest.approx(np.tile(poses.root_m[1], (5, 1)))
    for joint in range(len(STANDARD.joints)):
        held = Rotation.from_quat(poses.rotations[1, joint], scalar_first=True)
        shown_turns = Rotation.from_quat(shown.rotations[:, joint], scalar_first=True)
        assert angles(shown_turns, held) == pytest.approx(0, abs=TURN)
