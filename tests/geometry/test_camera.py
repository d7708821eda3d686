import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import tables
from cospeech.geometry import camera as lens
from cospeech.geometry.camera import Camera

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")


def filming(name: str = "c1", lens_of: tuple[float, ...] = (-0.12, 0.05, 0.001, -0.0007, 0.004)) -> Camera:
    turn, shift = lens.look(name, [1.5, 1.8, 2.6], [0.0, 1.1, 0.0])
    return Camera(name, (1392, 1040), (1450.0, 1448.0), (702.0, 515.0), lens_of, turn, shift)


def crowd(n: int = 500) -> np.ndarray:
    return np.random.default_rng(5).uniform([-0.9, 0.0, -0.6], [0.9, 2.0, 0.6], (n, 3))


def test_projects_as_opencv() -> None:
    camera = filming()
    expected, _ = cv2.projectPoints(
        crowd(), np.array(camera.turn), np.array(camera.shift_m), camera.intrinsic, np.array(camera.lens)
    )
    np.testing.assert_allclose(lens.project(camera, crowd()), expected[:, 0], atol=1e-8)


def test_a_pixel_leads_back_to_its_point() -> None:
    camera, points = filming(), crowd()
    directions = lens.rays(camera, lens.project(camera, points))
    away = points - camera.place_m
    np.testing.assert_allclose(directions, away / np.linalg.norm(away, axis=1, keepdims=True), atol=1e-10)


@given(
    k1=st.floats(-0.25, 0.25), k2=st.floats(-0.08, 0.08), k3=st.floats(-0.01, 0.01), p1=st.floats(-0.003, 0.003),
    p2=st.floats(-0.003, 0.003), x=st.floats(0, 1391), y=st.floats(0, 1039),
)  # fmt: skip
def test_flattening_inverts_the_lens(
    k1: float, k2: float, k3: float, p1: float, p2: float, x: float, y: float
) -> None:
    camera = filming(lens_of=(k1, k2, p1, p2, k3))
    flat = lens.flatten(camera, np.array([x, y]))
    assert np.abs(lens.distort(camera, flat) * camera.focal_px + camera.centre_px - [x, y]).max() < 1e-5


def test_what_the_lens_cannot_show_is_missing() -> None:
    folding = filming(lens_of=(-2.0, 0.0, 0.0, 0.0, 0.0))
    assert np.isnan(lens.flatten(folding, np.array([5000.0, 5000.0]))).all()


def test_what_is_behind_the_camera_is_missing() -> None:
    camera = filming()
    behind = 2 * camera.place_m - np.array([0.0, 1.1, 0.0])
    assert np.isnan(lens.project(camera, behind)).all()


def test_looks_at_its_target_with_the_world_upright() -> None:
    camera = filming(lens_of=(0.0,) * 5)
    target = np.array([0.0, 1.1, 0.0])
    np.testing.assert_allclose(lens.project(camera, target), camera.centre_px, atol=1e-9)
    above = lens.project(camera, np.array([0.0, 1.2, 0.0]))
    assert above[1] < camera.centre_px[1] - 10
    assert abs(above[0] - camera.centre_px[0]) < 1e-9
    with pytest.raises(ValueError, match="c9 looks straight"):
        lens.look("c9", [0.0, 3.0, 0.0], [0.0, 1.0, 0.0])


def test_a_table_holds_all_there_is_to_a_camera() -> None:
    cameras = [filming("c1"), filming("c2", (0.1, 0.0, 0.0, 0.0, 0.0))]
    table = lens.to_table(cameras).assign(footage="0" * 64)
    tables.validate(table.assign(rms_px=np.nan, n_points=None), "cameras", "here")
    assert lens.from_table(table) == cameras
