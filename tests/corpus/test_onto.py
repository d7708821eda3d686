"""Our motion on other skeletons: other proportions, names, rest poses, units and axes."""

import numpy as np
import pytest
import yaml
from skeletons import motion_of, other_offsets, target

from cospeech import cli
from cospeech.corpus import onto, retarget
from cospeech.errors import UserError
from cospeech.formats import bvh, glb, glb_writer
from cospeech.geometry import rotation
from cospeech.motion import library
from cospeech.motion.body import STANDARD, Body


def write_skeleton(path, names, theirs):
    """Write a skeleton in its rest pose, which has two frames there."""
    still, root = np.tile(np.eye(3), (2, len(names), 1, 1)), np.tile(theirs.offsets[0], (2, 1))
    clip = bvh.Clip(names, theirs.parents, still, {0: root}, 30.0, theirs.offsets, dict(theirs.tips))
    bvh.write_clip(clip, path)


@pytest.fixture(scope="module")
def poses(recordings):
    return motion_of(recordings / "talk_1.bvh")


@pytest.mark.parametrize(
    ("pose", "up", "turned"), [("T", "y", False), ("A", "z", False), ("hanging", "y", True), ("T", "z", True)]
)
def test_limbs_keep_their_directions_and_feet_the_floor(poses, pose, up, turned):
    theirs = target(pose, up, 3, turned)
    source = onto.joint_map(theirs.names, None, "theirs")
    root, local = onto.retargeted(poses, theirs, source)
    axes = retarget.AXES[up]
    own = STANDARD.world(poses.root_m, poses.rotations)[1]
    placed = theirs.world(root, local)[1] @ axes.T
    for start, end in onto.LIMBS:
        a = own[:, STANDARD.joints.index(end)] - own[:, STANDARD.joints.index(start)]
        b = placed[:, source[end]] - placed[:, source[start]]
        cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
        assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.1
    np.testing.assert_allclose(onto.limb_errors_deg(poses, theirs, source, local), 0, atol=0.1)
    at_rest = theirs.world(theirs.offsets[:1], theirs.rotations[None])[1][0] @ axes.T
    feet = [source["left_foot"], source["right_foot"]]
    lowest_cm = (placed[:, feet, 1] - at_rest[feet, 1]).min(axis=1)
    standing = (own[:, feet, 1] - 0.07).min(axis=1)
    scale = lowest_cm[np.argmax(standing)] / standing.max() if standing.max() > 1e-6 else 100.0
    assert np.abs(lowest_cm - scale * standing).max() < 0.5  # cm


def test_what_was_moved_onto_a_skeleton_reads_back_as_our_motion(poses):
    theirs = target("A", "z", 5)
    root, local = onto.retargeted(poses, theirs, onto.joint_map(theirs.names, None, "theirs"))
    clip = bvh.Clip(theirs.names, theirs.parents, local, {0: root}, 20.0, theirs.offsets, dict(theirs.tips))
    conventions = retarget.MotionConventions("z", "cm", "cospeech", "offsets")
    table, _ = retarget.motion_table(clip, conventions, "theirs")
    back = library.from_motion(table)
    angles = rotation.angles_deg(
        np.swapaxes(STANDARD.world(poses.root_m, poses.rotations)[0], -1, -2)
        @ STANDARD.world(back.root_m, back.rotations)[0]
    )
    limbs = [STANDARD.joints.index(start) for start, _ in onto.LIMBS]
    assert angles[:, limbs].max() < 0.1


def test_the_command_moves_motion_onto_a_bvh_skeleton(recordings, tmp_path, capsys):
    theirs = target("T", "y", 7)
    names = tuple(f"Rig:{onto.MIXAMO[name]}" for name in theirs.names)
    skeleton_file = tmp_path / "mixamo.bvh"
    write_skeleton(skeleton_file, names, theirs)
    out = tmp_path / "moved.bvh"
    assert cli.main(["retarget", str(recordings / "talk_1.bvh"), "--to", str(skeleton_file), "--out", str(out)]) == 0
    moved = bvh.read(out)
    assert set(moved.names) == set(names)
    assert len(moved.rotations) == len(bvh.read(recordings / "talk_1.bvh").rotations)
    assert "within 0.0" in capsys.readouterr().err


def test_the_command_moves_motion_into_a_copy_of_a_glb_file(recordings, tmp_path):
    avatar, out = tmp_path / "avatar.glb", tmp_path / "moved.glb"
    body = Body(STANDARD.joints, STANDARD.parents, other_offsets("T", np.random.default_rng(2)))
    still = library.Poses(np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, len(body.joints), 1)))
    glb_writer.write(avatar, "idle", body, still, 30.0)
    assert cli.main(["retarget", str(recordings / "talk_1.bvh"), "--to", str(avatar), "--out", str(out)]) == 0
    assert list(glb.read(out)) == ["moved"]


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        (None, "its joints have unknown names"),
        ({"hips": "B0", "arm": "B1"}, "unknown joint 'arm'"),
        ({"hips": "nothing"}, "nothing"),
        (["hips"], "is no list of joints"),
    ],
)
def test_a_wrong_map_is_one_line(recordings, tmp_path, joints, message, capsys):
    theirs = target("T", "y", 7)
    names = tuple(f"B{k}" for k in range(len(theirs.names)))
    write_skeleton(tmp_path / "b.bvh", names, theirs)
    given = [
        "retarget",
        str(recordings / "talk_1.bvh"),
        "--to",
        str(tmp_path / "b.bvh"),
        "--out",
        str(tmp_path / "o.bvh"),
    ]
    if joints is not None:
        (tmp_path / "map.yaml").write_text(yaml.safe_dump(joints))
        given += ["--joints", str(tmp_path / "map.yaml")]
    assert cli.main(given) == 1
    line = capsys.readouterr().err
    assert message in line
    assert line.count("\n") == 1
    assert not (tmp_path / "o.bvh").exists()


def test_a_skeleton_without_legs_is_refused():
    with pytest.raises(UserError, match="no joint is mapped to 'left_thigh'"):
        onto.check_joints({"hips": 0}, "theirs")
