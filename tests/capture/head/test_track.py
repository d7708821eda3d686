"""The pose of a real face with planted motion, in stereo and from one camera, and films that are refused."""

import cv2
import numpy as np
import pictures
import planted_head
import pytest

from cospeech.capture.head import films, optics
from cospeech.capture.head.track import track, track_images
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.formats import camera_toml

SETTINGS = {
    "flow": "warped",
    "rigid": "reprojection",
    "increments": "composed",
    "smoothing": "none",
    "longest_hidden_s": 0.2,
    "head_width_m": 0.15,
}
SCENE = planted_head.Scene(planted_head.cameras(320), noise=1.5)
FPS = 30.0


def motion(n, amplitude=30.0):
    """Angles (n, 3) in degrees and displacements (n, 3) in metres of a head that moves about all axes at once."""
    time = np.arange(n) / FPS
    angles = amplitude * np.sin(2 * np.pi * time[:, None] * (0.6, 0.83, 0.47)) * (0.8, 1.0, 0.7)
    return angles, 0.01 * np.sin(time[:, None] * (2.0, 3.1, 4.2))


def shoot(angles, shifts, scene=SCENE, change=None):
    """The planes of both views of each frame; ``change(frame, picture, camera)`` may paint over the pictures."""
    return [
        planted_head.pair(
            scene, angle, shift, n, change and (lambda picture, camera, n=n: change(n, picture, camera))
        )
        for n, (angle, shift) in enumerate(zip(angles, shifts, strict=True))
    ]


def tracked(views, scene=SCENE, **changes):
    """The table and the notes of a film; of one camera if there is one view per frame."""
    own = optics.single(scene.cameras[0]) if len(views[0]) == 1 else optics.rectified(scene.cameras)[0]
    return track_images(iter(views), own, SETTINGS | changes, FPS, "ada_1")


def errors(found, angles):
    return np.abs(found.table[["x_deg", "y_deg", "z_deg"]].to_numpy() - angles)


@pytest.fixture(scope="module")
def film():
    """Angles (T, 3), displacements (T, 3) in metres, and the images of a short film."""
    angles, shifts = motion(36)
    return angles, shifts, shoot(angles, shifts)


def test_a_stereo_film_gives_angles_to_a_degree_and_places_to_millimetres(film):
    angles, shifts, views = film
    found = tracked(views)
    off = errors(found, angles)
    assert np.abs(angles).max() > 29
    assert off.mean() < 0.7
    assert off.max() < 2.0
    moved = found.table[["tx_m", "ty_m", "tz_m"]].to_numpy() - shifts
    assert np.abs(moved).mean() < 0.006
    assert (found.table["status"] == "tracked").all()
    assert set(found.table["depth"]) == {"disparity"}
    assert found.notes == []
    tables.validate(found.table, "head_pose", "poses")


def test_every_fit_of_the_pose_is_accurate_and_those_in_space_agree(film):
    angles, _, views = film
    found = {rigid: tracked(views, rigid=rigid) for rigid in ("svd", "newton", "newton_printed")}
    for one in found.values():
        assert errors(one, angles).mean() < 2.0
    exact = found["svd"].table[["x_deg", "y_deg", "z_deg"]].to_numpy()
    for rigid in ("newton", "newton_printed"):
        own = found[rigid].table[["x_deg", "y_deg", "z_deg"]].to_numpy()
        np.testing.assert_allclose(own, exact, atol=1e-6)


def test_the_printed_flow_is_less_accurate_and_added_angles_drift(film):
    angles, _, views = film
    warped = errors(tracked(views), angles).mean()
    composed, added = (
        errors(tracked(views, flow="printed", increments=one), angles) for one in ("composed", "added")
    )
    assert np.nanmean(composed) > 1.5 * warped
    beyond = np.flatnonzero(np.abs(angles).max(axis=1) > 27)
    assert np.nanmean(added[beyond]) > 1.15 * np.nanmean(composed[beyond])


def test_one_camera_gives_approximate_angles_and_says_so(film):
    angles, _, views = film
    found = tracked([view[:1] for view in views])
    assert errors(found, angles).mean() < 1.0
    assert set(found.table["depth"]) == {"ellipsoid"}
    with pytest.raises(UserError, match="'printed' needs a stereo pair"):
        track_images(
            iter([view[:1] for view in views]),
            optics.single(SCENE.cameras[0]),
            SETTINGS | {"flow": "printed"},
            FPS,
            "a",
        )


