"""The talking head: what it draws compared with OpenCV's projection, the disparity of its pixels, and a detector."""

from dataclasses import replace

import cv2
import dlib
import numpy as np
import pytest

from cospeech.geometry import rotation
from cospeech.geometry.camera import project
from cospeech.studio import complexion, face, film, mannequin, raster, stereo, take

SEED = 2012


@pytest.fixture(scope="module")
def looks():
    return face.appearance("ada", SEED)


@pytest.fixture(scope="module")
def pair():
    return stereo.cameras()


def turned(*angles_deg):
    angles = np.array(angles_deg, dtype=float)
    return face.Acting(angles, face.pivoted(angles), np.zeros(len(angles)), np.zeros(len(angles)))


def drawn(looks, camera, angles_deg, shift_m):
    """Draw the mesh with its places in the world as a texture of its own, and return those places (H, W, 3)."""
    mesh = looks.mesh
    turn = rotation.from_euler("XYZ", np.array(angles_deg, dtype=float)).astype(np.float32)
    seen = np.empty((len(mesh.places_m), 4), np.float32)
    whole = [values.astype(np.float32) for values in (mesh.places_m, mesh.normals, mesh.follows, mesh.jaw_m)]
    sun = np.array([0.0, 0.0, 1.0], np.float32)
    raster.pose(*whole, np.float32(0.0), turn, np.float32(shift_m), sun, np.float32(1.0), seen)
    width, height = camera.size_px
    picture, depth = np.zeros((3, height, width), np.float32), np.zeros((height, width), np.float32)
    raster.draw(
        seen, mesh.texels.astype(np.float32), mesh.triangles, looks.texture.open,
        np.float32(camera.focal_px), np.float32(camera.centre_px), camera.rotation.astype(np.float32),
        np.float32(camera.shift_m), picture, depth,
    )  # fmt: skip
    return seen, picture, depth


def first_hits(corners, rays):
    """Return the distance along each of ``rays`` (n, 3) from the origin to the nearest triangle, (n,), inf for none.

    ``corners`` (F, 3, 3) are triangles; those seen from behind do not count (Möller and Trumbore 1997).
    """
    a, one, other = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    hits = []
    for ray in rays:
        across = np.cross(ray, other)
        determinant = (one * across).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = -(a * across).sum(axis=1) / determinant
            turned = np.cross(-a, one)
            v = turned @ ray / determinant
            along = (other * turned).sum(axis=1) / determinant
            hit = (determinant > 1e-12) & (u >= 0) & (v >= 0) & (u + v <= 1) & (along > 0)
        hits.append(along[hit].min(initial=np.inf))
    return np.array(hits)


def test_the_depth_of_each_pixel_is_that_of_the_first_triangle_on_its_ray(looks, pair):
    seen, _, depth = drawn(looks, pair[0], (10.0, -20.0, 5.0), (0.01, -0.005, 0.02))
    points = seen[:, :3].astype(float) @ pair[0].rotation.T + np.array(pair[0].shift_m)
    rng = np.random.default_rng(1)
    row, column = rng.integers(20, 480, 400), rng.integers(200, 560, 400)
    rays = np.column_stack([column, row, np.ones(400)]) @ np.linalg.inv(pair[0].intrinsic).T
    expected = first_hits(points[looks.mesh.triangles], rays)
    with np.errstate(divide="ignore"):
        found = 1.0 / depth[row, column]
    edges = np.isinf(found) != np.isinf(expected)  # rounding decides about a ray through the very outline
    assert edges.mean() < 0.01
    both = np.isfinite(found) & np.isfinite(expected)
    assert both.sum() > 100
    assert np.quantile(np.abs(found[both] - expected[both]), 0.98) < 1e-4


