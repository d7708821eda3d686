"""Both trackers on short films of the virtual studio, compared with the ground truth."""

import weakref

import numpy as np
import pandas as pd
import pytest

from cospeech.capture.tracking import clicks, colour, detections, first_positions, footage, quality_sheet, track
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.geometry.camera import project
from cospeech.motion import skeleton
from cospeech.motion.markers import MARKERS, NAMES
from cospeech.studio import dress, film, rig, stage

N_FRAMES = 24
HAND = NAMES.index("left_hand")


def filmed(folder, angles):
    """Film joint angles (T, J, 3) at half size.

    Returns the films, the cameras, the true markers (T, 15, 3) and their numbers of visible pixels (T, 15, C).
    """
    motion = skeleton.motion_table(np.zeros((len(angles), 3)), angles, rig.FPS)
    limbs, markers = stage.limbs(motion), dress.wear(motion, dress.places("ada", 1))
    cameras = rig.cameras(696, 1)
    pixels = []
    for camera in cameras:
        shown = np.empty(markers.shape[:2])
        pictures = film.record_visibility(film.frames(camera, limbs, markers, 1), shown)
        film.encode(folder / f"{camera.name}.mkv", pictures, rig.FPS)
        pixels.append(shown)
    return (
        [footage.probe(folder / f"{camera.name}.mkv") for camera in cameras],
        cameras,
        markers,
        np.stack(pixels, axis=2),
    )


def arms(swing, upward, inward, outward, bend):
    """Return angles (T, J, 3) of arms that move from hanging to the given angles and back with ``swing`` (T,)."""
    angles = np.zeros((len(swing), len(skeleton.JOINTS), 3))
    for side, sign, up in (("left", 1, upward[0]), ("right", -1, upward[1])):
        angles[:, skeleton.JOINTS.index(f"{side}_arm"), 0] = up * swing
        angles[:, skeleton.JOINTS.index(f"{side}_arm"), 1] = -sign * inward * swing
        angles[:, skeleton.JOINTS.index(f"{side}_arm"), 2] = sign * (4 + outward * swing)
        angles[:, skeleton.JOINTS.index(f"{side}_forearm"), 0] = -5 + bend * swing
    return angles


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """The result of ``filmed`` for arms that swing up and back."""
    swing = np.sin(np.pi * np.arange(N_FRAMES) / rig.FPS / 1.2) ** 2
    return filmed(tmp_path_factory.mktemp("take"), arms(swing, (-50, -50), 0, 15, -80))


@pytest.fixture(scope="module")
def robust(take):
    films, cameras, *_ = take
    return track.track_markers(films, cameras, "robust", N_FRAMES, where="take")


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


def clicked(cameras, markers, frame=0):
    rows = [
        (frame, camera.name, name, *np.round(project(camera, markers[frame, m])))
        for m, name in enumerate(NAMES)
        for camera in cameras
    ]
    return pd.DataFrame(rows, columns=clicks.COLUMNS)


def test_robust_tracker_finds_the_planted_markers_at_half_size(take, robust):
    _, cameras, markers, pixels = take
    truth = np.stack([project(camera, markers) for camera in cameras], axis=2)
    assert rms(np.linalg.norm(robust.pixels - truth, axis=-1)) < 0.2
    world = detections.world_table(robust, rig.FPS, 0.5)
    points = world[["x_m", "y_m", "z_m"]].to_numpy().reshape(N_FRAMES, -1, 3)
    seen = (world["status"] == "seen").to_numpy().reshape(N_FRAMES, -1)
    away = np.linalg.norm(points - markers, axis=2)
    assert rms(away[seen]) < 1e-3
    assert np.nanmax(away) < 0.03
    assert seen[(pixels > 20).sum(axis=2) >= 2].all()  # a whole disc has 66


def test_hands_that_cross_in_front_of_the_chest_are_not_swapped(tmp_path):
    """Both hands are red, come within 56 mm of each other, and change sides twice."""
    swing = np.sin(np.pi * np.arange(30) / rig.FPS / 1.5) ** 2
    films, cameras, markers, _ = filmed(tmp_path, arms(swing, (-30, -38), 85, -4, -80))
    hands = [HAND, NAMES.index("right_hand")]
    left, right = np.moveaxis(markers[:, hands], 1, 0)
    crossed = left[:, 0] < right[:, 0]  # x is to the actor's left
    assert (np.diff(crossed.astype(int)) != 0).sum() == 2
    assert np.linalg.norm(left - right, axis=1).min() < 0.06
    found = track.track_markers(films, cameras, "robust", 30, where="take").points_m[:, hands]
    seen = np.isfinite(found[..., 0])
    assert seen.mean() > 0.8
    assert np.linalg.norm(found - markers[:, hands], axis=2)[seen].max() < 0.02


def test_memory_does_not_grow_with_the_length_of_the_film(take, monkeypatch):
    films, cameras, *_ = take
    held, most, planes = set(), [], footage.planes

    def counted(frame, quarter_turns):
        read = planes(frame, quarter_turns)
        for plane in read:
            held.add(id(plane))
            weakref.finalize(plane, held.discard, id(plane))
        most[-1] = max(most[-1], len(held))
        return read

    monkeypatch.setattr(footage, "planes", counted)
    for n_frames in (3, 12):
        most.append(0)
        track.track_markers(films, cameras, "robust", n_frames, where="take")
        assert not held
    assert most[0] == most[1] <= 2 * len(cameras) * 3  # three planes each of the current and the next set of images


