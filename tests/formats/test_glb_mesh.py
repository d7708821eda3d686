"""Surfaces of binary glTF files against linear blend skinning with the matrices of their nodes."""

import io

import numpy as np
import pytest
from glb_files import by_matrices, packed, random_body
from PIL import Image as Pillow

from cospeech.corpus.retarget import world_positions, world_rotations
from cospeech.errors import UserError
from cospeech.formats import glb, glb_mesh

N = 6


def skinned(mesh, clip, frame):
    """Places (n, 3) of the vertices of a mesh in a frame of a clip."""
    turned = world_rotations(clip)[frame]
    placed = np.stack(world_positions(clip, world_rotations(clip)), axis=1)[frame]
    joints = np.tile(np.eye(4), (len(turned), 1, 1))
    joints[:, :3, :3], joints[:, :3, 3] = turned, placed
    moved = joints[mesh.joint] @ mesh.bind
    corners = np.pad(mesh.position, ((0, 0), (0, 1)), constant_values=1.0)
    return np.einsum("nk,nkab,nb->na", mesh.weight, moved[mesh.slot], corners)[:, :3]


def test_vertices_are_where_the_node_tree_puts_them(tmp_path):
    rng = np.random.default_rng(5)
    nodes, joints, channels = random_body(rng)
    placed, inverse = rng.normal(size=(N, 3)), rng.normal(size=(4, 4, 4))
    inverse[:, 3] = [0, 0, 0, 1]
    slots, weights = rng.integers(0, 4, (N, 4)).astype("<u2"), rng.dirichlet(np.ones(4), N)
    morph, hanging = rng.normal(size=(N, 3)), rng.normal(size=(3, 3))
    columns = inverse.swapaxes(1, 2).reshape(4, 16)
    arrays = [*(values.astype("<f4") for values in (placed, weights, morph, hanging, columns)), slots]
    body = {"attributes": {"POSITION": 0, "WEIGHTS_0": 1, "JOINTS_0": 5}, "targets": [{"POSITION": 2}]}
    tree = [dict(node) for node in nodes]
    tree[1]["children"] = [2, 6, 8]
    tree[3]["children"] = [4, 7]
    still = {"children": [], "translation": [1, 2, 3], "rotation": [0.6, 0, 0, 0.8], "scale": [2.0] * 3}
    tree += [still | {"mesh": 0, "skin": 0}, still | {"mesh": 1}, still | {"mesh": 1}]  # the last hangs on no joint
    path = tmp_path / "body.glb"
    path.write_bytes(
        packed(
            tree, joints, {"Wave": channels}, arrays,
            skins=[{"joints": joints, "inverseBindMatrices": 4}],
            meshes=[{"primitives": [body], "weights": [0.3]}, {"primitives": [{"attributes": {"POSITION": 3}}]}],
        )
    )  # fmt: skip
    mesh, clip = glb_mesh.read(path), glb.read(path)["Wave"]
    for frame in (0, 7):
        world = by_matrices(tree, channels, frame / 24)
        blended = np.einsum("nk,nkab->nab", weights, np.array([world[joint] for joint in joints] @ inverse)[slots])
        corners = np.column_stack([placed + 0.3 * morph, np.ones(N)])
        expected = [
            np.einsum("nab,nb->na", blended, corners)[:, :3],
            (np.column_stack([hanging, np.ones(3)]) @ world[7].T)[:, :3],
        ]
        np.testing.assert_allclose(skinned(mesh, clip, frame), np.concatenate(expected), atol=2e-4)
    assert mesh.triangle.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    np.testing.assert_allclose(np.linalg.norm(mesh.normal, axis=1), 1)
    across = np.cross(hanging[1] - hanging[0], hanging[2] - hanging[0])
    np.testing.assert_allclose(mesh.normal[-1], across / np.linalg.norm(across), atol=1e-6)


def one_triangle(tmp_path, primitive, arrays=(), **changed):
    """The mesh of a file with a triangle that hangs on the last joint."""
    nodes, joints, channels = random_body(np.random.default_rng(6))
    nodes[-1]["mesh"] = 0
    path = tmp_path / "body.glb"
    arrays = [np.eye(3, dtype="<f4"), *arrays]
    primitive = {"attributes": {"POSITION": 0}} | primitive
    path.write_bytes(
        packed(nodes, joints, {"Wave": channels}, arrays, meshes=[{"primitives": [primitive]}], **changed)
    )
    return glb_mesh.read(path)


def test_colours_are_those_of_material_vertex_and_texture(tmp_path):
    picture = np.zeros((2, 2, 3), dtype=np.uint8)
    picture[0, 1] = [255, 0, 0]
    picture[1, 0] = [188, 188, 188]
    encoded = io.BytesIO()
    Pillow.fromarray(picture).save(encoded, "PNG")
    places, own = np.array([[0.7, 0.2], [1.2, 0.8], [0.2, 0.2]], dtype="<f4"), np.full((3, 4), 0.5, dtype="<f4")
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}
    mesh = one_triangle(
        tmp_path, {"attributes": attributes, "material": 0}, [places, own, np.frombuffer(encoded.getvalue(), "u1")],
        materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 1, 1], "baseColorTexture": {"index": 0}}}],
        textures=[{"source": 0}], images=[{"bufferView": 3, "mimeType": "image/png"}],
    )  # fmt: skip
    grey = 0.5 * ((188 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(mesh.colour, [[0.5, 0, 0], [grey, grey / 2, grey], [0, 0, 0]], atol=1e-6)


def test_a_damaged_texture_leaves_the_base_colour(tmp_path):
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    mesh = one_triangle(
        tmp_path, {"attributes": attributes, "material": 0},
        [np.zeros((3, 2), dtype="<f4"), np.frombuffer(b"\x89PNG\r\n\x1a\nnonsense", "u1")],
        materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 1, 1], "baseColorTexture": {"index": 0}}}],
        textures=[{"source": 0}], images=[{"bufferView": 2, "mimeType": "image/png"}],
    )  # fmt: skip
    assert mesh.colour.tolist() == [[1.0, 0.5, 1.0]] * 3


def test_a_body_without_a_surface_has_no_mesh(tmp_path):
    nodes, joints, channels = random_body(np.random.default_rng(7))
    (tmp_path / "body.glb").write_bytes(packed(nodes, joints, {"Wave": channels}))
    assert glb_mesh.read(tmp_path / "body.glb") is None


@pytest.mark.parametrize(
    ("primitive", "reason"),
    [
        ({"extensions": {"KHR_draco_mesh_compression": {}}}, "compressed"),
        ({"indices": 1}, "vertex that does not exist"),
        ({"attributes": {"POSITION": 9}}, "is damaged"),
    ],
)
def test_a_wrong_mesh_is_one_line(tmp_path, primitive, reason):
    with pytest.raises(UserError, match=reason):
        one_triangle(tmp_path, primitive, [np.array([0, 1, 7], dtype="<u2")])
