"""Moving bodies as binary glTF: read back by our own reader, by pygltflib, trimesh and the official validator."""

import json
import shutil
import subprocess

import numpy as np
import pygltflib
import pytest
import trimesh

from cospeech.corpus import retarget
from cospeech.errors import UserError
from cospeech.formats import glb, glb_writer
from cospeech.geometry import rotation
from cospeech.motion.body import STANDARD, Body
from cospeech.motion.library import Poses
from cospeech.rendering import export

FPS, N_FRAMES = 20.0, 30

CREATURE = Body(
    ("root", "a", "b", "c"), np.array([-1, 0, 1, 0]), np.array([[0, 2, 0], [0, 1, 0], [0.5, 0, 0], [0, 0, 3]])
)


def some_poses(n_joints, seed=0):
    rng = np.random.default_rng(seed)
    turns = np.cumsum(rng.normal(0.0, 0.1, (N_FRAMES, n_joints, 3)), axis=0)
    root = np.cumsum(rng.normal(0.0, 0.02, (N_FRAMES, 3)), axis=0)
    return Poses(root, rotation.to_quaternions(rotation.from_vectors(turns)))


def places(clip, body):
    """The positions (T, J, 3) of the joints of a body in a clip, which may order them differently."""
    found = retarget.world_positions(clip, retarget.world_rotations(clip))
    return np.stack([found[clip.names.index(name)] for name in body.joints], axis=1)


@pytest.fixture(scope="module", params=["standard", "creature"])
def written(request, tmp_path_factory):
    body = STANDARD if request.param == "standard" else CREATURE
    poses = some_poses(len(body.joints))
    path = tmp_path_factory.mktemp("glb") / f"{request.param}.glb"
    glb_writer.write(path, "talk", body, poses, FPS, export.surface(1) if body is STANDARD else None)
    return path, body, poses


def test_our_reader_reads_the_same_frames(written):
    path, body, poses = written
    (clip,) = glb.read(path).values()
    assert clip.fps == FPS
    np.testing.assert_allclose(places(clip, body), body.world(poses.root_m, poses.rotations)[1], atol=1e-5)


def test_pygltflib_reads_the_same_positions(written):
    path, body, poses = written
    file = pygltflib.GLTF2().load(str(path))

    def numbers(number):
        accessor = file.accessors[number]
        view = file.bufferViews[accessor.bufferView]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        start = view.byteOffset + (accessor.byteOffset or 0)
        return np.frombuffer(file.binary_blob(), "<f4", accessor.count * width, start).reshape(-1, width)

    animation = file.animations[0]
    turns, root = np.zeros((N_FRAMES + 2, len(body.joints), 4)), None
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        times, values = numbers(sampler.input)[:, 0], numbers(sampler.output)
        if channel.target.path == "translation":
            root = values
        else:
            turns[:, channel.target.node] = values[:, [3, 0, 1, 2]]
    np.testing.assert_allclose(times[1:-1], (np.arange(N_FRAMES) + 0.5) / FPS, atol=1e-6)
    assert times[0] == 0
    assert times[-1] == pytest.approx(N_FRAMES / FPS)
    read = body.world(root[1:-1] - body.offsets_m[0], turns[1:-1])[1]
    np.testing.assert_allclose(read, body.world(poses.root_m, poses.rotations)[1], atol=1e-5)


def test_trimesh_reads_the_rest_pose_and_the_surface(written):
    path, body, _ = written
    scene = trimesh.load_scene(path)
    rest = body.world(np.zeros((1, 3)), np.tile([1.0, 0, 0, 0], (1, len(body.joints), 1)))[1][0]
    for joint, name in enumerate(body.joints):
        np.testing.assert_allclose(scene.graph.get(name)[0][:3, 3], rest[joint], atol=1e-5)
    assert sum(mesh.area for mesh in scene.geometry.values()) > 0.1


def test_the_surface_is_oriented_outward():
    surface = export.surface(1)
    a, b, c = (surface.position[surface.triangle[:, k]] for k in range(3))
    outward = np.einsum("fi,fi->f", np.cross(b - a, c - a), surface.normal[surface.triangle[:, 0]])
    assert (outward > -1e-9).mean() > 0.98
    np.testing.assert_allclose(surface.weight.sum(axis=1), 1, atol=1e-6)


def test_the_same_motion_gives_the_same_bytes(written, tmp_path):
    path, body, poses = written
    again = tmp_path / "again.glb"
    glb_writer.write(again, "talk", body, poses, FPS, export.surface(1) if body is STANDARD else None)
    assert again.read_bytes() == path.read_bytes()


def test_a_copy_with_another_animation_keeps_the_rest(written, tmp_path):
    path, body, _ = written
    other = some_poses(len(body.joints), seed=1)
    copy = tmp_path / "copy.glb"
    skeleton = glb.skeleton(path)
    order = [skeleton.names.index(name) for name in body.joints]
    np.testing.assert_allclose(skeleton.offsets_m[order], body.offsets_m, atol=1e-6)
    other = Poses(other.root_m, other.rotations[:, np.argsort(order)])
    glb_writer.write_animation(copy, path, "walk", skeleton, other, FPS)
    (clip,) = glb.read(copy).values()
    expected = body.world(other.root_m, other.rotations[:, order])[1]
    np.testing.assert_allclose(places(clip, body), expected, atol=1e-5)
    assert len(pygltflib.GLTF2().load(str(copy)).meshes) == 1


def test_motion_without_a_frame_is_refused(tmp_path):
    poses = Poses(np.empty((0, 3)), np.empty((0, 4, 4)))
    with pytest.raises(UserError, match="no frame"):
        glb_writer.write(tmp_path / "none.glb", "none", CREATURE, poses, FPS)
    assert not list(tmp_path.iterdir())


VALIDATE = """
const validator = require("gltf-validator"), file = require("fs").readFileSync(process.argv[1]);
validator.validateBytes(new Uint8Array(file)).then(report => console.log(JSON.stringify(report.issues)));
"""


def has_validator():
    node = shutil.which("node")
    return (
        bool(node) and subprocess.run([node, "-e", 'require("gltf-validator")'], capture_output=True).returncode == 0
    )


@pytest.mark.skipif(not has_validator(), reason="needs node with the package gltf-validator (NODE_PATH)")
def test_the_official_validator_finds_nothing(written):
    found = subprocess.run(["node", "-e", VALIDATE, str(written[0])], capture_output=True, text=True, check=True)
    issues = json.loads(found.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:3]
