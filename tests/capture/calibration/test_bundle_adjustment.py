"""Bundle adjustment: derivatives compared with finite differences, the solution with scipy, the effect of priors."""

from dataclasses import replace

import numpy as np
import pytest
from planted_rig import plant
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cospeech.capture.calibration import bundle_adjustment
from cospeech.geometry.camera import Camera, project

CAMERA = Camera("c1", (1392, 1040), (1450.0, 1440.0), (700.0, 515.0), (-0.2, 0.07, 0.002, -0.003, 0.01),
                (0.3, -0.5, 0.2), (0.1, -0.2, 2.9))  # fmt: skip


def observed(inner, rotation, shift, point):
    pixel, by_camera, by_point = np.empty(2), np.empty((2, 15)), np.empty((2, 3))
    assert bundle_adjustment.observe(inner, rotation, shift, point, pixel, by_camera, by_point)
    return pixel, by_camera, by_point


def test_a_point_is_seen_where_the_camera_projects_it():
    rig, point = bundle_adjustment.from_cameras([CAMERA]), np.array([0.4, -0.3, 0.5])
    pixel, _, _ = observed(rig.inner[0], rig.rotations[0], rig.shifts[0], point)
    np.testing.assert_allclose(pixel, project(CAMERA, point), atol=1e-9)
    np.testing.assert_allclose(project(bundle_adjustment.to_cameras(rig, [CAMERA])[0], point), pixel, atol=1e-9)


@pytest.mark.parametrize("number", range(bundle_adjustment.N_ALL + 3))
def test_derivatives_match_finite_differences(number):
    rig, point = bundle_adjustment.from_cameras([CAMERA]), np.array([0.4, -0.3, 0.5])
    step = 1e-6 * (1000.0 if number in (0, 2, 3) else 1.0)

    def at(sign):
        change = np.zeros(bundle_adjustment.N_ALL + 3)
        change[number] = sign * step
        turn = Rotation.from_rotvec(change[9:12]).as_matrix()
        return observed(
            rig.inner[0] + change[:9], turn @ rig.rotations[0], rig.shifts[0] + change[12:15], point + change[15:]
        )[0]

    _, by_camera, by_point = observed(rig.inner[0], rig.rotations[0], rig.shifts[0], point)
    np.testing.assert_allclose(
        np.column_stack([by_camera, by_point])[:, number], (at(1) - at(-1)) / (2 * step), rtol=1e-6, atol=1e-5
    )


def test_a_point_behind_the_camera_is_not_seen():
    rig = bundle_adjustment.from_cameras([CAMERA])
    behind = CAMERA.place_m - CAMERA.rotation[2]
    empty = np.empty(2), np.empty((2, 15)), np.empty((2, 3))
    assert not bundle_adjustment.observe(rig.inner[0], rig.rotations[0], rig.shifts[0], behind, *empty)


def test_the_poses_of_a_rigid_body_are_estimated_with_the_cameras():
    """Noise-free views of the four corners of a plate: the truth is recovered, up to a common rigid motion."""
    truth, centres, _ = plant(3, n_points=12)
    rng = np.random.default_rng(1)
    plate = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0.3, 0.2, 0]])
    turns = Rotation.from_rotvec(rng.normal(0, 0.5, (12, 3))).as_matrix()
    places = np.einsum("tij,kj->tki", turns, plate) + centres[:, None]
    observations = np.array([project(camera, places) for camera in truth])
    used = ~np.isnan(observations[..., 0])
    used[1, 4] = used[:, 7] = False
    start = np.concatenate(
        [Rotation.from_rotvec(rng.normal(0, 0.05, (12, 3))).as_matrix() @ turns, centres[:, :, None] + 0.03], axis=2
    )
    moved = [replace(camera, shift_m=tuple(np.array(camera.shift_m) + rng.normal(0, 0.02, 3))) for camera in truth]
    rig, poses = bundle_adjustment.adjust_bodies(
        bundle_adjustment.from_cameras(moved), start, plate, observations, used, free=()
    )
    found = np.einsum("tij,kj->tki", poses[:, :, :3], plate) + poses[:, None, :, 3]
    assert np.isnan(poses[7]).all()
    for i, camera in enumerate(bundle_adjustment.to_cameras(rig, truth)):
        np.testing.assert_allclose(project(camera, found)[used[i]], observations[i][used[i]], atol=1e-4)
    apart = np.linalg.norm(found[0] - found[5], axis=1)
    np.testing.assert_allclose(apart, np.linalg.norm(places[0] - places[5], axis=1), atol=1e-6)


