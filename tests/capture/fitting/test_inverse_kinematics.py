"""Inverse kinematics compared with finite differences, scipy, and known motion with unknown marker positions."""

import numpy as np
import pytest
import subject
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cospeech.capture.accuracy import angle_between_deg, axial_error_deg, rms, rotation_error_deg
from cospeech.capture.fitting import body_model, skeleton_fit
from cospeech.capture.fitting import inverse_kinematics as ik
from cospeech.capture.fitting.observability import observability
from cospeech.data import tables
from cospeech.motion import markers, skeleton
from cospeech.motion.skeleton import JOINTS

N, P = len(ik.PART), len(body_model.NAMES)
NOISE_M = 0.0005 / np.sqrt(3)
"""Standard deviation per coordinate: half a millimetre in 3D."""


@pytest.fixture(scope="module")
def model():
    return body_model.body_model(subject.marked(subject.range_of_motion(), NOISE_M, 7), subject.FPS, subject.STATIC_S)


@pytest.fixture(scope="module")
def moved():
    return subject.performance(60.0)


@pytest.fixture(scope="module")
def poses(model, moved):
    return ik.solve(model, subject.marked(moved, NOISE_M, 8))


@pytest.fixture(scope="module")
def fitted(model, poses):
    return skeleton_fit.motion(model, poses, subject.FPS)


def residuals(model, turn, slide, seen):
    """Return the weighted residuals (M, 3), and the orientations and positions of the parts in the world."""
    turns, places = np.empty((P, 3, 3)), np.empty((P, 3))
    ik._place(turn, slide, model.offsets_m, body_model.PARENTS, body_model.KINDS, turns, places)
    residual = np.empty((len(markers.NAMES), 3))
    weight = 1.0 / body_model.TOLERANCES_M
    ik._residuals(turns, places, body_model.MARKER_PART, model.marker_places_m, weight, seen, residual)
    return residual, turns, places


def stepped(turn, slide, step):
    turn, slide = turn.copy(), slide.copy()
    ik._step(turn, slide, step, ik.PART, ik.AXIS, ik.SLIDES)
    return turn, slide


def test_the_jacobian_matches_finite_differences(model):
    rng = np.random.default_rng(0)
    turn, slide = stepped(np.tile(np.eye(3), (P, 1, 1)), model.offsets_m, rng.normal(0, 0.7, N))
    seen = rng.normal(0, 1, (len(markers.NAMES), 3))
    seen[4] = np.nan
    _, turns, places = residuals(model, turn, slide, seen)
    jacobian = np.empty((len(markers.NAMES), 3, N))
    ik._jacobian(
        turns, places, body_model.MARKER_PART, model.marker_places_m, 1.0 / body_model.TOLERANCES_M, seen,
        ik.PART, ik.AXIS, ik.SLIDES, ik.MOVES, jacobian,
    )  # fmt: skip
    for d in range(N):
        step = 1e-6 * np.eye(N)[d]
        ahead = residuals(model, *stepped(turn, slide, step), seen)[0]
        behind = residuals(model, *stepped(turn, slide, -step), seen)[0]
        np.testing.assert_allclose(jacobian[:, :, d], (ahead - behind) / 2e-6, atol=1e-5)


def test_a_frame_is_solved_as_by_scipy(model, moved):
    seen = subject.marked(moved, 0.002, 9)[400:401]
    found = ik.solve(model, seen)
    hold = 1.0 / (ik.PACE * ik.FIRST_FRAME_FACTOR)

    def cost(step):
        turn, slide = stepped(np.tile(np.eye(3), (P, 1, 1)), model.offsets_m, step)
        return np.append(residuals(model, turn, slide, seen[0])[0].ravel(), hold * step)

    best = least_squares(cost, np.zeros(N), method="lm", xtol=1e-12, ftol=1e-12)
    turn, slide = stepped(np.tile(np.eye(3), (P, 1, 1)), model.offsets_m, best.x)
    _, turns, places = residuals(model, turn, slide, seen[0])
    np.testing.assert_allclose(found.places_m[0], places, atol=1e-4)
    off = Rotation.from_matrix(np.swapaxes(found.turns[0], 1, 2) @ turns).magnitude()
    assert np.degrees(off).max() < 0.05


def test_all_angles_are_zero_in_the_static_pose(model):
    still = subject.range_of_motion()[: int(subject.STATIC_S * subject.FPS)]
    found = skeleton_fit.motion(model, ik.solve(model, subject.marked(still, 0.0)), subject.FPS)
    turn = [f"{side}_arm_y_deg" for side in ("left", "right")]  # determined only while the elbow is flexed
    assert found[skeleton.angle_columns()].drop(columns=turn).abs().to_numpy().max() < 0.3
    assert found[turn].abs().to_numpy().max() < 2
    assert np.abs(found[list(skeleton.ROOT_COLUMNS)].to_numpy()).max() < 0.0005