def test_vertices_are_drawn_where_opencv_projects_them(looks, pair):
    """The nearest vertex of each small area of the image lies at the depth that was drawn in its pixel."""
    for camera in pair:
        seen, _, depth = drawn(looks, camera, (10.0, -20.0, 5.0), (0.01, -0.005, 0.02))
        points = np.ascontiguousarray(seen[:, :3], dtype=float)
        pixels = cv2.projectPoints(points, np.array(camera.turn), np.array(camera.shift_m), camera.intrinsic, None)[0]
        ahead = points @ camera.rotation[2] + camera.shift_m[2]
        normal = looks.mesh.normals[:, 2] > 0.8  # well within the outline, and seen
        column, row = np.rint(pixels[:, 0]).astype(int).T
        face_ = normal & (looks.mesh.follows == 1.0) & (np.abs(looks.mesh.places_m[:, 0]) < 0.05)
        gap_m = 1.0 / depth[row[face_], column[face_]] - ahead[face_]
        assert face_.sum() > 500
        assert np.median(np.abs(gap_m)) < 5e-4


def test_disparity_is_focal_length_times_baseline_over_depth(looks, pair):
    """Patches of the left image are found in the right one at the disparity of the depth that was drawn."""
    _, _, depth = drawn(looks, pair[0], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    left, right = (views[0, 0] for views in face.render(turned((0.0, 0.0, 0.0)), looks, pair, noise=0.5, seed=1))
    errors = []
    for row in range(170, 330, 10):
        for column in np.flatnonzero(depth[row] > 1.0 / 0.69)[::10]:
            block = left[row - 5 : row + 6, column - 5 : column + 6]
            expected = stereo.FOCAL_PX * stereo.BASELINE_M * depth[row, column]
            start = int(column - expected) - 20
            strip = right[row - 5 : row + 6, start : start + 40]
            match = cv2.matchTemplate(strip, block, cv2.TM_CCOEFF_NORMED)[0]
            best = int(match.argmax())
            if match[best] < 0.9 or best in (0, len(match) - 1):
                continue
            before, at, after = match[best - 1 : best + 2]
            place = start + 5 + best + 0.5 * (before - after) / (before - 2 * at + after)
            errors.append(column - place - expected)
    assert len(errors) > 100
    assert np.median(np.abs(errors)) < 0.25
    assert abs(np.median(errors)) < 0.1


@pytest.mark.parametrize("person", ["ada", "deniz"])
def test_the_frontal_face_detector_of_dlib_accepts_it(person, pair):
    """One face, in the place of the face, up to 20 degrees of turn, and with shut eyes or an open mouth."""
    acting = turned((0, 0, 0), (0, 20, 0), (0, -20, 0), (12, 0, 0), (-12, 0, 0), (0, 0, 12), (0, 0, -12), (0, 0, 0))
    acting.blink[-1], acting.mouth[-1] = 1.0, 1.0
    views = face.render(acting, face.appearance(person, SEED), pair[:1])[0]
    find = dlib.get_frontal_face_detector()
    for planes in views:
        (box,) = find(planes[0])
        assert abs(box.center().x - 375) < 90
        assert 140 < box.width() < 240


def test_the_same_seed_gives_the_same_bytes_and_another_one_other_noise(looks, pair):
    acting = turned((0, 10, 0), (5, 0, 0))
    first, again, other = (face.render(acting, looks, pair, seed=seed) for seed in (1, 1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0], other[0])
    assert np.abs(first[0].astype(int) - other[0]).max() < 20


def test_the_noise_is_that_of_the_sensor(looks, pair):
    (views,) = face.render(face.still(12), looks, pair[:1], noise=2.0, seed=3)
    assert views[:, 0].std(axis=0, ddof=1).mean() == pytest.approx(np.sqrt(2.0**2 + 1 / 12), rel=0.05)


def test_an_open_mouth_lowers_the_chin_and_shows_its_inside(looks, pair):
    mesh = looks.mesh
    moved = np.linalg.norm(mesh.jaw_m, axis=1)
    x, y, z = mesh.places_m.T
    assert np.all(moved[(y > mannequin.MOUTH_M + 0.001) & (np.abs(x) < 0.015)] < 1e-9)
    assert mesh.jaw_m[(y < -0.095) & (y > -0.11) & (np.abs(x) < 0.01) & (z > 0.07), 1].max() < -0.008
    acting = face.still(2)
    acting.mouth[1] = 1.0
    (views,) = face.render(acting, looks, pair[:1], noise=0.0)
    dark = (views[:, 0, 240:330, 330:420] < 45).sum(axis=(1, 2))
    assert dark[1] > dark[0] + 150


def test_shut_eyes_hide_their_whites(looks, pair):
    acting = face.still(2)
    acting.blink[1] = 1.0
    (views,) = face.render(acting, looks, pair[:1], noise=0.0)
    region = np.abs(views[1].astype(int) - views[0]).max(axis=0)
    rows = np.nonzero(region > 8)[0]
    assert len(rows) > 100
    assert rows.max() - rows.min() < 40  # nothing but the eyes


def test_blinks_are_steps_of_one_region(looks):
    texture = looks.texture
    row, column = texture.corner
    height, width = texture.eyes.shape[1:3]
    assert len(texture.eyes) == complexion.BLINKS + 1
    assert np.array_equal(texture.open[row : row + height, column : column + width], texture.eyes[0])


def test_a_stereo_film_has_the_frames_of_both_cameras_and_is_the_same_again(looks, pair, tmp_path):
    acting = turned((0, 0, 0), (3, 10, 0), (6, 20, 2))
    made = []
    for name in ("once", "again"):
        paths = [tmp_path / name / f"{camera.name}.mkv" for camera in pair]
        take.shoot_head(acting, looks, pair, paths, stereo.FPS, 5)
        made.append([path.read_bytes() for path in paths])
    assert made[0] == made[1]
    for path, views in zip(paths, face.render(acting, looks, pair, seed=5), strict=True):
        for found, expected in zip(film.decode(path), views, strict=True):
            away = found.astype(int) - expected
            assert np.abs(away[0]).mean() < 2.0


def test_the_stereo_camera_is_rectified(pair):
    left, right = pair
    assert np.array_equal(left.rotation, right.rotation)
    assert (left.focal_px, left.centre_px, left.size_px) == (right.focal_px, right.centre_px, right.size_px)
    assert right.place_m - left.place_m == pytest.approx([stereo.BASELINE_M, 0.0, 0.0])
    assert left.rotation == pytest.approx(np.diag([1.0, -1.0, -1.0]))
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (20, 3))
    one, other = (project(camera, points) for camera in pair)
    depth = stereo.DISTANCE_M - points[:, 2]
    assert (one - other)[:, 0] == pytest.approx(stereo.FOCAL_PX * stereo.BASELINE_M / depth)
    assert one[:, 1] == pytest.approx(other[:, 1])


