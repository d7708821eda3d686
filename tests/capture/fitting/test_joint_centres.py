"""Sphere fits and shoulder centres compared with known ones."""

import numpy as np
import pytest
import subject
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.capture.fitting.joint_centres import fit_sphere, shoulder_centre
from cospeech.errors import UserError
from cospeech.geometry.rigid import align
from cospeech.motion import markers, skeleton


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.floats(0.1, 0.5))
def test_a_sphere_without_noise_is_recovered_from_part_of_it(seed, radius):
    rng = np.random.default_rng(seed)
    centre = rng.normal(0, 1, 3)
    ahead = np.array([0.0, 0.0, 2.0]) + rng.normal(0, 1, (40, 3))
    points = centre + radius * ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    found = fit_sphere(np.vstack([points, np.full((2, 3), np.nan)]))
    np.testing.assert_allclose(found.centre_m, centre, atol=1e-7)
    assert found.radius_m == pytest.approx(radius, abs=1e-7)


def test_the_standard_error_of_a_centre_matches_its_actual_error():
    rng = np.random.default_rng(1)
    errors, said = [], []
    for _ in range(200):
        ahead = np.array([0.0, 0.0, 1.5]) + rng.normal(0, 1, (60, 3))
        points = 0.3 * ahead / np.linalg.norm(ahead, axis=1, keepdims=True) + rng.normal(0, 0.001, (60, 3))
        found = fit_sphere(points)
        errors.append(found.centre_m[2])  # the least certain direction
        said.append(found.error_m)
    assert np.std(errors) == pytest.approx(np.mean(said), rel=0.2)
    assert abs(np.mean(errors)) < 0.2 * np.std(errors)


@pytest.mark.parametrize("n_points", [3, 100])
def test_coplanar_or_too_few_points_do_not_determine_a_sphere(n_points):
    angle = np.linspace(0, 3, n_points)
    assert fit_sphere(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])).error_m == np.inf


def test_shoulders_are_located_to_a_third_of_a_millimetre_and_a_still_arm_is_rejected():
    places = subject.marked(subject.range_of_motion())
    rigid = [index for index, marker in enumerate(markers.MARKERS) if marker.joint == "chest"]
    still = places[:40].mean(axis=0)
    thorax = align(still[rigid], places[:, rigid])
    for side in ("left", "right"):
        elbow = places[:, markers.NAMES.index(f"{side}_elbow")].copy()
        elbow[100:200] = np.nan
        _, joints = subject.chain(subject.range_of_motion())
        truth = joints[0, skeleton.JOINTS.index(f"{side}_arm")]
        np.testing.assert_allclose(shoulder_centre(side, elbow, thorax).centre_m, truth, atol=0.0003)
        with pytest.raises(UserError, match=f"the {side} arm moves too little"):
            shoulder_centre(side, elbow[:40], (thorax[0][:40], thorax[1][:40]))


def test_a_shoulder_is_rejected_from_a_standard_error_of_five_millimetres():
    rng = np.random.default_rng(0)

    def elbow(reach_deg):
        """Return 200 noisy positions of an elbow within a cone."""
        tilt, turn = np.radians(reach_deg) * np.sqrt(rng.uniform(0, 1, 200)), rng.uniform(0, 2 * np.pi, 200)
        arm = np.column_stack([np.sin(tilt) * np.cos(turn), -np.cos(tilt), np.sin(tilt) * np.sin(turn)])
        return 0.3 * arm + rng.normal(0, 0.001, (200, 3))

    still = np.tile(np.eye(3), (200, 1, 1)), np.zeros((200, 3))
    assert 0.003 < shoulder_centre("left", elbow(20.0), still).error_m < 0.005
    with pytest.raises(UserError, match=r"the left arm moves too little .* standard error [6-9]\.\d mm"):
        shoulder_centre("left", elbow(15.0), still)
