"""Triangulation against scipy, brute force, and the points of another program from real video."""

import itertools

import numpy as np
import pytest
from scipy.optimize import least_squares

from cospeech.geometry.camera import Camera, look, project
from cospeech.geometry.triangulate import triangulate


def rig(n=5):
    cameras = []
    for k in range(n):
        angle = np.radians(-80 + 160 * k / (n - 1))
        turn, shift = look(f"c{k + 1}", [3 * np.sin(angle), 2.0, 3 * np.cos(angle)], [0, 1, 0])
        lens = (-0.1, 0.03, 1e-3, -5e-4, 0.0)
        cameras.append(Camera(f"c{k + 1}", (1392, 1040), (1400, 1395), (700, 515), lens, turn, shift))
    return cameras


def seen(cameras, points, noise, seed):
    pixels = np.stack([project(camera, points) for camera in cameras], axis=1)
    return pixels + np.random.default_rng(seed).normal(0, noise, pixels.shape)


def test_exact_points_come_back():
    cameras = rig()
    points = np.random.default_rng(0).uniform([-0.7, 0, -0.5], [0.7, 1.9, 0.5], (50, 3))
    found, used, residual = triangulate(cameras, seen(cameras, points, 0, 1), limit_px=1)
    np.testing.assert_allclose(found, points, atol=1e-9)
    assert used.all()
    assert residual.max() < 1e-6


def test_two_to_five_noisy_weighted_views_agree_with_scipy():
    cameras, rng = rig(), np.random.default_rng(2)
    points = rng.uniform([-0.7, 0, -0.5], [0.7, 1.9, 0.5], (12, 3))
    pixels = seen(cameras, points, 0.5, 3)
    weights = rng.uniform(0.2, 2, (12, 5))
    for index, hidden in enumerate([(), (0,), (1, 2), (0, 2, 4)] * 3):
        pixels[index, list(hidden)] = np.nan
    found, _, _ = triangulate(cameras, pixels, 50, weights)
    for index in range(12):
        there = np.isfinite(pixels[index, :, 0])

        def misses(point, index=index, there=there):
            miss = np.stack([project(c, point) for c in cameras])[there] - pixels[index, there]
            return (miss * np.sqrt(weights[index, there])[:, None]).ravel()

        best = least_squares(misses, points[index], xtol=1e-14, ftol=1e-14, gtol=1e-14).x
        np.testing.assert_allclose(found[index], best, atol=1e-7)


def test_the_limit_applies_to_the_worst_view_and_not_to_the_mean():
    cameras, point = rig(), np.array([[0.2, 1.1, 0.1]])
    pixels = seen(cameras, point, 0, 1)
    pixels[0, 2] += (0.0, 8.0)
    whole, used, rms = triangulate(cameras, pixels, limit_px=100)
    worst = max(np.linalg.norm(project(c, whole[0]) - pixels[0, k]) for k, c in enumerate(cameras))
    assert used.all()
    assert worst > 1.3 * rms[0]
    found, used, _ = triangulate(cameras, pixels, limit_px=(rms[0] + worst) / 2)
    assert used[0].tolist() == [True, True, False, True, True]
    np.testing.assert_allclose(found, point, atol=1e-9)


def test_outlier_views_are_left_out_as_brute_force_would():
    cameras, rng = rig(), np.random.default_rng(4)
    points = rng.uniform([-0.7, 0, -0.5], [0.7, 1.9, 0.5], (30, 3))
    pixels = seen(cameras, points, 0.3, 5)
    for index in range(30):
        for view in rng.choice(5, index % 4, replace=False):
            pixels[index, view] += rng.uniform(20, 60, 2)
    found, used, residual = triangulate(cameras, pixels, 2)
    for index in range(30):
        fits = []
        for size in (5, 4, 3, 2):
            for subset in itertools.combinations(range(5), size):
                some = [cameras[view] for view in subset]
                point, whole, rms = triangulate(some, pixels[index : index + 1, list(subset)], 2)
                if whole.all():
                    fits.append((-size, rms[0], subset, point[0]))
        _, rms, subset, point = min(fits, key=lambda fit: fit[:2])
        assert tuple(np.flatnonzero(used[index])) == subset
        np.testing.assert_allclose(found[index], point, atol=1e-9)
        assert residual[index] == pytest.approx(rms, abs=1e-9)
        if index % 4 < 3:
            assert np.linalg.norm(found[index] - points[index]) < 2e-3


def test_one_view_or_contradicting_views_give_no_point():
    cameras = rig()
    pixels = seen(cameras, np.array([[0, 1, 0.0], [0.1, 1, 0]]), 0, 0)
    pixels[0, 1:] = np.nan
    pixels[1, 2:] = np.nan
    pixels[1, 1, 1] += 100
    found, used, residual = triangulate(cameras, pixels, 2)
    assert np.isnan(found).all()
    assert not used.any()
    assert np.isnan(residual).all()
