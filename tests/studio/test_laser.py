"""The calibration take and the range of motion: spots where they were planted, arms that hang at both ends."""

import numpy as np

from cospeech import skeleton
from cospeech.studio import laser, range_of_motion, rig


def test_centroid_of_the_spot_is_where_it_was_planted(monkeypatch):
    monkeypatch.setattr(laser, "REFLECTED", 0.0)
    camera = rig.cameras(696, 3)[2]
    seen = laser.sightings([camera], laser.roam(8, 1), 1)
    planes = list(laser.frames(camera, seen, 8, 1, noise=0.0))
    assert len(seen) > 3
    for row in seen.itertuples():
        red = np.clip(planes[row.frame][2].astype(float) - 129.0, 0.0, None)
        rows, columns = np.indices(red.shape)
        found = np.array([(columns * red).sum(), (rows * red).sum()]) / red.sum()
        assert np.hypot(*(found - (row.x_px, row.y_px))) < 0.1


def test_range_of_motion_starts_and_ends_with_hanging_arms():
    angles = skeleton.angles(range_of_motion.perform(20.0))
    assert len(angles) == 480
    assert (angles[:40] == 0).all()
    assert (angles[-40:] == 0).all()
    assert np.abs(np.diff(angles, axis=0)).max() < 25.0
