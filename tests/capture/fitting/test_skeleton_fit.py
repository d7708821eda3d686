"""From marker tables of our own tracker or another laboratory's file to joint angles."""

import numpy as np
import subject

from cospeech.capture.fitting import marker_file, skeleton_fit
from cospeech.capture.tracking import detections
from cospeech.data import tables, trajectories
from cospeech.data.trajectories import Trajectories
from cospeech.formats import c3d
from cospeech.motion import markers, skeleton


def recordings():
    return subject.marked(subject.range_of_motion(20.0), seed=1), subject.marked(subject.performance(10.0), seed=2)


def test_a_file_of_another_laboratory_gives_the_same_angles_as_our_own_table(tmp_path):
    ours, theirs = [], []
    names = {name: name.upper() for name in markers.NAMES}
    for number, places in enumerate(recordings()):
        smoothed, _ = detections.fill_gaps(
            places, np.full(places.shape[:2], detections.DETECTION_SD_M), subject.FPS, 0.5
        )
        ours.append(trajectories.to_table(smoothed, markers.NAMES, subject.FPS))
        z_up = np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)
        c3d.write(Trajectories(tuple(names.values()), z_up, subject.FPS), tmp_path / f"{number}.c3d")
        theirs.append(marker_file.read(tmp_path / f"{number}.c3d", names, up="z", facing="-y", longest_hidden_s=0.5))
    here, there = (skeleton_fit.fit(take, record, subject.STATIC_S) for take, record in (ours, theirs))
    tables.validate(here.motion, "motion", "x")
    tables.validate(here.observability, "observability", "x")
    np.testing.assert_allclose(skeleton.angles(there.motion), skeleton.angles(here.motion), atol=0.02)
    assert here.line.startswith("standard error of the shoulders 0.")


def test_without_markers_on_legs_and_back_the_legs_are_still_and_the_arms_unchanged():
    take, record = recordings()
    whole, part = [], []
    bare = [index for index, name in enumerate(markers.NAMES) if name.endswith(("leg", "foot")) or name == "back"]
    for places in (take, record):
        whole.append(trajectories.to_table(places, markers.NAMES, subject.FPS))
        less = places.copy()
        less[:, bare] = np.nan
        part.append(trajectories.to_table(less, markers.NAMES, subject.FPS))
    full, few = (skeleton_fit.fit(*pair, subject.STATIC_S) for pair in (whole, part))
    legs = [f"{side}_{bone}_{axis}_deg" for side in ("left", "right") for bone in ("thigh", "shin") for axis in "xz"]
    assert np.abs(few.motion[legs].to_numpy()).max() == 0
    states = few.observability.set_index(["joint", "axis"])["state"]
    assert states["left_thigh", "x"] == states["right_shin", "x"] == "locked"
    assert states["chest", "x"] == states["left_arm", "z"] == "measured"
    arm = ["left_arm_x_deg", "left_forearm_x_deg", "right_arm_z_deg"]
    assert (few.motion[arm] - full.motion[arm]).abs().to_numpy().max() < 3


def test_predicted_positions_do_not_affect_the_body_model():
    take, _ = recordings()
    table = trajectories.to_table(take, markers.NAMES, subject.FPS)
    believed = table["marker"].eq("left_elbow") & table["frame"].between(240, 279)
    assert believed.sum() == 40
    far, lost = table.copy(), table.copy()
    far.loc[believed, trajectories.AXES] += 0.03
    far.loc[believed, "status"] = "predicted"
    lost.loc[believed, trajectories.AXES] = np.nan
    lost.loc[believed, "status"] = "lost"
    models = [skeleton_fit.fit_body_model(each, subject.STATIC_S) for each in (far, lost)]
    np.testing.assert_array_equal(models[0].offsets_m, models[1].offsets_m)
    far.loc[believed, "status"] = "seen"
    assert np.abs(skeleton_fit.fit_body_model(far, subject.STATIC_S).offsets_m - models[0].offsets_m).max() > 0.002


def test_predicted_positions_do_not_enter_the_body_model():
    places, _ = recordings()
    take = trajectories.to_table(places, markers.NAMES, subject.FPS)
    chosen = (take["marker"] == "left_elbow") & take["frame"].between(100, 200)
    hidden = take.assign(status=take["status"].mask(chosen, "predicted"))
    wrong = hidden.assign(x_m=hidden["x_m"] + 0.05 * chosen)
    true, found = (skeleton_fit.fit_body_model(table, subject.STATIC_S) for table in (hidden, wrong))
    np.testing.assert_array_equal(found.offsets_m, true.offsets_m)


def test_the_root_moves_from_its_place_in_the_static_pose():
    places, record = recordings()
    take = trajectories.to_table(places, markers.NAMES, subject.FPS)
    moved = trajectories.to_table(record + np.array([0.3, 0.0, -0.2]), markers.NAMES, subject.FPS)
    here, there = (
        skeleton_fit.fit(take, table, subject.STATIC_S).motion[list(skeleton.ROOT_COLUMNS)].to_numpy()
        for table in (trajectories.to_table(record, markers.NAMES, subject.FPS), moved)
    )
    np.testing.assert_allclose(there - here, np.tile((0.3, 0.0, -0.2), (len(here), 1)), atol=1e-3)
