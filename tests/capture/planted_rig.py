"""Small random rigs with ground truth, their observations of a point cloud, and errors relative to the truth."""

import numpy as np

from cospeech.capture.calibration import consensus
from cospeech.geometry.camera import Camera, look, project

SIZE = (1392, 1040)
N_CAMERAS = 5


def plant(seed, n_points=600, noise_px=0.3, outliers=0.05, missing=0.3):
    """Return cameras on a semicircle of radius 3 m, points (N, 3) and observations (C, N, 2)."""
    rng = np.random.default_rng([seed, 7])
    cameras = []
    for number, degrees in enumerate(np.linspace(-90, 90, N_CAMERAS) + rng.uniform(-6, 6, N_CAMERAS)):
        angle, away = np.radians(degrees), 3 + rng.uniform(-0.2, 0.2)
        place = [away * np.sin(angle), 2.0 + rng.uniform(-0.4, 0.4), away * np.cos(angle)]
        turn, shift = look(f"c{number + 1}", place, np.array([0, 1.1, 0]) + rng.uniform(-0.15, 0.15, 3))
        focal = 1450 * (1 + rng.uniform(-0.04, 0.04))
        centre = tuple((np.array(SIZE) - 1) / 2 + rng.normal(0, 8, 2))
        lens = (rng.uniform(-0.2, 0.05), rng.uniform(-0.05, 0.05), 0.0, 0.0, 0.0)
        cameras.append(Camera(f"c{number + 1}", SIZE, (focal, focal), centre, lens, turn, shift))
    points = rng.uniform([-1, 0.5, -1], [1, 1.7, 1], (n_points, 3))
    observations = np.array([project(camera, points) for camera in cameras])
    observations += rng.normal(0, noise_px, observations.shape)
    wrong = rng.random(observations.shape[:2]) < outliers
    observations[wrong] = rng.uniform(0, SIZE, (wrong.sum(), 2))
    outside = ((observations < -0.5) | (observations > np.array(SIZE) - 0.5)).any(axis=-1)
    observations[outside | (rng.random(outside.shape) < missing)] = np.nan
    return cameras, points, observations


def similarity(found, wanted):
    """Return scale, rotation (3, 3) and translation (3,) of the best fit of ``found`` (n, 3) to ``wanted``."""
    a, b = found - found.mean(axis=0), wanted - wanted.mean(axis=0)
    u, s, vt = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * signs) @ vt
    scale = (s * signs).sum() / (a**2).sum()
    return scale, rotation, wanted.mean(axis=0) - scale * rotation @ found.mean(axis=0)


def apart(cameras, truth, actor_m):
    """Return the mean relative focal length error, and the errors (n,) in metres of points in the actor's volume.

    The points are projected without noise by the true cameras and triangulated by the estimated ones, up to the
    best-fitting similarity.
    """
    focal = np.mean([abs(c.focal_px[0] / t.focal_px[0] - 1) for c, t in zip(cameras, truth, strict=True)])
    seen = np.array([project(camera, actor_m) for camera in truth])
    found, _ = consensus.triangulate(cameras, seen, 50.0)
    scale, rotation, shift = similarity(found, actor_m)
    return focal, np.linalg.norm(scale * found @ rotation.T + shift - actor_m, axis=1)
