"""Films overlaid with markers: each ring is at its marker, in the colour of its status."""

import numpy as np
import pandas as pd
import pytest

from cospeech.capture.tracking import footage, overlay, quality_sheet
from cospeech.data import tables, trajectories
from cospeech.geometry.camera import Camera, look, project
from cospeech.motion.markers import NAMES
from cospeech.studio import film

N_FRAMES = 4
CHEST, BACK = NAMES.index("chest"), NAMES.index("back")


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """Dark films of two cameras, and stationary markers on a wall; the marker ``back`` is lost from frame 2 on."""
    folder = tmp_path_factory.mktemp("films")
    cameras = []
    for name, x in (("c1", -0.5), ("c2", 0.5)):
        turn, shift = look(name, (x, 1.0, 3.0), (0.0, 1.0, 0.0))
        cameras.append(Camera(name, (160, 120), (150.0, 150.0), (79.5, 59.5), turn=turn, shift_m=shift))
        film.encode(folder / f"{name}.mkv", [np.full((3, 120, 160), 128, np.uint8)] * N_FRAMES, 20.0)
    across, up = np.meshgrid(np.linspace(-0.6, 0.6, 5), np.linspace(0.6, 1.4, 3))
    places = np.tile(np.column_stack([across.ravel(), up.ravel(), np.zeros(15)]), (N_FRAMES, 1, 1))
    places[2:, BACK] = np.nan
    world = trajectories.to_table(places, NAMES, 20.0)
    views = []
    for camera in cameras:
        pixels = project(camera, places).reshape(-1, 2)
        view = world[["frame", "marker", "status"]].assign(camera=camera.name, x_px=pixels[:, 0], y_px=pixels[:, 1])
        views.append(view.assign(n_pixels=pd.array([9] * len(view), dtype="Int64")))
    views = pd.concat(views, ignore_index=True)
    views.loc[(views["marker"] == "chest") & (views["frame"] == 1), "status"] = "predicted"
    return [footage.probe(folder / f"{camera.name}.mkv") for camera in cameras], cameras, views, world, places


def coloured(image, colour, below=0):
    """Return x and y (n, 2) of the pixels of a colour, from row ``below`` on."""
    x_y = np.argwhere((np.abs(image[below:].astype(int) - colour) < 40).all(axis=2))[:, ::-1]
    return x_y + np.array([0, below])


def test_a_lost_marker_is_drawn_at_its_last_known_position(take):
    views = take[2]
    filled = quality_sheet.nearest_known(views)
    own = filled[(filled["marker"] == "back") & (filled["camera"] == "c2")].sort_values("frame")
    assert own["x_px"].tolist() == [own["x_px"].iloc[0]] * N_FRAMES
    early = views.assign(x_px=views["x_px"].where(views["frame"] > 0), y_px=views["y_px"].where(views["frame"] > 0))
    assert quality_sheet.nearest_known(early).loc[early["frame"] == 0, "x_px"].notna().all()


def test_the_mosaic_has_a_ring_for_every_marker_in_every_view(take):
    takes, cameras, views, *_ = take
    images = [image.copy() for image in overlay.mosaic(takes, cameras, views, 20.0, "x")]
    assert len(images) == N_FRAMES
    height, width = images[0].shape[:2]
    assert height == overlay.TILE_PX
    assert width % 2 == 0
    views_only = [image[:, : 2 * width // 3] for image in images]
    assert len(coloured(views_only[0], overlay.COLOURS["lost"])) == 0
    assert len(coloured(views_only[0], overlay.COLOURS["predicted"])) == 0
    one = len(coloured(views_only[1], overlay.COLOURS["predicted"])) / 2
    lost = len(coloured(views_only[2], overlay.COLOURS["lost"])) / 2
    seen = len(coloured(views_only[0], overlay.COLOURS["seen"])) / 2
    assert one > 20
    assert lost == pytest.approx(one, rel=0.3)
    assert seen == pytest.approx(15 * one, rel=0.3)


def test_a_moment_shows_its_marker_in_the_centre_and_its_projected_position(take):
    takes, cameras, views, world, _ = take
    moments = quality_sheet.worst_moments(world, 1)
    assert moments[["frame", "marker", "status"]].to_numpy().tolist() == [[2, "back", "lost"]]
    chest = moments.assign(frame=1, marker="chest", status="seen")
    table = quality_sheet.in_views(pd.concat([moments, chest]), views)
    tables.validate(table, "worst_moments", "x")
    assert table["camera"].tolist() == ["c1", "c2"] * 2
    assert table["view_status"].tolist() == ["lost"] * 2 + ["predicted"] * 2
    lost, found = overlay.moments(table, takes, cameras, views, world)
    assert lost.shape == (overlay.CROP_PX, 2 * overlay.CROP_PX, 3)
    middle = overlay.CROP_PX / 2
    for picture, status in ((lost, "lost"), (found, "predicted")):
        ring = coloured(picture[:, : overlay.CROP_PX], overlay.COLOURS[status], below=30)
        np.testing.assert_allclose((ring.min(axis=0) + ring.max(axis=0)) / 2, middle, atol=6)
    assert not len(coloured(lost[:, : overlay.CROP_PX - 4], (255, 255, 255), below=30))  # no 3D position
    cross = coloured(found[:, : overlay.CROP_PX - 4], (255, 255, 255), below=30)
    np.testing.assert_allclose(cross.mean(axis=0), middle, atol=6)
