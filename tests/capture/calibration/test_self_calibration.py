"""Self-calibration of small random rigs: known rigs are recovered, and undetermined ones are rejected."""

import numpy as np
import pycolmap
import pytest
from planted_rig import SIZE, apart, plant

from cospeech.capture.calibration import bundle_adjustment, epipolar, quality, robust_bundle, self_calibration
from cospeech.errors import UserError
from cospeech.geometry.camera import project

ACTOR_M = np.random.default_rng(5).uniform([-0.8, 0.6, -0.8], [0.8, 1.7, 0.8], (300, 3))


def solve(truth, observations):
    return self_calibration.calibrate([c.name for c in truth], observations, [c.size_px for c in truth])


def test_twenty_random_rigs_are_recovered():
    focal_errors, distances_mm = [], []
    for seed in range(20):
        truth, _, observations = plant(seed)
        cameras, _, _ = solve(truth, observations)
        focal, distances = apart(cameras, truth, ACTOR_M)
        focal_errors.append(focal)
        distances_mm.append(1000 * np.median(distances))
    assert np.mean(focal_errors) <= 0.002
    assert max(focal_errors) <= 0.006
    assert np.median(distances_mm) <= 0.5
    assert max(distances_mm) <= 0.7


def adjusted_truth(truth, points, observations):
    """Return the best possible estimate: the true rig adjusted to exactly the observations that are not outliers."""
    clean = np.linalg.norm(observations - [project(camera, points) for camera in truth], axis=-1) < 3.0
    clean &= clean.sum(axis=0) >= 2
    return robust_bundle.adjust_inliers(truth, points, observations, clean, noise_px=0.3)[0]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("harder", [{"outliers": 0.3}, {"missing": 0.75}])
def test_many_outliers_or_missing_observations_cost_little_accuracy(seed, harder):
    truth, points, observations = plant(seed, **harder)
    cameras, _, _ = solve(truth, observations)
    _, distances = apart(cameras, truth, ACTOR_M)
    _, least = apart(adjusted_truth(truth, points, observations), truth, ACTOR_M)
    assert np.median(distances) < 1.5 * np.median(least)


def test_without_noise_the_rig_is_exact():
    truth, _, observations = plant(1, noise_px=0.0, outliers=0.0)
    cameras, _, used = solve(truth, observations)
    focal, distances = apart(cameras, truth, ACTOR_M)
    assert focal < 1e-6
    assert distances.max() < 1e-6
    seen = ~np.isnan(observations[..., 0])
    assert (used == seen & (seen.sum(axis=0) >= 2)).all()


def test_outliers_are_rejected():
    truth, points, observations = plant(2, outliers=0.2)
    _, _, used = solve(truth, observations)
    clean = np.array([project(camera, points) for camera in truth])
    wrong = np.linalg.norm(observations - clean, axis=-1) > 8.0
    assert (used & wrong).sum() <= 0.005 * used.sum()
    shared = ~np.isnan(observations[..., 0]) & ~wrong
    assert (used & shared).sum() > 0.95 * (shared & (shared.sum(axis=0) >= 2)).sum()


def test_the_same_points_give_the_same_cameras():
    truth, _, observations = plant(4, n_points=200)
    assert solve(truth, observations)[0] == solve(truth, observations)[0]


def test_pycolmap_agrees_on_the_same_points():
    """Bundle adjustment in pycolmap with the same points, cameras and lens model, started from our solution."""
    truth, _, observations = plant(6, outliers=0.0)
    cameras, points, used = solve(truth, observations)
    second = pycolmap.Reconstruction()
    kept = np.flatnonzero(used.any(axis=0))
    column = {(c, n): i for c in range(5) for i, n in enumerate(np.flatnonzero(used[c]))}
    for number, camera in enumerate(cameras):
        focal, centre, lens = camera.focal_px[0], camera.centre_px, camera.lens
        inside = pycolmap.Camera(
            model="RADIAL", width=SIZE[0], height=SIZE[1], camera_id=number + 1,
            params=[focal * 1.01, centre[0] + 0.5, centre[1] + 0.5, lens[0], lens[1]],
        )  # fmt: skip
        second.add_camera_with_trivial_rig(inside)
        image = pycolmap.Image(
            name=camera.name,
            camera_id=number + 1,
            image_id=number + 1,
            keypoints=observations[number][used[number]] + 0.5,
        )
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(camera.rotation), np.array(camera.shift_m))
        second.add_image_with_trivial_frame(image, pose)
    for n in kept:
        track = [pycolmap.TrackElement(c + 1, column[c, n]) for c in np.flatnonzero(used[:, n])]
        second.add_point3D(points[n], pycolmap.Track(track))
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_principal_point = True
    options.print_summary = False
    pycolmap.bundle_adjustment(second, options)
    theirs = np.array([second.cameras[c + 1].params for c in range(5)])
    ours = bundle_adjustment.from_cameras(cameras).inner
    np.testing.assert_allclose(theirs[:, 0], ours[:, 0], rtol=0.002)
    np.testing.assert_allclose(theirs[:, 1:3] - 0.5, ours[:, 2:4], atol=6.0)
    np.testing.assert_allclose(theirs[:, 3], ours[:, 4], atol=0.01)