def small():
    truth, points, observations = plant(3, n_points=24, outliers=0.0)
    used = ~np.isnan(observations[..., 0])
    used &= used.sum(axis=0) >= 2
    rng = np.random.default_rng(0)
    cameras = [replace(c, focal_px=(f := 1.02 * c.focal_px[0], f), lens=(0.0,) * 5) for c in truth]
    start = bundle_adjustment.from_cameras(cameras)
    return start, points + rng.normal(0, 0.02, points.shape), observations, used


def test_scipy_does_not_improve_the_solution():
    start, points, observations, used = small()
    rig, places = bundle_adjustment.adjust(start, points, observations, used, iterations=200)
    seen = used.any(axis=0)
    inside = [bundle_adjustment.INNER.index(name) for name in bundle_adjustment.SELF]
    like = [replace(CAMERA, name=f"c{k}") for k in range(5)]

    def misses(x):
        cameras = x[:55].reshape(5, 11)
        inner = rig.inner.copy()
        inner[:, inside] += cameras[:, :5] * [1000, 100, 100, 1, 1]
        turned = Rotation.from_rotvec(cameras[:, 5:8]).as_matrix() @ rig.rotations
        moved = bundle_adjustment.to_cameras(bundle_adjustment.Rig(inner, turned, rig.shifts + cameras[:, 8:]), like)
        there = places[seen] + x[55:].reshape(-1, 3)
        return (np.array([project(camera, there) for camera in moved]) - observations[:, seen])[used[:, seen]].ravel()

    x = np.zeros(55 + 3 * seen.sum())
    cost = (misses(x) ** 2).sum()
    assert cost == pytest.approx(
        np.nansum(bundle_adjustment.residuals(rig, places, observations)[used] ** 2), rel=1e-9
    )
    second = least_squares(misses, x, method="trf", x_scale="jac", max_nfev=8)
    assert 2 * second.cost > (1 - 1e-5) * cost


def test_a_parameter_that_is_not_free_does_not_change():
    start, points, observations, used = small()
    rig, _ = bundle_adjustment.adjust(start, points, observations, used, free=("focal",))
    np.testing.assert_array_equal(rig.inner[:, 1:], start.inner[:, 1:])
    assert (rig.inner[:, 0] != start.inner[:, 0]).all()


def test_a_strong_prior_holds_its_value():
    start, points, observations, used = small()
    weights = np.zeros_like(start.inner)
    weights[:, 2:4] = 1e6
    rig, _ = bundle_adjustment.adjust(start, points, observations, used, prior=(start.inner + 5.0, weights))
    np.testing.assert_allclose(rig.inner[:, 2:4], start.inner[:, 2:4] + 5.0, atol=0.05)


@pytest.mark.parametrize(("weight", "share"), [(1e-2, 0.02), (1e3, 0.999)])
def test_a_prior_pulls_the_best_fit_away_from_its_optimum(weight, share):
    """Every step towards the prior raises the reprojection error, so it must be part of the cost."""
    start, points, observations, used = small()
    best, places = bundle_adjustment.adjust(start, points, observations, used, iterations=200)
    weights = np.zeros_like(best.inner)
    weights[:, 0] = weight
    value = best.inner + 10.0

    def cost(rig, places):
        fit = np.nansum(bundle_adjustment.residuals(rig, places, observations)[used] ** 2)
        return fit + (weights * (rig.inner - value) ** 2).sum()

    rig, moved = bundle_adjustment.adjust(best, places, observations, used, prior=(value, weights), iterations=200)
    assert cost(rig, moved) < 0.999 * cost(best, places)
    assert (rig.inner[:, 0] - best.inner[:, 0] > 10.0 * share).all()
    again, still = bundle_adjustment.adjust(rig, moved, observations, used, prior=(value, weights), iterations=200)
    assert cost(again, still) == pytest.approx(cost(rig, moved), rel=1e-6)  # it is the optimum of the whole cost
