"""Blending and transitions: gap, speed, feet, and second implementations with scipy's rotations."""

import numpy as np
import pytest
from dancer import motion
from scipy.spatial.transform import Rotation

from cospeech.motion import library, skeleton
from cospeech.motion.blending import ARM_CATCH_UP_S, ARMS, LOWER_BODY, SWING_S, Blender, Transitions
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
    blender = Blender(body, together=(), feet=())
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
    blender = Blender(body, together=(), feet=())
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
    blender = Blender(STANDARD, feet=())
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


FEET = [STANDARD.joints.index(f"{side}_foot") for side in ("left", "right")]


def slip_m(shown):
    """The largest horizontal distance of a foot from where it was first."""
    places = STANDARD.world(shown.root_m, shown.rotations)[1][:, FEET][:, :, [0, 2]]
    return np.linalg.norm(places - places[0], axis=2).max()


def leaning():
    """Leaning and crouching, with feet at the same place, in excerpts that start and end anywhere."""
    phase = np.linspace(0, 4 * np.pi, 200)
    poses = crouching(12 + 8 * np.sin(phase), 0.04 * np.cos(1.7 * phase))
    order = np.concatenate([np.arange(start, start + 20) for start in (100, 5, 150, 60, 20, 170)])
    return poses, order


STEPPERS = {
    "blender": lambda **options: Blender(STANDARD, **options),
    "transitions": lambda **options: Transitions(STANDARD, 20.0, **options),
}


@pytest.mark.parametrize("name", STEPPERS)
def test_feet_that_stand_in_all_poses_stay_where_they_are(name):
    poses, order = leaning()
    assert slip_m(poses) < 1e-9
    stepper = STEPPERS[name]()
    stepper.start(poses.root_m[0], poses.rotations[0])
    assert slip_m(stepper.steps(poses.at(order), poses.at(order - 1))) < 0.002
    plain = Blender(STANDARD, together=(), feet=())
    plain.start(poses.root_m[0], poses.rotations[0])
    assert slip_m(plain.steps(poses.at(order), poses.at(order - 1))) > 0.01


@pytest.mark.parametrize("name", STEPPERS)
def test_where_in_the_room_a_segment_was_recorded_does_not_move_the_feet(name):
    poses, order = leaning()
    shift = np.repeat(np.random.default_rng(3).uniform(-1, 1, (6, 3)) * [1, 0, 1], 20, axis=0)
    desired, before = (Poses(one.root_m + shift, one.rotations) for one in (poses.at(order), poses.at(order - 1)))
    stepper = STEPPERS[name]()
    stepper.start(poses.root_m[0], poses.rotations[0])
    assert slip_m(stepper.steps(desired, before)) < 0.002
    loose = STEPPERS[name](feet=())
    loose.start(poses.root_m[0], poses.rotations[0])
    assert slip_m(loose.steps(desired, before)) > 0.05


@pytest.mark.parametrize("name", STEPPERS)
def test_a_walk_goes_as_far_as_the_recorded_one_and_returns_to_it(name):
    """The feet move all the time, so a body that was elsewhere comes to where the recording is."""
    poses = library.from_motion(motion(n_frames=300))
    root = poses.root_m + np.column_stack([0.05 * np.arange(300), np.zeros(300), np.zeros(300)])
    walk = Poses(root, poses.rotations)
    frames = np.arange(1, 300)
    stepper = STEPPERS[name]()
    stepper.start(root[0] + [0.0, 0.0, 1.0], poses.rotations[0])
    shown = stepper.steps(walk.at(frames), walk.at(frames - 1))
    gap = np.linalg.norm(shown.root_m - walk.root_m[1:], axis=1)
    assert gap[0] > 0.9
    assert gap[-1] < 1e-6


def test_a_transition_between_resting_poses_is_the_polynomial_between_them():
    rng = np.random.default_rng(8)
    first, second = wander(rng, 1, 5)[0], wander(rng, 1, 5)[0]
    stepper = Transitions(SQUID, 20.0, 0.5, arms=())
    stepper.start(first.root_m[0], first.rotations[0])
    still = second.at(np.zeros(12, dtype=int))
    shown = stepper.steps(still, still)
    s = np.minimum(np.arange(1, 13) / 10, 1)
    left = 1 - (10 * s**3 - 15 * s**4 + 6 * s**5)
    assert shown.root_m == pytest.approx(second.root_m + left[:, None] * (first.root_m - second.root_m))
    spaces = [blended_space(SQUID, poses.rotations, [1, 2]) for poses in (shown, second, first)]
    for found, target, begin in zip(*spaces, strict=True):
        gap = (target[0].inv() * begin[0]).as_rotvec()
        assert angles(found, target[0] * Rotation.from_rotvec(left[:, None] * gap)) == pytest.approx(0, abs=TURN)


def plain_transitions(body, desired, before, local, n_frames):
    """Transitions of all joints without feet, written with scipy's rotations joint by joint."""
    wanted, source = (blended_space(body, poses.rotations, local) for poses in (desired, before))
    shown = []
    for d, d_before in zip(wanted, source, strict=True):
        r, age, offset, rate = [d[0]], n_frames, np.zeros(3), np.zeros(3)
        for t in range(1, len(d)):
            if angles(d_before[t], d[t - 1]) > 1e-5:
                ahead = r[-1] * (r[max(t - 2, 0)].inv() * r[-1])
                offset = (d_before[t].inv() * r[-1]).as_rotvec()
                rate = (d[t].inv() * ahead).as_rotvec()
                length = np.linalg.norm(rate)
                rate = min(rate, rate * (length - 2 * np.pi) / length, key=lambda v, o=offset: np.linalg.norm(v - o))
                rate, age = rate - offset, 0
            age += 1
            s = min(age / n_frames, 1)
            left = offset * (1 - 10 * s**3 + 15 * s**4 - 6 * s**5)
            s = min(age / (SWING_S * 20), 1)
            left = left + SWING_S * 20 * rate * (s - 6 * s**3 + 8 * s**4 - 3 * s**5)
            r.append(d[t] * Rotation.from_rotvec(left))
        shown.append(Rotation.concatenate(r))
    return shown