def test_the_tables_match_their_schemas(take, robust):
    _, cameras, *_ = take
    world = detections.world_table(robust, rig.FPS, 0.5)
    tables.validate(world, "markers_3d", "world")
    views = detections.view_table(robust, world, cameras)
    tables.validate(views, "markers_2d", "views")
    assert len(views) == N_FRAMES * len(NAMES) * len(cameras)
    assert views.loc[views["status"] == "seen", "n_pixels"].min() > 5
    assert views.loc[views["status"] == "predicted", "n_pixels"].isna().all()
    tables.validate(quality_sheet.spans(world), "marker_spans", "spans")


def test_the_tracker_of_the_thesis_is_less_accurate(take, robust):
    films, cameras, markers, _ = take
    plain = track.track_markers(films, cameras, "thesis", N_FRAMES, clicked=clicked(cameras, markers), where="take")
    assert rms(plain.points_m - markers) > 3 * rms(robust.points_m - markers)


def test_clicks_initialise_the_tracker_as_well_as_colours_do(take, robust):
    films, cameras, markers, _ = take
    by_hand = track.track_markers(films, cameras, "robust", 3, clicked=clicked(cameras, markers), where="take")
    np.testing.assert_allclose(by_hand.points_m, robust.points_m[:3], atol=1e-3)


def test_a_correction_overrides_its_view_and_frame(take):
    films, cameras, markers, _ = take
    place = project(cameras[4], markers[2, HAND]) + np.array([0.5, 0.0])
    row = pd.DataFrame([(2, "c5", "left_hand", *place)], columns=clicks.COLUMNS)
    found = track.track_markers(films, cameras, "robust", 4, corrections=row, where="take")
    world = detections.world_table(found, rig.FPS, 0.5)
    views = detections.view_table(found, world, cameras)
    corrected = views[views["status"] == "corrected"]
    assert corrected[["frame", "camera", "marker"]].to_numpy().tolist() == [[2, "c5", "left_hand"]]
    np.testing.assert_allclose(corrected[["x_px", "y_px"]].to_numpy()[0], place)
    assert world.loc[world["status"] == "corrected", ["frame", "marker"]].to_numpy().tolist() == [[2, "left_hand"]]


def test_invalid_clicks_are_reported(take, tmp_path):
    _, cameras, markers, _ = take
    good = clicked(cameras, markers)
    path = tmp_path / "take.csv"
    for change, message in [
        ({"camera": "c9"}, r"take\.csv: line 2: no camera 'c9'"),
        ({"marker": "nose"}, r"line 2: no marker 'nose'"),
        ({"frame": 99}, "line 2: no frame 99; the frames of the take are 0 to 23"),
        ({"x_px": 5000.0}, r"line 2: \(5000, .*lies outside the 696x520 image"),
        ({"marker": good["marker"][1], "camera": good["camera"][1]}, "line 3 repeats an earlier line"),
    ]:
        bad = good.copy()
        for column, value in change.items():
            bad.loc[0, column] = value
        bad.to_csv(path, index=False)
        with pytest.raises(UserError, match=message):
            clicks.read(path, cameras, N_FRAMES)
    good.drop(columns="x_px").to_csv(path, index=False)
    with pytest.raises(UserError, match="column x_px is missing"):
        clicks.read(path, cameras, N_FRAMES)
    with pytest.raises(UserError, match="no such file"):
        clicks.read(tmp_path / "none.csv", cameras, N_FRAMES)
    hidden = good[(good["marker"] != "chest") | (good["camera"] == "c1")]
    with pytest.raises(UserError, match="marker chest is clicked in 1 views of frame 0"):
        first_positions.from_clicks(hidden, cameras, "take")
    crossed = good.copy()
    crossed.loc[(good["marker"] == "chest") & (good["camera"] != "c3"), "y_px"] += np.array([90, -80, 70, -60])
    with pytest.raises(UserError, match="clicks on marker chest in frame 0 do not meet"):
        first_positions.from_clicks(crossed, cameras, "take")


def test_missing_markers_are_reported(take, monkeypatch):
    _, cameras, *_ = take
    empty = [tuple(np.full((520, 696), value, dtype=np.uint8) for value in (20, 128, 128)) for _ in cameras]
    unmixers = colour.unmixers(colour.chroma(colour.SKIN))
    with pytest.raises(UserError, match=r"take: 0 of 15 markers found in frame 0; .* 15 coloured discs"):
        first_positions.find(empty, cameras, unmixers, "take")

    def all_but_the_hands(pictures, cameras, colour):
        places = [first_positions.NOMINAL_M[m.name] for m in MARKERS if m.colour == colour != "red"]
        return np.array(places).reshape(-1, 3), np.full(len(places), 5)

    monkeypatch.setattr(first_positions, "_points", all_but_the_hands)
    with pytest.raises(UserError, match=r"take: left_hand, right_hand not found in frame 0; click them"):
        first_positions.find(empty, cameras, {name: name for name in unmixers}, "take")


def test_spans_and_worst_moments():
    status = ["seen", "predicted", "predicted", "seen", "lost"]
    world = pd.DataFrame(
        [
            (t, (t + 0.5) / 20, name, "seen" if name != "chest" else status[t], 0.1 + (name == "back") * t)
            for t in range(5)
            for name in NAMES
        ],
        columns=["frame", "time_s", "marker", "status", "residual_px"],
    )
    spans = quality_sheet.spans(world)
    assert spans.to_numpy().tolist() == [["chest", "predicted", 1, 3, 0.1], ["chest", "lost", 4, 5, 0.05]]
    worst = quality_sheet.worst_moments(world, 2)
    assert worst[["frame", "marker"]].to_numpy().tolist() == [[4, "chest"], [4, "back"]]
    assert "chest: seen 40.0 %, corrected 0.0 %, predicted 40.0 %, lost 20.0 %" in quality_sheet.summary(world)[3]
