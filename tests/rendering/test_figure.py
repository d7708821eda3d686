"""The drawn body stays inside the image and agrees with an independent rasteriser."""

import numpy as np
import pytest
from dancer import motion
from PIL import Image, ImageDraw

from cospeech.motion import skeleton
from cospeech.rendering import body, figure

BOX = (10, 5, 210, 145)
PAINTER = figure.Painter()


def surface(moving, frame, mesh=PAINTER.mesh, rest=PAINTER.rest):
    """The vertices (V, 3) of the body in one frame, by the definition of linear blend skinning."""
    first, second = (
        np.einsum("vab,vb->va", moving.orientation[frame][joint], mesh.position - rest[joint])
        + moving.position[frame][joint]
        for joint in mesh.joint.T
    )
    weight = mesh.weight[:, None]
    return weight * first + (1 - weight) * second


@pytest.mark.parametrize("seed", range(25))
def test_the_figure_never_leaves_the_image(seed):
    rng = np.random.default_rng(seed)
    table = motion(120, seed=seed, walk_m=rng.choice([0, 0.02, 0.1]), turn_deg=rng.uniform(0, 720))
    angles = skeleton.angle_columns(("left_arm", "right_arm", "chest", "left_thigh"))
    table[angles] = rng.uniform(-180, 180, (len(table), len(angles)))  # including impossible poses
    moving = figure.pose(table)
    views = figure.cameras(PAINTER.extent([moving]), BOX)
    assert views[0].box[0] == BOX[0]
    assert views[-1].box[2] == BOX[2]
    assert views[0].box[2] == views[1].box[0]
    for view in views:
        left, top, right, bottom = view.box
        for frame in range(0, len(table), 7):
            x, y = view.project(surface(moving, frame)).T
            assert left <= x.min() <= x.max() <= right
            assert top <= y.min() <= y.max() <= bottom


def test_all_views_show_the_body_at_the_same_scale():
    moving = figure.pose(motion())
    front, side = figure.cameras(PAINTER.extent([moving]), BOX)
    assert front.distance == side.distance
    assert front.focal == side.focal


def test_the_figure_fills_the_image_in_one_direction():
    moving = figure.pose(motion(seed=3))
    view = figure.cameras(PAINTER.extent([moving]), BOX, [0.0])[0]
    pixels = np.concatenate([view.project(surface(moving, frame)) for frame in range(len(moving))])
    used = np.ptp(pixels, axis=0) / (BOX[2] - BOX[0], BOX[3] - BOX[1])
    assert used.max() > 0.85


def draw(moving, view, background=255):
    image = np.full((150, 220, 3), background, dtype=np.uint8)
    drawn = PAINTER.figure(moving, view, floor_m=-100.0)  # the floor is so far below that no shadow is visible
    drawn.draw(image, 0)
    return image


@pytest.mark.parametrize("seed", range(5))
def test_the_silhouette_matches_another_rasteriser(seed):
    moving = figure.pose(motion(seed=seed, turn_deg=180).iloc[[30]])
    for view in figure.cameras(PAINTER.extent([moving]), BOX):
        fine = 8
        plate = Image.new("L", (220 * fine, 150 * fine))
        pen = ImageDraw.Draw(plate)
        corners = view.project(surface(moving, 0)) * fine
        for face in PAINTER.mesh.face:
            pen.polygon([tuple(corner) for corner in corners[face]], fill=255)
        covered = np.asarray(plate.resize((220, 150), Image.Resampling.BOX)) / 255
        ours = draw(moving, view)
        body_drawn = (ours != 255).any(axis=2)
        assert body_drawn[covered > 0.9].all()  # no holes
        assert not body_drawn[covered == 0].any()  # nothing outside the outline
        # On the outline, the background shows through in proportion to the uncovered area, in steps of a quarter.
        edge = (covered > 0) & (covered < 1)
        shares = 1 - np.clip((ours[edge].min(axis=1) - 90.0) / 165, 0, 1)
        assert np.corrcoef(shares, covered[edge])[0, 1] > 0.7


