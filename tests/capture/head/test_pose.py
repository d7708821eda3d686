"""The fit of a pose against scipy, and the consensus against planted outliers."""

import numpy as np
import planted_head
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cospeech.capture.head import optics
from cospeech.capture.head.pose import DISPARITY_WEIGHT, STILL, Pose, RigidFit, consensus, fit_in_space

OPTICS, _ = optics.rectified(planted_head.cameras(640))


def face(draw, n=60):
    return draw.normal(0, 1, (n, 3)) * (0.04, 0.05, 0.02) - (0, 0, 0.7)


def planted(draw, degrees=20):
    turn = Rotation.from_rotvec(np.radians(degrees) * draw.normal(size=3) / np.sqrt(3)).as_matrix()
    middle = np.array([0.0, 0.0, -0.7])
    return Pose(turn, middle - turn @ middle + draw.normal(0, 0.01, 3))


def seen(points, pose, own=OPTICS):
    moved = pose.points(points)
    return np.column_stack([own.pixels(moved), own.disparities(-moved[:, 2])])


@pytest.mark.parametrize("seed", range(5))
def test_the_fit_is_the_least_squares_solution_of_scipy(seed):
    draw = np.random.default_rng(seed)
    points, true = face(draw), planted(draw)
    observed = seen(points, true) + draw.normal(0, (0.2, 0.2, 0.4), (60, 3))
    observed[::4, 2] = np.nan

    def off(unknown):
        pose = Pose(Rotation.from_rotvec(unknown[:3]).as_matrix(), unknown[3:])
        differences = (seen(points, pose) - observed) * (1, 1, DISPARITY_WEIGHT)
        return differences[np.isfinite(differences)]

    best = least_squares(off, np.concatenate([Rotation.from_matrix(true.rotation).as_rotvec(), true.shift_m]))
    found, agreeing = consensus(points, observed, OPTICS.numbers, STILL, 100.0)
    assert agreeing.all()
    np.testing.assert_allclose(
        off(best.x) @ off(best.x),
        off(np.concatenate([Rotation.from_matrix(found.rotation).as_rotvec(), found.shift_m]))
        @ off(np.concatenate([Rotation.from_matrix(found.rotation).as_rotvec(), found.shift_m])),
        rtol=1e-6,
    )
    np.testing.assert_allclose(found.rotation, Rotation.from_rotvec(best.x[:3]).as_matrix(), atol=2e-5)


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_the_consensus_leaves_out_points_that_move_on_their_own(seed, single):
    """Two fifths of the points, those of a hand, go elsewhere together."""
    draw = np.random.default_rng(seed)
    points, true = face(draw), planted(draw)
    observed = seen(points, true) + draw.normal(0, 0.1, (60, 3))
    hand = np.arange(60) < 24
    observed[hand, :2] += draw.normal((25, 10), 1)
    own = optics.Optics(OPTICS.size_px, OPTICS.focal_px, OPTICS.centre_px) if single else OPTICS
    if single:
        observed[:, 2] = np.nan
    found, agreeing = consensus(points, observed, own.numbers, STILL, 1.0)
    assert (agreeing == ~hand).all()
    off = np.degrees(Rotation.from_matrix(found.rotation @ true.rotation.T).magnitude())
    assert off < (0.5 if single else 0.2)


def test_the_fits_in_space_agree():
    draw = np.random.default_rng(0)
    points, true = face(draw), planted(draw)
    noisy = true.points(points) + draw.normal(0, 0.002, points.shape)
    poses = [fit_in_space(points, noisy, one) for one in (RigidFit.SVD, RigidFit.NEWTON, RigidFit.NEWTON_PRINTED)]
    for pose in poses[1:]:
        np.testing.assert_allclose(pose.rotation, poses[0].rotation, atol=1e-9)
        np.testing.assert_allclose(pose.shift_m, poses[0].shift_m, atol=1e-9)


def test_the_printed_translation_is_not_used():
    """t = m_k - m_kr (B.2) would put a head that turns by 10 degrees at 1 m off by 174 mm."""
    points = face(np.random.default_rng(1)) - (0, 0, 0.3)
    true = Pose(Rotation.from_euler("y", 10, degrees=True).as_matrix(), np.zeros(3))
    moved = true.points(points)
    np.testing.assert_allclose(fit_in_space(points, moved, RigidFit.SVD).shift_m, 0.0, atol=1e-12)
    assert np.linalg.norm(moved.mean(axis=0) - points.mean(axis=0)) == pytest.approx(0.174, abs=0.003)


def test_poses_compose_as_motions():
    draw = np.random.default_rng(2)
    first, second, points = planted(draw), planted(draw), face(draw)
    np.testing.assert_allclose(second.after(first).points(points), second.points(first.points(points)), atol=1e-12)
