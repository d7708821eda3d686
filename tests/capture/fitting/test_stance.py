"""Markers that contradict the declared unit, axes, sides or static pose are refused; a declared T-pose is fitted."""

import numpy as np
import pytest
import subject

from cospeech.capture.accuracy import angle_between_deg, rms
from cospeech.capture.fitting import marker_file, skeleton_fit, stance
from cospeech.capture.fitting.body_model import body_model
from cospeech.data import trajectories
from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import trc
from cospeech.motion import markers
from cospeech.motion.skeleton import JOINTS

SAME = {name: name for name in markers.NAMES}
SWAPPED = {name: name.replace("left", "0").replace("right", "left").replace("0", "right") for name in markers.NAMES}


def take(raised_deg=0.0, noise_m=0.0005):
    return subject.marked(subject.range_of_motion(8.0, raised_deg=raised_deg), noise_m)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A range-of-motion take with y up, facing z."""
    path = tmp_path_factory.mktemp("markers") / "range.trc"
    trc.write(Trajectories(markers.NAMES, take(), subject.FPS), path)
    return path


def read(path, names=SAME, up="y", facing="z", pose="hanging"):
    return marker_file.read(path, names, up, facing, 0.5, static=(pose, subject.STATIC_S))


def test_a_take_that_agrees_with_its_declaration_is_read(path):
    assert (read(path)["status"] == "seen").all()


@pytest.mark.parametrize(
    ("up", "facing", "reason"),
    [
        ("z", "y", "the head is not above the chest, but [789][0-9] degrees from the vertical, in the direction y"),
        ("-y", "z", "the head is not above the chest, but 1[678][0-9] degrees from the vertical, in the direction y"),
        ("y", "x", "the actor faces z, [89][0-9] degrees off the declared direction; correct corpus.markers.facing"),
        ("y", "-z", "the actor faces z, 1[78][0-9] degrees off the declared direction"),
    ],
)
def test_wrong_axes_are_refused(path, up, facing, reason):
    with pytest.raises(UserError, match=rf"range\.trc: .*{reason}"):
        read(path, up=up, facing=facing)


def test_a_record_is_read_in_any_case_and_refused_before_the_fit_if_its_axes_sides_or_unit_are_wrong(path):
    for names, up, facing, unit, reason in (
        (SAME, "z", "y", None, "the head is not above the chest"),
        (SWAPPED, "y", "z", None, "'left_shoulder' is on the actor's right"),
        (SAME, "y", "z", "mm", "as in a file in m that states the unit mm"),
    ):
        table = marker_file.read(path, names, up, facing, 0.5, unit=unit)
        with pytest.raises(UserError, match=rf"a\.trc: .*{reason}"):
            marker_file.check(table, up, facing, "a.trc")
    marker_file.check(marker_file.read(path, SAME, "y", "z", 0.5), "y", "z", "a.trc")


@pytest.mark.parametrize(
    ("one", "two", "reason"),
    [
        ("left_shoulder", "right_shoulder", "'left_shoulder' is on the actor's right"),
        ("chest", "back", "'left_shoulder' is on the actor's right.*or chest and back"),
        ("head_left", "head_right", "'head_left' is to the right of 'head_right'"),
        ("left_elbow", "right_elbow", "'left_elbow' is to the right of 'right_elbow'"),
        ("left_hand", "right_hand", "'left_hand' is to the right of 'right_hand'"),
        ("left_leg", "right_leg", "'left_leg' is to the right of 'right_leg'"),
        ("left_foot", "right_foot", "'left_foot' is to the right of 'right_foot'"),
        ("left_elbow", "left_hand", "the left forearm is 1[67][0-9] degrees from hanging"),
    ],
)
def test_exchanged_markers_are_refused(path, one, two, reason):
    with pytest.raises(UserError, match=reason):
        read(path, SAME | {one: two, two: one})


def test_a_mirrored_file_is_refused(path):
    trc.write(Trajectories(markers.NAMES, take() * (-1, 1, 1), subject.FPS), path.with_name("mirrored.trc"))
    with pytest.raises(UserError, match="'left_shoulder' is on the actor's right"):
        read(path.with_name("mirrored.trc"))


@pytest.mark.parametrize(
    ("factor", "length", "units"),
    [(0.001, "0.0003", "in m that states the unit mm"), (1000.0, "33", "in mm that states the unit m")],
)
def test_a_wrong_unit_is_refused_with_the_size_of_the_body(factor, length, units):
    with pytest.raises(UserError, match=rf"a\.trc: the markers of the left shoulder and elbow are {length}.*{units}"):
        stance.check_unit(factor * take(), "a.trc")
    stance.check_unit(take(), "a.trc")
    stance.check_unit(np.full((3, len(markers.NAMES), 3), np.nan), "a.trc")


@pytest.mark.parametrize(
    ("raised_deg", "pose", "advice"),
    [
        (90.0, "hanging", "set corpus.markers.static to t_pose"),
        (0.0, "t_pose", "set corpus.markers.static to hanging"),
        (45.0, "hanging", "record the take again"),
        (45.0, "t_pose", "record the take again"),
        (28.0, "hanging", "record the take again"),
        (60.0, "t_pose", "record the take again"),
    ],
)
def test_a_static_pose_that_is_not_the_declared_one_is_refused(raised_deg, pose, advice):
    with pytest.raises(UserError, match=rf"declared to be {pose}; {advice}") as caught:
        body_model(take(raised_deg), subject.FPS, subject.STATIC_S, pose)
    measured = float(str(caught.value).split("upper arm is ")[1].split(" degrees")[0])
    assert measured == pytest.approx(raised_deg, abs=12.0)  # the elbow marker is 45 mm beside the joint


@pytest.mark.parametrize(("raised_deg", "pose"), [(10.0, "hanging"), (80.0, "t_pose"), (95.0, "t_pose")])
def test_a_static_pose_need_not_be_exact(raised_deg, pose):
    body_model(take(raised_deg), subject.FPS, subject.STATIC_S, pose)


def test_a_declared_t_pose_gives_the_angles_of_the_subject():
    moved = subject.performance(20.0)
    start, record = (
        trajectories.to_table(places, markers.NAMES, subject.FPS)
        for places in (
            subject.marked(subject.range_of_motion(20.0, raised_deg=90.0), seed=1), subject.marked(moved, seed=2)
        )
    )  # fmt: skip
    found = skeleton_fit.fit(start, record, subject.STATIC_S, stance.T_POSE).motion
    turns, truth = subject.chain(found)[0], subject.chain(moved)[0]
    down = np.array([0.0, -1.0, 0.0])
    for side in ("left", "right"):
        column = f"{side}_forearm_x_deg"
        assert np.corrcoef(found[column], moved[column])[0, 1] > 0.98
        assert rms(found[column] - moved[column]) < 4.0  # the hand marker is beside the axis of the forearm
        arm = JOINTS.index(f"{side}_arm")
        assert rms(angle_between_deg(turns[:, arm] @ down, truth[:, arm] @ down)) < 0.5


def test_the_body_model_does_not_depend_on_the_static_pose():
    """Without noise, a subject has the same bones and wears the markers in the same places in either pose."""
    hanging, spread = (
        body_model(take(raised_deg, 0.0), subject.FPS, subject.STATIC_S, pose)
        for raised_deg, pose in ((0.0, stance.HANGING), (90.0, stance.T_POSE))
    )
    np.testing.assert_allclose(spread.offsets_m, hanging.offsets_m, atol=1e-6)
    np.testing.assert_allclose(spread.marker_places_m, hanging.marker_places_m, atol=1e-6)