def test_the_fundamental_matrix_matches_the_cameras():
    truth, points, _ = plant(0)
    flat = [bundle_adjustment.to_cameras(bundle_adjustment.from_cameras([c]), [c])[0] for c in truth[:2]]
    k = [camera.intrinsic for camera in flat]
    a, b = ((points @ c.pose[:, :3].T + c.pose[:, 3]) @ c.intrinsic.T for c in flat)
    a, b = a[:, :2] / a[:, 2:], b[:, :2] / b[:, 2:]
    found, near = epipolar.fundamental(a, b, 1.0, np.random.default_rng(0))
    rotation = flat[1].rotation @ flat[0].rotation.T
    t = np.array(flat[1].shift_m) - rotation @ np.array(flat[0].shift_m)
    cross = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
    wanted = np.linalg.inv(k[1]).T @ cross @ rotation @ np.linalg.inv(k[0])
    wanted /= np.linalg.norm(wanted)
    assert near.all()
    assert min(np.abs(found - wanted).max(), np.abs(found + wanted).max()) < 1e-8


def flat_cloud(observations, truth, points):
    plane = points.copy()
    plane[:, 1] = 1.0
    seen = np.array([project(camera, plane) for camera in truth])
    return np.where(np.isnan(observations), np.nan, seen + np.random.default_rng(0).normal(0, 0.3, seen.shape))


def small_cloud(observations, truth, points):
    tight = (points - [0, 1.1, 0]) * 0.04 + [0, 1.1, 0]
    seen = np.array([project(camera, tight) for camera in truth])
    return np.where(np.isnan(observations), np.nan, seen + np.random.default_rng(0).normal(0, 0.3, seen.shape))


def alone(observations, truth, points):
    observations[4, (~np.isnan(observations[:4, :, 0])).any(axis=0)] = np.nan
    return observations


def astray(observations, truth, points):
    observations[2] = np.random.default_rng(0).permutation(observations[2])
    return observations


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda o, t, p: o[:, :30], "points are seen by two or more cameras, but at least 60 are needed"),
        (lambda o, t, p: np.full_like(o, np.nan), "0 points are seen by two or more"),
        (flat_cloud, "one plane|no start|agree"),
        (small_cloud, "cover only [0-9]+% of the image of camera c"),
        (alone, r"camera c5 shares \d+ points with other cameras"),
        (astray, "points of camera c3 agree"),
    ],
)
def test_an_undetermined_rig_is_rejected(spoil, reason):
    truth, points, observations = plant(0, outliers=0.0)
    with pytest.raises(UserError, match=reason):
        solve(truth, spoil(observations.copy(), truth, points))


def test_two_cameras_are_rejected():
    truth, _, observations = plant(0)
    with pytest.raises(UserError, match="three or more"):
        solve(truth[:2], observations[:2])


def test_the_table_reports_the_quality_of_each_camera():
    truth, _, observations = plant(8, outliers=0.1)
    cameras, points, used = solve(truth, observations)
    table = quality.table(cameras, points, used, observations)
    assert list(table["camera"]) == ["c1", "c2", "c3", "c4", "c5"]
    assert table["rms_px"].between(0.2, 0.45).all()  # 0.3 px per axis, less the degrees of freedom of the fit
    assert (table["n_points"] == used.sum(axis=1)).all()
    assert table["n_outliers"].between(20, 90).all()
    assert table["coverage"].between(0.4, 1.0).all()