def paint_hand(frame, picture, camera):
    """A hand of the colour of skin passes in front of the lower half of the face, nearer to the camera."""
    if 8 <= frame < 26:
        x = camera.size_px[0] // 2 + (frame - 17) * 5 + (18 if camera.name == "left" else -18)
        cv2.ellipse(picture, (x, 150), (24, 15), 15.0, 0, 360, (120.0, 150.0, 205.0), -1)


def test_a_hand_in_front_of_the_face_is_survived():
    angles, shifts = motion(32, amplitude=12.0)
    found = tracked(shoot(angles, shifts, change=paint_hand))
    off = errors(found, angles)
    assert np.nanmax(off) < 2.5
    assert np.isfinite(off[30:]).all()
    assert np.isfinite(off).mean() > 0.8


def test_a_face_that_leaves_and_returns_is_found_again():
    angles, shifts = motion(40, amplitude=6.0)
    shifts[12:26, 0] += 0.45
    shifts[26:, 0] += 0.08
    found = tracked(shoot(angles, shifts))
    status = found.table["status"].to_numpy()
    assert (status[:12] == "tracked").all()
    assert (status[12:26] == "lost").all()
    assert (status[33:] == "tracked").all()
    assert np.nanmax(errors(found, angles)) < 2.0
    (note,) = found.notes
    assert note.startswith("ada_1: ")
    assert "the first is frame 12 (0.42 s)" in note


def still(n=1, **changes):
    return shoot(np.zeros((n, 3)), np.zeros((n, 3)), **changes)


def dark(planes):
    return tuple(np.full_like(plane, value) for plane, value in zip(planes, (5, 128, 128), strict=True))


def rolled(planes, rows):
    return tuple(np.roll(plane, rows, axis=0) for plane in planes)


def two_faces(frame, picture, camera):
    middle = picture.shape[1] // 2
    shift = 18 if camera.name == "left" else -18
    window = picture[40:200, middle - 60 + shift : middle + 60 + shift].copy()
    picture[40:200, 5:125], picture[40:200, 190:310] = window, window


def test_films_that_cannot_be_measured_are_refused_in_one_line():
    ((left, right),) = still()
    blank = tuple(np.full_like(plane, 120) for plane in left)
    refused = {
        r"ada_1: frame 0, right film: the image is dark": [(left, dark(right))],
        r"ada_1: frame 0: the image is dark": [(dark(left), right)],
        r"ada_1: frame 0: .* the films are swapped": [(right, left)],
        r"ada_1: frame 0: not rectified: .* 4\.\d pixels lower": [(left, rolled(right, 4))],
        r"ada_1: frame 0: the face of the left film is not seen": [(left, rolled(right, 60))],
        r"ada_1: no face in frames 0 to 4 \(0.2 s\)": [(blank, blank)] * 5,
        r"ada_1: frame 0: two faces": still(change=two_faces),
    }
    for message, views in refused.items():
        with pytest.raises(UserError, match=message) as caught:
            tracked(views)
        assert "\n" not in str(caught.value)


def test_a_film_without_a_face_is_refused_before_its_end(monkeypatch):
    monkeypatch.setattr("cospeech.capture.head.track.FACE_WITHIN_S", 0.5)
    blank = tuple(np.full_like(plane, 120) for plane in still()[0][0])
    views = iter([(blank, blank)] * 100)
    with pytest.raises(UserError, match="no face in frames 0 to 15"):
        track_images(views, optics.rectified(SCENE.cameras)[0], SETTINGS, FPS, "ada_1")
    assert len(list(views)) > 50


def test_a_head_that_is_lost_most_of_the_time_is_refused_with_the_reason():
    views = still(4)
    with pytest.raises(
        UserError, match=r"16 of 20 frames not measured, 16 of them lost; the first is frame 4 .* dark"
    ):
        tracked(views + [tuple(dark(planes) for planes in views[0])] * 16)


def test_a_right_camera_that_goes_dark_is_reported_and_the_left_one_measured():
    views = still(12)
    found = tracked(views[:4] + [(left, dark(right)) for left, right in views[4:8]] + views[8:])
    assert (found.table["status"] == "tracked").all()
    assert found.notes == [
        "ada_1: the right film is dark in 4 frames, the first of them frame 4 (0.15 s); only the left film was "
        "measured there"
    ]


