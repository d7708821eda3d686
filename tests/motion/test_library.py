"""Motion libraries: poses, neighbours, frame rates and tables."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from dancer import motion
from scipy.spatial.transform import Rotation, Slerp

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.motion import library, skeleton
from cospeech.motion.body import Body
from cospeech.motion.library import Library, Poses

WORM = Body(("tail", "middle", "head"), np.array([-1, 0, 1]), np.array([[0, 0.1, 0], [0, 0, 0.2], [0, 0, 0.2]]))


def random_poses(rng, n_frames, n_joints):
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.3, (n_frames, n_joints, 3)), axis=0).reshape(-1, 3))
    return Poses(
        rng.normal(size=(n_frames, 3)).cumsum(axis=0), turns.as_quat(scalar_first=True).reshape(n_frames, n_joints, 4)
    )


def spans(**records):
    rows = [
        (record, index, start, end)
        for record, cuts in records.items()
        for index, (start, end) in enumerate(pairwise(cuts))
    ]
    return pd.DataFrame(rows, columns=["record", "phase", "start_frame", "end_frame"])


@pytest.fixture
def two():
    motions = {"bob_1": motion(n_frames=50, seed=1), "ada_1": motion(n_frames=30, seed=2)}
    return Library.of_motions(spans(bob_1=[0, 20, 50], ada_1=[0, 5, 12, 30]), motions), motions


def test_motion_becomes_poses_and_comes_back():
    table = motion(n_frames=40, walk_m=0.01, turn_deg=50)
    again = library.to_motion(library.from_motion(table), 20.0)
    tables.validate(again, "motion", "here")
    assert again.to_numpy() == pytest.approx(table.to_numpy(), abs=1e-9)


def test_a_library_knows_where_its_segments_are_and_which_are_neighbours(two):
    found, motions = two
    tables.validate(found.table, "library", "here")
    assert found.table["record"].tolist() == ["ada_1"] * 3 + ["bob_1"] * 2
    assert found.start.tolist() == [0, 5, 12, 30, 50]
    assert found.end.tolist() == [5, 12, 30, 50, 80]
    assert found.preceding.tolist() == [-1, 0, 1, -1, 3]
    assert found.following.tolist() == [1, 2, -1, 4, -1]
    assert found.first == {"ada_1": 0, "bob_1": 30}
    assert found.before[[0, 1, 29, 30, 31]].tolist() == [1, 0, 28, 31, 30]
    second = library.from_motion(motions["bob_1"])
    assert np.array_equal(found.poses.rotations[30:], second.rotations)
    assert np.array_equal(found.recordings["bob_1"].root_m, second.root_m)


def test_a_recording_of_one_frame_is_at_rest():
    found = Library.of_motions(spans(ada_1=[0, 1]), {"ada_1": motion(n_frames=1)})
    assert found.before.tolist() == [0]


def test_interpolated_poses_are_those_of_scipy():
    rng = np.random.default_rng(3)
    poses = random_poses(rng, 9, 2)
    positions = np.concatenate([rng.uniform(0, 8, 40), [0, 3, 8]])
    between = poses.resampled(positions)
    for joint in range(2):
        recorded = Rotation.from_quat(poses.rotations[:, joint], scalar_first=True)
        expected = Slerp(np.arange(9), recorded)(positions)
        found = Rotation.from_quat(between.rotations[:, joint], scalar_first=True)
        assert (found * expected.inv()).magnitude() == pytest.approx(0, abs=1e-12)
    for axis in range(3):
        assert between.root_m[:, axis] == pytest.approx(np.interp(positions, np.arange(9), poses.root_m[:, axis]))


@pytest.mark.parametrize("fps", [10.0, 30.0, 60.0])
def test_another_frame_rate_keeps_poses_and_segments_at_their_times(two, fps):
    found = two[0].at_rate(fps)
    assert found.fps == fps
    assert np.abs(found.table["start_frame"] / fps - two[0].table["start_frame"] / 20.0).max() <= 0.5 / fps
    assert (found.end > found.start).all()
    time = (np.arange(found.table["n_frames"].iloc[0]) + 0.5) / fps
    inside = (time > 0.03) & (time < 1.47)
    recorded = (np.arange(30) + 0.5) / 20.0
    joint = skeleton.JOINTS.index("left_arm")
    expected = Slerp(recorded, Rotation.from_quat(two[0].poses.rotations[:30, joint], scalar_first=True))(
        time[inside]
    )
    seen = Rotation.from_quat(found.poses.rotations[: len(time)][inside, joint], scalar_first=True)
    assert (seen * expected.inv()).magnitude() == pytest.approx(0, abs=1e-9)
    assert found.at_rate(fps) is found


def test_motion_at_another_rate_is_resampled():
    motions = {"ada_1": motion(n_frames=40, fps=20.0), "bob_1": motion(n_frames=80, fps=40.0)}
    found = Library.of_motions(spans(ada_1=[0, 40], bob_1=[0, 30, 80]), motions)
    assert found.fps == 20.0
    assert found.table[["start_frame", "end_frame", "n_frames"]].to_numpy().tolist() == [
        [0, 40, 40], [0, 15, 40], [15, 40, 40]
    ]  # fmt: skip


def test_a_library_of_another_body_survives_its_tables():
    rng = np.random.default_rng(4)
    recordings = {"long": random_poses(rng, 12, 3), "short": random_poses(rng, 5, 3)}
    body_table, poses_table = library.to_tables(recordings, WORM, 25.0)
    tables.validate(body_table, "body", "here")
    tables.validate(poses_table, "poses", "here")
    again, body = library.from_tables(body_table, poses_table)
    assert body.joints == WORM.joints
    for record, poses in recordings.items():
        assert np.array_equal(again[record].root_m, poses.root_m)
        assert np.array_equal(again[record].rotations, poses.rotations)
    assert len(Library(spans(long=[0, 12], short=[2, 5]), again, 25.0, body).poses.root_m) == 17


@pytest.mark.parametrize(
    ("segments", "complaint"),
    [
        (spans(), "has no segment"),
        (spans(eve_1=[0, 5]), "segments of 'eve_1', but no motion"),
        (spans(ada_1=[0, 31]), "segment 0 of 'ada_1' covers the frames 0 to 31, but its motion has 30"),
        (spans(ada_1=[4, 4]), "segment 0 of 'ada_1' covers the frames 4 to 4"),
    ],
)
def test_impossible_libraries_are_refused(segments, complaint):
    with pytest.raises(UserError, match=complaint):
        Library.of_motions(segments, {"ada_1": motion(n_frames=30)})


def test_poses_of_another_body_are_refused():
    poses = random_poses(np.random.default_rng(0), 4, 2)
    with pytest.raises(UserError, match="the motion of 'a' has 2 joints, but the body of the library has 3"):
        Library(spans(a=[0, 4]), {"a": poses}, 20.0, WORM)
    body_table, poses_table = library.to_tables({"a": random_poses(np.random.default_rng(0), 4, 3)}, WORM, 20.0)
    with pytest.raises(UserError, match="the poses of 'a' do not list the joints"):
        library.from_tables(body_table, poses_table.iloc[:-1])
