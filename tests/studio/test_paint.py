"""Ray casting of capsules compared with ray marching, and visible pixels of markers with a fine grid of rays."""

import numba
import numpy as np
import pytest

from cospeech.motion import skeleton
from cospeech.motion.markers import RADIUS_M
from cospeech.studio import dress, film, paint, rig, stage

WIDTH_PX = 116


def distance(points, a, b, radius):
    """Return the distance of points (..., 3) from a capsule."""
    along = b - a
    share = np.clip(((points - a) @ along) / max(along @ along, 1e-12), 0.0, 1.0)
    return np.linalg.norm(points - a - share[..., None] * along, axis=-1) - radius


def march(rays, ends, radii):
    """Return depth (n,) and index (n,) of the first solid on each of ``rays`` (n, 3), by ray marching."""
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    gone = np.zeros(len(rays))
    for _ in range(150):
        far = np.array([distance(unit * gone[:, None], *end, r) for end, r in zip(ends, radii, strict=True)])
        gone += np.where(gone < 20.0, far.min(axis=0), 0.0)
    return np.where(gone < 20.0, gone * unit[:, 2], np.inf), far.argmin(axis=0)


@pytest.fixture(scope="module")
def scene():
    angles = np.zeros((1, len(skeleton.JOINTS), 3))
    angles[0, skeleton.JOINTS.index("left_arm")] = (-50.0, 10.0, 10.0)
    angles[0, skeleton.JOINTS.index("left_forearm")] = (-70.0, 0.0, 0.0)
    angles[0, skeleton.JOINTS.index("right_arm")] = (-30.0, -20.0, -25.0)
    motion = skeleton.motion_table(np.zeros((1, 3)), angles, rig.FPS)
    return stage.limbs(motion)[0], dress.wear(motion, dress.places("ada", 1))[0]


def drawn(camera, limbs, markers, widened=1.0):
    ends = np.concatenate([limbs, np.repeat(markers[:, None], 2, axis=1)])
    radii = np.concatenate([stage.RADII_M, np.full(len(markers), RADIUS_M)])
    seen_from = ends @ camera.rotation.T + np.array(camera.shift_m)
    slopes = stage.ray_slopes(camera)
    room = stage.room(camera, slopes)
    picture, depth = np.empty_like(room), np.empty_like(room[0])
    whole = np.array([0, 0, *camera.size_px])
    pixels, reach = film.outlines(camera, ends, radii)
    solids = paint.solids(seen_from, radii)
    shown = paint.draw(picture, depth, room, slopes, solids, pixels, widened * reach, stage.PAINT, len(limbs), whole)
    rays = np.stack([*slopes, np.ones_like(room[0])], axis=-1).reshape(-1, 3).astype(float)
    return shown, depth, rays, seen_from, radii


@pytest.mark.parametrize("view", range(5))
def test_depth_of_limbs_matches_ray_marching(view, scene):
    limbs, markers = scene
    _, depth, rays, ends, radii = drawn(rig.cameras(WIDTH_PX, 3)[view], limbs, markers)
    found, _ = march(rays, ends[: len(limbs)], radii[: len(limbs)])
    hit = np.isfinite(found)
    assert hit.sum() > 400
    # For rays that graze a limb, rounding decides whether they hit.
    assert (np.isfinite(depth.ravel()) != hit).mean() < 1e-3
    both = hit & np.isfinite(depth.ravel())
    error = np.abs(found[both] - depth.ravel()[both])
    assert np.quantile(error, 0.99) < 1e-4
    assert np.median(error) < 1e-6


@pytest.mark.parametrize("view", range(5))
def test_no_part_of_a_solid_lies_outside_its_outline(view, scene):
    camera = rig.cameras(696, 3)[view]
    shown, depth, *_ = drawn(camera, *scene)
    with_room, deep, *_ = drawn(camera, *scene, widened=2.0)
    assert np.isfinite(depth).sum() > 15_000
    assert np.array_equal(depth, deep)
    assert np.array_equal(shown, with_room)


@numba.njit
def nearest(rays, solid):
    """Return the index of the first solid on each of ``rays`` (n, 2), or -1, by brute force."""
    owner = np.full(len(rays), -1)
    for i in range(len(rays)):
        depth = np.inf
        for k in range(len(solid)):
            z, _ = paint.intersect(rays[i, 0], rays[i, 1], paint.unpack(solid, k))
            if z < depth:
                depth, owner[i] = z, k
    return owner


@pytest.mark.parametrize("view", range(5))
def test_visible_pixels_of_markers_match_a_fine_grid_of_rays(view, scene):
    limbs, markers = scene
    camera, fine = rig.cameras(WIDTH_PX, 3)[view], 8
    shown, _, _, ends, radii = drawn(camera, limbs, markers)
    steps = ((np.arange(fine, dtype=np.float32) + 0.5) / fine - 0.5) / 2
    grid = np.moveaxis(stage.ray_slopes(camera), 0, -1)
    right, down = np.gradient(grid, axis=1) * 2, np.gradient(grid, axis=0) * 2
    rays = np.concatenate([(grid + u * right + v * down).reshape(-1, 2) for u in steps for v in steps])
    owner = nearest(rays, paint.solids(ends, radii)) - len(limbs)
    expected = np.bincount(owner[owner >= 0], minlength=len(markers)) / fine**2
    assert (expected > 0.5).sum() >= 8
    assert np.abs(shown - expected).max() < 0.35
    assert np.abs(shown - expected).mean() < 0.1