def test_what_is_in_front_hides_what_is_behind():
    angles = np.zeros((2, len(skeleton.JOINTS), 3))
    # The bent forearm is in front of the belly, or behind the back.
    angles[:, skeleton.JOINTS.index("left_arm")] = [[-35, -70, 0], [35, 70, 0]]
    angles[:, skeleton.JOINTS.index("left_forearm"), 0] = [-90, 90]
    table = skeleton.motion_table(np.zeros((2, 3)), angles, 20.0)
    both = figure.pose(table)
    view = figure.cameras(PAINTER.extent([both]), BOX, [0.0])[0]
    sleeve = np.array(figure.COLOURS["left_arm"], dtype=float)
    shirt = np.array(figure.COLOURS["shirt"], dtype=float)
    for frame, (seen, unseen) in enumerate([(sleeve, shirt), (shirt, sleeve)]):
        moving = figure.pose(table.iloc[[frame]])
        middle = (moving.position[0, skeleton.JOINTS.index("left_forearm")] + moving.position[0, 7]) / 2
        column, row = view.project(middle).astype(int)
        colour = draw(moving, view)[row, column].astype(float)
        hue = colour / np.linalg.norm(colour)
        assert hue @ seen / np.linalg.norm(seen) > hue @ unseen / np.linalg.norm(unseen)


def test_left_is_on_the_right_of_the_front_view_and_nearer_in_the_side_view():
    moving = figure.pose(skeleton.motion_table(np.zeros((1, 3)), np.zeros((1, len(skeleton.JOINTS), 3)), 20.0))
    front, side = figure.cameras(PAINTER.extent([moving]), BOX)
    left, right = (moving.position[0, skeleton.JOINTS.index(f"{which}_hand")] for which in ("left", "right"))
    assert front.project(left)[0] > front.project(right)[0]
    assert (left - right) @ side.axes[2] > 0


def test_nothing_is_drawn_outside_the_box():
    moving = figure.pose(motion(seed=1))
    view = figure.cameras(PAINTER.extent([moving]), BOX, [0.0])[0]
    near = figure.Camera(view.axes, view.target, view.distance / 3, view.focal, view.centre, view.box)
    image = np.full((150, 220, 3), 200, dtype=np.uint8)
    PAINTER.figure(moving, near, 0.0).draw(image, 0)
    left, top, right, bottom = BOX
    assert (image[top:bottom, left:right] != 200).any()
    image[top:bottom, left:right] = 200
    assert (image == 200).all()


def test_the_shadow_lies_under_the_feet():
    moving = figure.pose(motion(seed=1))
    view = figure.cameras(PAINTER.extent([moving]), BOX, [0.0])[0]
    floor_m = figure.floor_height([moving])
    assert abs(floor_m) < 0.01
    image = np.full((150, 220, 3), 255, dtype=np.uint8)
    PAINTER.figure(moving, view, floor_m).draw(image, 0)
    bare = draw(figure.pose(motion(seed=1).iloc[[0]]), view)
    darkened = np.argwhere((image < bare).any(axis=2))
    foot = view.project(moving.position[0, skeleton.JOINTS.index("left_foot")])[1]
    assert np.abs(darkened[:, 0] - foot).mean() < 12


@pytest.mark.parametrize("detail", [1, 3])
def test_the_surface_is_closed_and_oriented_outward(detail):
    mesh = body.mesh(detail)
    a, b, c, d = (mesh.position[mesh.face[:, k]].astype(float) for k in range(4))
    across = np.cross(c - a, d - b)
    assert np.linalg.norm(mesh.normal, axis=1) == pytest.approx(1, abs=1e-3)
    along = np.einsum("fa,fa->f", across, mesh.normal[mesh.face].mean(axis=1))
    assert (along[np.linalg.norm(across, axis=1) > 1e-6] > 0).all()
    assert np.einsum("fa,fa->", a + b + c + d, across) / 24 == pytest.approx(
        0.07, abs=0.02
    )  # volume of an adult in m3
    sides = mesh.position[:, 0].min(), mesh.position[:, 0].max()
    assert sides[0] == pytest.approx(-sides[1])
    assert set(mesh.material.tolist()) == set(range(len(body.MATERIALS)))