def test_a_head_that_moves_too_fast_is_lost_with_the_speed_as_the_reason():
    shifts = np.zeros((14, 3))
    shifts[6:, 0] = 0.12 * np.sin(np.arange(8) * 1.9)
    (note,) = tracked(shoot(np.zeros((14, 3)), shifts)).notes
    assert "the first is frame 7 (0.25 s), after a motion of " in note
    assert "too fast for the optical flow" in note


def test_films_and_their_calibration_are_matched_by_name(tmp_path):
    views = still(3)
    for number, camera in enumerate(SCENE.cameras):
        pictures.write(tmp_path / f"{camera.name}.mkv", [np.stack(view[number]) for view in views], fps=30)
    (tmp_path / "rig.toml").write_text(camera_toml.toml(SCENE.cameras), encoding="utf-8")
    rig, paths = str(tmp_path / "rig.toml"), [str(tmp_path / f"{name}.mkv") for name in ("right", "left")]
    known = films.cameras(paths, rig)
    assert [camera.name for camera in known] == ["right", "left"]
    found = track(films.probed(paths), known, SETTINGS, 0, "ada_1")
    assert np.abs(found.table[["x_deg", "y_deg", "z_deg"]].to_numpy()).max() < 1.0
    mono = track(films.probed(paths[1:]), films.cameras(paths[1:], None, 448.0), SETTINGS, 0, "ada_1")
    assert set(mono.table["depth"]) == {"ellipsoid"}
    assert [camera.name for camera in films.cameras(["one.mkv", "two.mkv"], rig)] == ["left", "right"]
    with pytest.raises(UserError, match="2 cameras for 1 film; name each film after its camera"):
        films.cameras(["one.mkv"], rig)
    with pytest.raises(UserError, match="stereo pair need a calibration"):
        films.cameras(paths, None, 448.0)
    with pytest.raises(UserError, match="declare focal_35mm"):
        films.cameras(paths[:1], None)
    with pytest.raises(UserError, match="focal_px: 35 is impossible for images of 320 x 240 pixels; give it in pix"):
        films.cameras(paths[:1], None, 35.0)
    with pytest.raises(UserError, match=r"focal_35mm: 5\.4 is impossible .*; give the 35 mm equivalent"):
        films.cameras(paths[:1], None, focal_35mm=5.4)
    with pytest.raises(UserError, match="3 films of a head"):
        films.probed([*paths, paths[0]])


@pytest.mark.parametrize("shape", [(240, 320), (320, 240)])
def test_a_film_shows_the_full_width_of_a_sensor_whose_diagonal_counts_for_the_equivalent_focal_length(
    tmp_path, shape
):
    """A lens of 43.27 mm has a focal length of one diagonal of 35 mm film, 400 pixels of a 4:3 image of 320 x 240."""
    pictures.write(tmp_path / "phone.mkv", [np.full((3, *shape), 128, dtype=np.uint8)] * 3, fps=30)
    (camera,) = films.cameras([str(tmp_path / "phone.mkv")], None, focal_35mm=43.27)
    assert camera.focal_px == pytest.approx((400.0, 400.0), rel=1e-3)
    assert camera.centre_px == ((shape[1] - 1) / 2, (shape[0] - 1) / 2)


def test_films_of_different_length_or_rate_are_refused(tmp_path):
    views = still(4)
    left, right = tmp_path / "left.mkv", tmp_path / "right.mkv"
    pictures.write(left, [np.stack(view[0]) for view in views], fps=30)
    pictures.write(right, [np.stack(view[1]) for view in views[:2]], fps=30)
    with pytest.raises(UserError, match="4 frames, but the shortest view has 2"):
        track(films.probed([str(left), str(right)]), SCENE.cameras, SETTINGS, 1, "ada_1")
    pictures.write(right, [np.stack(view[1]) for view in views], fps=25)
    with pytest.raises(UserError, match=r"25 frames/s, but left\.mkv has 30"):
        track(films.probed([str(left), str(right)]), SCENE.cameras, SETTINGS, 1, "ada_1")


def test_the_same_film_gives_the_same_numbers(film):
    _, _, views = film
    first, again = (tracked(views[:12]).table for _ in range(2))
    assert first.equals(again)