def test_a_camera_of_another_size_sees_the_same():
    """The centre of the image and all angles stay where they are."""
    points = np.random.default_rng(2).uniform(-0.1, 0.1, (20, 3))
    for small, large in zip(stereo.cameras(320), stereo.cameras(1280), strict=True):
        assert (project(small, points) + 0.5) * 4.0 == pytest.approx(project(large, points) + 0.5)


def test_a_hand_hides_what_is_behind_it_and_nothing_else(looks, pair):
    place = np.array([0.02, -0.05, 0.16])
    acting = replace(face.still(2), hand_m=np.array([[np.nan] * 3, place]))
    for camera, views in zip(pair, face.render(acting, looks, pair, noise=0.0), strict=True):
        hidden = np.abs(views[1, 0].astype(int) - views[0, 0]) > 2
        rows, columns = np.nonzero(hidden)
        middle = project(camera, place)
        assert np.array([columns.mean(), rows.mean()]) == pytest.approx(middle, abs=8.0)
        hand = looks.mesh.places_m[looks.mesh.hand] + place
        outline = project(camera, hand)
        assert columns.min() >= outline[:, 0].min() - 2
        assert rows.max() <= outline[:, 1].max() + 2
        assert hidden[int(middle[1]), int(middle[0]) - 20 : int(middle[0]) + 20].mean() > 0.8