def test_known_motion_is_recovered_from_markers_at_unknown_places(model, moved, poses, fitted):
    true_turns, true_places = subject.chain(moved)
    turns, _ = subject.chain(fitted)
    clean = subject.marked(moved, 0.0)

    chest = JOINTS.index("chest")
    assert rms(rotation_error_deg(true_turns[:, chest], turns[:, chest])) <= 0.2
    for side in ("left", "right"):
        arm = JOINTS.index(f"{side}_arm")
        assert rms(angle_between_deg(true_turns[:, arm, :, 1], turns[:, arm, :, 1])) <= 0.3
        hand, forearm = markers.NAMES.index(f"{side}_hand"), body_model.NAMES.index(f"{side}_forearm")
        line = clean[:, hand] - true_places[:, JOINTS.index(f"{side}_forearm")]
        assert rms(angle_between_deg(line, poses.turns[:, forearm] @ model.marker_places_m[hand])) <= 0.3
        bent = moved[f"{side}_forearm_x_deg"] < -30
        assert bent.sum() > 300
        assert rms(axial_error_deg(true_turns[bent, arm], turns[bent, arm])) <= 1.5


def test_the_head_rotation_is_as_precise_as_three_noisy_markers_allow(moved, fitted):
    """No unbiased estimate is better than the Cramér-Rao bound; ours is within ten per cent of it."""
    index = JOINTS.index("head")
    off = rotation_error_deg(subject.chain(moved)[0][:, index], subject.chain(fitted)[0][:, index])
    arms = np.array([subject.PLACES_M[m.name] for m in markers.MARKERS if m.joint == "head"])
    arms = arms - arms.mean(axis=0)
    information = (arms**2).sum() * np.eye(3) - arms.T @ arms
    bound = NOISE_M * np.sqrt(np.trace(np.linalg.inv(information)))
    assert np.radians(rms(off)) < 1.1 * bound
    assert np.degrees(bound) < 0.27


def test_missing_markers_hold_the_pose_and_affect_nothing_else(model, moved, fitted):
    seen = subject.marked(moved, NOISE_M, 8)
    lost = {"left_hand": slice(100, 110), "back": slice(0, 400), "head_front": slice(300, 303)}
    for name, frames in lost.items():
        seen[frames, markers.NAMES.index(name)] = np.nan
    seen[600] = np.nan
    poses = ik.solve(model, seen)
    found = skeleton_fit.motion(model, poses, subject.FPS)
    tables.validate(found, "motion", "x")
    right = [f"right_{part}_{axis}_deg" for part in ("arm", "forearm") for axis in "xz"]
    difference = (found[right] - fitted[right]).abs()
    assert difference.drop(index=range(600, 602)).to_numpy().max() < 1.5
    np.testing.assert_allclose(poses.turns[600], poses.turns[599], atol=1e-9)
    assert np.isnan(poses.misfit_m[600])
    before = found.loc[99, "left_forearm_x_deg"]
    assert found.loc[100:109, "left_forearm_x_deg"].sub(before).abs().max() < 5


def test_locked_angles_are_zero_and_the_others_move(model, moved, fitted):
    seen = subject.marked(moved, NOISE_M, 8)
    seen[:300, markers.NAMES.index("right_hand")] = np.nan
    table = observability(model.marker_places_m, seen, fitted)
    tables.validate(table, "observability", "x")
    assert len(table) == 3 * len(JOINTS)
    assert (table.loc[table["joint"].str.endswith("arm"), "state"].value_counts()).to_dict() == {
        "measured": 6, "locked": 4, "flexion_dependent": 2,
    }  # fmt: skip
    for row in table.itertuples():
        spread = fitted[f"{row.joint}_{row.axis}_deg"].abs().max()
        assert spread < 1e-9 if row.state == "locked" else spread > 0.1
    share = table.set_index(["joint", "axis"])["share"]
    assert share["chest", "y"] == share["left_forearm", "x"] == share["right_arm", "x"] == 1
    assert share["right_forearm", "x"] == 0.75
    assert share["left_arm", "y"] == (fitted["left_forearm_x_deg"] < -30).mean()
    assert share["left_hand", "x"] == 0


def test_a_pose_does_not_depend_on_the_initial_pose(model, moved, poses):
    """A frame solved from the static pose equals the one solved within the record, if the elbows are flexed."""
    seen = subject.marked(moved, NOISE_M, 8)
    bent = moved[["left_forearm_x_deg", "right_forearm_x_deg"]].max(axis=1) < -15
    frames = np.flatnonzero(bent)[::40]
    assert len(frames) > 15
    for frame in frames:
        alone = ik.solve(model, seen[frame : frame + 1])
        off = Rotation.from_matrix(np.swapaxes(alone.turns[0], 1, 2) @ poses.turns[frame]).magnitude()
        assert np.degrees(off).max() < 1.5


def test_an_arm_bent_backward_is_flipped(model):
    """A straight arm may drift by half a turn about its axis; once flexed, it must bend the natural way."""
    turn = np.tile(np.eye(3), (P, 1, 1))
    elbow = body_model.NAMES.index("left_forearm")
    turn[elbow] = Rotation.from_euler("x", 40, degrees=True).as_matrix()
    before = turn.copy()
    assert ik._flip_backward_elbows(turn, ik.ELBOWS, body_model.PARENTS)
    arm = body_model.PARENTS[elbow]
    down = np.array([0.0, -1.0, 0.0])
    np.testing.assert_allclose(turn[arm] @ down, before[arm] @ down, atol=1e-12)
    np.testing.assert_allclose(turn[arm] @ turn[elbow] @ down, before[arm] @ before[elbow] @ down, atol=1e-12)
    assert not ik._flip_backward_elbows(turn, ik.ELBOWS, body_model.PARENTS)
