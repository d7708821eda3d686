"""The calibration take and the range-of-motion take: spots at their true positions, and static poses at both ends."""

from pathlib import Path

import numpy as np
import yaml

from cospeech.geometry.camera import project
from cospeech.motion import skeleton
from cospeech.studio import laser, range_of_motion, rig

ROOT = Path(__file__).parents[2]


def test_centroid_of_the_spot_is_at_its_true_position(monkeypatch):
    monkeypatch.setattr(laser, "REFLECTED", 0.0)
    camera = rig.cameras(696, 3)[2]
    spots_m = laser.walk(200, 1)[156:164]
    seen = laser.visible_spots([camera], spots_m, 1)
    planes = [drawn.copy() for drawn in laser.frames(camera, seen, len(spots_m), 1, noise=0.0)]
    assert len(seen) > 3
    for row in seen.itertuples():
        red = np.clip(planes[row.frame][2].astype(float) - 129.0, 0.0, None)
        rows, columns = np.indices(red.shape)
        found = np.array([(columns * red).sum(), (rows * red).sum()]) / red.sum()
        assert np.hypot(*(found - (row.x_px, row.y_px))) < 0.1


def test_spot_rests_on_the_marks_as_the_demo_states_and_in_view_of_all_cameras():
    """The stated frames keep a margin of one frame before the spot moves, and all cameras have the marks in view."""
    facts = yaml.safe_load((ROOT / "config/demo.yaml").read_text())["capture"]["calibration"]["facts"]
    spots_m = laser.walk(laser.N_FRAMES, 3)
    assert [tuple(fact["place_m"]) for fact in facts] == list(laser.MARKS_M)
    for fact in facts:
        rest = spots_m[fact["from_frame"] - 1 : fact["to_frame"] + 2]
        np.testing.assert_array_equal(rest, np.broadcast_to(fact["place_m"], rest.shape))
    for camera in (view for seed in range(20) for view in rig.cameras(696, seed)):
        pixels = project(camera, np.array(laser.MARKS_M))
        assert (pixels > 8).all()
        assert (pixels < np.array(camera.size_px) - 8).all()


def test_range_of_motion_starts_and_ends_with_hanging_arms():
    angles = skeleton.angles(range_of_motion.perform(20.0))
    assert len(angles) == 480
    assert (angles[:40] == 0).all()
    assert (angles[-40:] == 0).all()
    assert np.abs(np.diff(angles, axis=0)).max() < 25.0