@pytest.mark.parametrize("seed", range(4))
def test_transitions_are_those_written_with_scipy(seed):
    rng = np.random.default_rng(seed)
    desired, before = excerpts(rng, SQUID, n_segments=8, spread=(0.1, 0.3, 0.6, 1.0)[seed])
    shown = Transitions(SQUID, 20.0, 0.5, arms=()).steps(desired, before)
    expected = plain_transitions(SQUID, desired, before, [1, 2], 10)
    for found, plain in zip(blended_space(SQUID, shown.rotations, [1, 2]), expected, strict=True):
        assert angles(found, plain) == pytest.approx(0, abs=1e-7)


def test_transitions_have_no_jerks_and_end_in_the_recording():
    """A fast turn to the right is followed by one to the left."""
    speed, n_frames = 0.05, 60
    turn = speed * np.concatenate([np.arange(n_frames), n_frames - np.arange(1.0, n_frames + 1) - 10])
    vectors = np.zeros((2 * n_frames, len(STANDARD.joints), 3))
    names = ("head", "left_forearm")
    joints = [STANDARD.joints.index(name) for name in names]
    vectors[:, joints, 1] = turn[:, None]

    def poses(vectors):
        quaternions = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True)
        return Poses(np.zeros((len(vectors), 3)), quaternions.reshape(len(vectors), -1, 4))

    earlier = np.roll(vectors, 1, axis=0)
    earlier[0] = vectors[0]
    earlier[n_frames, joints, 1] = vectors[n_frames, joints, 1] + speed
    desired, before = poses(vectors), poses(earlier)
    largest = {}
    for stepper in (Transitions(STANDARD, 20.0), Blender(STANDARD)):
        shown = stepper.steps(desired, before)
        for joint, name in zip(joints, names, strict=True):
            angle = Rotation.from_quat(shown.rotations[:, joint], scalar_first=True).as_rotvec()[:, 1]
            largest[type(stepper).__name__, name] = np.abs(np.diff(angle, 2)).max()
            if isinstance(stepper, Transitions) and name == "head":
                assert angle[-1] == pytest.approx(turn[-1], abs=TURN)
    keep = np.exp(-1 / (ARM_CATCH_UP_S * 20.0))
    assert largest["Blender", "head"] == pytest.approx(2 * speed, abs=1e-9)
    assert largest["Transitions", "left_forearm"] < 1.01 * 2 * speed * max(keep, 1 - keep)
    # The largest second derivatives of the two polynomials are 3.95 and 5.78.
    assert largest["Transitions", "head"] < 3.95 * 2 * speed / (SWING_S * 20) + 5.78 * 10 * speed / 20**2


def test_all_joints_keep_the_motion_of_the_recording_after_a_transition_but_arms_keep_its_speed():
    rng = np.random.default_rng(11)
    desired, before = excerpts(rng, STANDARD, n_segments=2, longest=60)
    stepper = Transitions(STANDARD, 20.0, 0.25, feet=())
    shown = stepper.steps(desired, before)
    spaces = [blended_space(STANDARD, poses.rotations, HAND_JOINTS) for poses in (shown, desired)]
    join = 1 + np.flatnonzero(np.abs(before.root_m[1:] - desired.root_m[:-1]).max(axis=1) > 1e-9)[0]
    assert join + 5 < len(shown.root_m)
    for joint, (found, wanted) in enumerate(zip(*spaces, strict=True)):
        if STANDARD.joints[joint] not in ARMS:
            assert angles(found, wanted)[join + 5 :] == pytest.approx(0, abs=TURN)
    assert shown.root_m[join + 5 :] == pytest.approx(desired.root_m[join + 5 :])


@pytest.mark.parametrize("name", STEPPERS)
def test_the_first_frame_is_the_desired_one_and_starting_again_forgets(name):
    rng = np.random.default_rng(5)
    desired, before = excerpts(rng, STANDARD)
    one, other = STEPPERS[name](), STEPPERS[name]()
    first = one.steps(desired, before)
    assert np.array_equal(first.frames[0], desired.frames[0])
    assert np.array_equal(one.pose, first.frames[-1])
    other.start(*(part[3] for part in (desired.root_m, desired.rotations)))
    other.steps(desired, before)
    other.start(desired.root_m[0], desired.rotations[0])
    again = other.steps(desired.at(slice(1, None)), before.at(slice(1, None)))
    assert np.array_equal(again.frames, first.frames[1:])


@pytest.mark.parametrize("feet", [("left_hand", "tip"), ("left_finger",)])
def test_feet_below_joints_in_parent_space_are_refused(feet):
    with pytest.raises(ValueError, match="world space"):
        Blender(SQUID, feet=feet)


@pytest.mark.parametrize("name", STEPPERS)
def test_a_recording_that_is_followed_from_its_start_is_shown_as_it_is(name):
    poses = library.from_motion(motion(n_frames=60, walk_m=0.01, turn_deg=40))
    before = poses.at(np.maximum(np.arange(-1, 59), 0))
    shown = STEPPERS[name]().steps(poses, before)
    assert shown.root_m == pytest.approx(poses.root_m, abs=1e-12)
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
