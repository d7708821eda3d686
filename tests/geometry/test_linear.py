"""Linear triangulation against points that Pose2Sim published for the same keypoints and cameras."""

import json
from pathlib import Path

import linear
import numpy as np
import pytest

from cospeech.formats import camera_toml

BALANCING = Path(__file__).parents[3] / "shared" / "data" / "pose2sim_balancing"
NECK = 17
KEYPOINTS = (12, 14, 16, 22, 23, 24, 11, 13, 15, 19, 20, 21, NECK, 18, 0, 6, 8, 10, 5, 7, 9)
"""The keypoints (BODY_25B) behind the 21 markers of the TRC, in its order."""


@pytest.mark.recorded
@pytest.mark.skipif(not BALANCING.is_dir(), reason="pose2sim_balancing is not beside the project")
def test_points_of_pose2sim_are_found_again_with_a_second_person_in_view():
    cameras = camera_toml.read(BALANCING / "calibration" / "Calib_qualisys.toml")
    trc = np.genfromtxt(
        BALANCING / "points_3d" / "S00_P00_T01_BalancingTrial_0-100.trc", skip_header=5, delimiter="\t"
    )[:, 2:65].reshape(-1, 21, 3)
    frames = range(0, 100, 7)
    several, away = 0, []
    for frame in frames:
        views = []
        for number in range(1, 5):
            path = BALANCING / "pose" / f"cam{number:02d}_json" / f"cam{number:02d}.{frame:04d}.json"
            people = json.loads(path.read_text())["people"]
            views.append(np.array([person["pose_keypoints_2d"] for person in people]).reshape(-1, 25, 3))
        several += len(views[0]) > 1
        chosen = linear.same_person(cameras, [view[:, NECK] for view in views])
        keypoints = np.stack([view[person] for view, person in zip(views, chosen, strict=True)], axis=1)
        points = np.array(
            [linear.agreeing(cameras, k[:, :2], k[:, 2], 15.0, 0.3) for k in keypoints[list(KEYPOINTS)]]
        )
        away.append(np.linalg.norm(points[:, [1, 2, 0]] - trc[frame], axis=1))
    assert several == len(frames)
    assert np.nanmedian(away) < 1e-5
    assert np.nanpercentile(away, 90) < 1e-4
