"""Lips: planted motion is found, on textures, on virtual faces and on a real one; unusable films are refused."""

from dataclasses import replace
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from scipy import ndimage
from scipy.fft import dctn
from skimage import data as pictures

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.identity.lips import alignment, features, mouth
from cospeech.identity.lips.mouth import Face
from cospeech.studio import film as camera
from cospeech.studio.population import drawing, face, film, phones, planting, speakers
from cospeech.studio.population.settings import Settings

SEED = 3
FACE = Face(110.0, 90.0, 120.0, 110.0, 126.0)


def texture(seed):
    """Return a smooth picture, as a function of places (..., 2), like a face: in greys from 60 to 200."""
    rng = np.random.default_rng(seed)
    waves, phases = rng.normal(0.0, 0.16, (40, 2)), rng.uniform(0.0, 2 * np.pi, 40)
    return lambda places: 130.0 + 12.0 * np.sin(places @ waves.T + phases).sum(axis=-1)


def planted_motion(rng):
    """Return 12 parameters (2, 6): up to about 8 pixels of shift, 6 degrees, and some curvature."""
    return rng.normal(0.0, 1.0, (2, 6)) * np.array([4.0, 3.0, 3.0, 1.0, 1.0, 1.0])


def first_places(places, motion):
    """Return where places (..., 2) of a moved picture are in the first one, by iteration."""
    middle, unit = np.array([FACE.x, FACE.y]), FACE.width / 2
    back = places.copy()
    for _ in range(60):
        back = places - alignment.monomials((back - middle) / unit) @ motion.T
    return back


def grid(height, width):
    return np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)


def as_seen(values, rng, noise=2.0):
    return np.clip(values + noise * rng.standard_normal(values.shape) + 0.5, 0, 255).astype(np.uint8)


def root_mean_square(reference, aligned, motion):
    """Return the error of an alignment over the lip region and the face, in pixels."""
    places = np.concatenate([features.region_grid(FACE)[::8, ::8].reshape(-1, 2), reference.levels[-1].places[::50]])
    truth = places + alignment.monomials((places - reference.middle) / reference.unit) @ motion.T
    return np.sqrt(((alignment.moved(reference, aligned, places) - truth) ** 2).sum(axis=1).mean())


DISTURBED = {
    "noise": lambda values, rng: values,
    "light": lambda values, rng: values * 1.25 - 20.0 + np.linspace(-8.0, 8.0, values.shape[1]),
    "occlusion": lambda values, rng: np.where(hand(values.shape, rng), 40.0, values),
}


def hand(shape, rng):
    """Return a mask (H, W) of something that hides a part of the face."""
    y, x = np.indices(shape)
    place = (60.0 if rng.random() < 0.5 else 160.0, rng.uniform(50.0, 90.0))
    return np.hypot(x - place[0], (y - place[1]) / 1.4) < 20.0


@pytest.mark.parametrize("disturbance", DISTURBED)
@pytest.mark.parametrize("seed", range(4))
def test_twelve_planted_parameters_are_recovered(disturbance, seed):
    rng = np.random.default_rng(seed)
    picture, motion = texture(seed), planted_motion(rng)
    reference = alignment.reference(as_seen(picture(grid(190, 220)), rng), FACE)
    moved = DISTURBED[disturbance](picture(first_places(grid(190, 220), motion)), rng)
    aligned = alignment.align(reference, as_seen(moved, rng), alignment.STILL)
    assert not aligned.lost(FACE)
    assert root_mean_square(reference, aligned, motion) < 0.15


def test_gain_and_offset_of_the_light_are_recovered():
    rng = np.random.default_rng(1)
    values = texture(1)(grid(190, 220))
    reference = alignment.reference(as_seen(values, rng), FACE)
    aligned = alignment.align(reference, as_seen(0.8 * values + 15.0, rng), alignment.STILL)
    np.testing.assert_allclose(aligned.light, [0.8, 15.0], rtol=0.02)


def test_another_picture_counts_as_lost():
    rng = np.random.default_rng(1)
    reference = alignment.reference(as_seen(texture(1)(grid(190, 220)), rng), FACE)
    other = as_seen(texture(2)(grid(190, 220)), rng)
    assert alignment.align(reference, other, alignment.STILL).lost(FACE)


@pytest.fixture(scope="module")
def astronaut():
    return cv2.cvtColor(pictures.astronaut(), cv2.COLOR_RGB2GRAY)[:300, 60:400]


def test_the_mouth_of_a_real_face_is_found(astronaut):
    found = mouth.find(astronaut, "astronaut")
    assert np.hypot(found.mouth_x - 163.0, found.mouth_y - 145.0) < 0.05 * found.width


@pytest.mark.parametrize("seed", range(4))
def test_a_real_face_is_aligned_after_a_known_motion(astronaut, seed):
    rng = np.random.default_rng(seed)
    found = mouth.find(astronaut, "astronaut")
    reference = alignment.reference(astronaut, found)
    motion = 0.6 * planted_motion(rng)
    places = grid(*astronaut.shape)
    back = places.copy()
    for _ in range(40):
        back = places - alignment.monomials((back - reference.middle) / reference.unit) @ motion.T
    seen = cv2.remap(astronaut, *np.moveaxis(back.astype(np.float32), 2, 0), cv2.INTER_CUBIC)
    aligned = alignment.align(reference, as_seen(0.9 * seen + 10.0, rng), alignment.STILL)
    lips = features.region_grid(found)[::8, ::8]
    truth = lips + alignment.monomials((lips - reference.middle) / reference.unit) @ motion.T
    assert np.sqrt(((alignment.moved(reference, aligned, lips) - truth) ** 2).sum(axis=-1).mean()) < 0.15


@pytest.fixture(scope="module")
def speaker():
    """A virtual face, something that it says, and how."""
    settings = Settings(4, 2, 1, 1.0, 1.0, 1.0, 40.0, 2, 15.0, True, True)
    everyone = speakers.population(settings, SEED)
    own = face.face(everyone[0], 1.0, SEED)
    one = speakers.utterances(everyone, everyone[0], settings, SEED)[0]
    return own, one, planting.utter(one, everyone, settings, SEED)


@pytest.fixture(scope="module")
def talk(speaker):
    """The frames of a virtual face that speaks, its poses, and the middle of the mouth in the first frame."""
    own, one, how = speaker
    frames = [planes.copy() for planes in film.frames(own, one, how, 15.0, SEED)]
    poses = [film.pose(head) for head in film.motion(one, (np.arange(len(frames)) + 0.5) / 15.0, SEED)]
    return frames, poses, in_film(poses[0], np.array([0.0, own.mouth.height]))


def in_film(pose, points):
    """Return where points (..., 2) of the plane of a virtual face are in the film."""
    wide, high = points[..., 0] / face.HALF_WIDTH, points[..., 1] / face.HALF_HEIGHT
    depth = float(drawing.DEPTH) * (1.0 - wide**2 - high**2)
    turned = points @ np.linalg.inv(pose[:4].reshape(2, 2).astype(float)).T
    return turned + depth[..., None] * pose[4:6] + pose[6:8]


def on_face(pose, places):
    """Return which points of the plane of a virtual face are at places (N, 2) of the film."""
    return np.array(
        [drawing.face_point(*(place - pose[6:8]).astype(np.float32), pose) for place in places], dtype=float
    )


def test_lips_of_a_virtual_face_stay_in_place_while_it_turns_and_speaks(talk):
    frames, poses, middle = talk
    found = mouth.find(frames[0][0], "film")
    assert np.hypot(found.mouth_x - middle[0], found.mouth_y - middle[1]) < 0.06 * found.width
    reference, last, errors = alignment.reference(frames[0][0], found), alignment.STILL, []
    lips = features.region_grid(found)[::8, ::8].reshape(-1, 2)
    points = on_face(poses[0], lips)
    for planes, pose in zip(frames[1:], poses[1:], strict=True):
        last = alignment.align(reference, planes[0], last)
        away = alignment.moved(reference, last, lips) - in_film(pose, points)
        errors.append(np.sqrt((away**2).sum(axis=1).mean()))
    assert np.mean(errors) < 0.15
    assert np.max(errors) < 0.4


class Silent:
    """Articulation of somebody who keeps the mouth half open."""

    heard = phones.Spoken([phones.SILENCE], np.array([0.0, 1.0]))

    def lips(self, times_s):
        return np.tile([0.5, 0.2, 0.0, 0.3], (len(times_s), 1))


def test_features_of_a_still_mouth_do_not_follow_the_head(speaker):
    own, one, _ = speaker
    luminance = [planes[0].copy() for planes in film.frames(own, one, Silent(), 15.0, SEED)]
    found = mouth.find(luminance[0], "film")
    aligned, statuses = features.follow(iter(luminance), found, "film")
    assert set(statuses) == {"aligned"}
    place = features.region_grid(found)
    rows, columns = features.cosines(features.N_COSINES, 80), features.cosines(features.N_COSINES, 128)
    fixed = np.array([features.zigzagged(rows @ features.lip_region(one, place) @ columns.T) for one in luminance])
    assert (aligned.std(axis=0) / fixed.std(axis=0)).mean() < 0.35


def test_a_film_gives_a_table_and_a_stated_centre_is_used(talk, tmp_path):
    frames, _, middle = talk
    camera.encode(tmp_path / "talk.mkv", frames, 15.0)
    found = features.measure("talk", tmp_path / "talk.mkv", 15.0)
    tables.validate(found, "lips", "talk")
    assert len(found) == len(frames)
    stated = features.measure("talk", tmp_path / "talk.mkv", 15.0, centre=(middle[0], middle[1]))
    region = features.region_grid(mouth.find(frames[0][0], "film", middle))
    np.testing.assert_allclose(region.reshape(-1, 2).mean(axis=0), middle)
    mean = frames[0][0][np.round(region[..., 1]).astype(int), np.round(region[..., 0]).astype(int)].mean()
    assert stated["d1"].iloc[0] / np.sqrt(80 * 128) == pytest.approx(mean, abs=1.0)


def write_film(path, frames, starts_ms, sound_starts_ms=None):
    """Write grey frames that start at these times, and sound that starts at another one."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=1000)
        stream.height, stream.width, stream.pix_fmt = *frames[0].shape, "yuvj420p"
        track = None if sound_starts_ms is None else container.add_stream("pcm_s16le", rate=16000, layout="mono")
        for picture, start_ms in zip(frames, starts_ms, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, "gray").reformat(format="yuvj420p")
            frame.pts, frame.time_base = start_ms, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        if track is not None:
            piece = av.AudioFrame.from_ndarray(np.zeros((1, 1600), dtype=np.int16), "s16", "mono")
            piece.sample_rate, piece.pts, piece.time_base = 16000, 16 * sound_starts_ms, Fraction(1, 16000)
            container.mux(track.encode(piece))
            container.mux(track.encode())


def test_times_are_those_of_the_frames_from_the_start_of_the_sound(tmp_path):
    frames = [np.full((48, 64), 60 * number, dtype=np.uint8) for number in range(4)]
    write_film(tmp_path / "phone.mkv", frames, [20, 87, 180, 220], sound_starts_ms=20)
    shots = list(features.shots(tmp_path / "phone.mkv", 15.0))
    times_s = np.array([shot.time_s for shot in shots])
    np.testing.assert_allclose(times_s, np.array([0.0, 0.067, 0.16, 0.2]) + 0.5 / 15, atol=1e-3)
    np.testing.assert_allclose([shot.picture.mean() for shot in shots], [0, 60, 120, 180], atol=3)
    np.testing.assert_array_equal(features.evened(times_s, 15.0), times_s)


def test_evenly_spaced_frames_lose_the_rounding_of_the_container():
    rounded = np.round(np.arange(30) / 15, 3) + 0.5 / 15
    np.testing.assert_allclose(features.evened(rounded, 15.0), (np.arange(30) + 0.5) / 15, atol=1e-12)


@pytest.mark.parametrize(("down", "right"), [(16.0, 16.0), (3.0, 32.0), (20.25, 9.5)])
def test_coefficients_are_the_first_of_the_cosine_transform_in_zigzag_order(down, right):
    wide = np.random.default_rng(0).uniform(0.0, 255.0, (112, 160))
    region = ndimage.map_coordinates(wide, np.mgrid[0:80, 0:128] + np.array([down, right])[:, None, None], order=1)
    whole = dctn(region, norm="ortho")
    places = features.zigzag(50)
    assert places[:6].tolist() == [[0, 0], [0, 1], [1, 0], [2, 0], [1, 1], [0, 2]]
    assert len({tuple(place) for place in places.tolist()}) == 50
    found = features.shifted_cosines(80, down) @ wide @ features.shifted_cosines(128, right).T
    np.testing.assert_allclose(features.zigzagged(found), whole[places[:, 0], places[:, 1]], atol=1e-9)


def test_the_middle_of_a_mouth_is_found_by_its_motion(talk):
    frames, _, middle = talk
    luminance = [planes[0] for planes in frames]
    found = mouth.find(luminance[0], "film")
    step = found.width / features.FACE_PX
    places = []
    for off in (-4.0, 0.0, 4.0):
        guessed = Face(found.x, found.y, found.width, middle[0] + off, middle[1] + off / 2)
        regions = np.array([seen.region for seen in features.aligned_regions(iter(luminance), guessed)])
        right, down = mouth.moving(regions, features.MARGIN)
        places.append((guessed.mouth_x + step * right, guessed.mouth_y + step * down))
    assert np.ptp(places, axis=0).max() < 0.5
    np.testing.assert_allclose(np.mean(places, axis=0), middle, atol=1.5)
    still = np.repeat(regions[:1], 9, axis=0) + np.random.default_rng(0).normal(0, 2, (9, *regions.shape[1:]))
    assert mouth.moving(still.astype(np.float32), features.MARGIN) == (0.0, 0.0)


def test_a_mouth_that_leans_to_the_left_is_the_mirror_image_of_one_that_leans_to_the_right(speaker):
    own, *_ = speaker
    columns, rows = np.arange(-32, 33, dtype=np.float32), np.arange(-12, 30, dtype=np.float32)

    def redness(lean):
        shape = film.shape(replace(own.mouth, lean=lean), np.array([0.8, 0.0, 0.0, 0.2]))
        return np.array([[drawing.mouth(u, v, np.float32(140.0), shape, 2) for u in columns] for v in rows])

    left, right = redness(-0.4), redness(0.4)
    np.testing.assert_allclose(left[:, ::-1], right, atol=1e-3)
    assert np.abs(left - right).max() > 10.0


def test_a_film_without_a_face_is_refused(tmp_path):
    camera.encode(tmp_path / "wall.mkv", [np.full((3, 120, 160), 90, dtype=np.uint8)] * 3, 15.0)
    with pytest.raises(UserError, match=r"wall\.mkv: no face, and so no mouth, in the first frame; cut the film"):
        features.measure("wall", tmp_path / "wall.mkv", 15.0)


def test_a_mouth_partly_outside_is_refused_with_its_frame(talk):
    frames, _, _ = talk
    luminance = frames[0][0]
    found = mouth.find(luminance, "film")
    cut = int(found.mouth_y) + 15
    with pytest.raises(
        UserError, match=r"^film: the mouth is partly outside the picture in frame 0; cut the film to"
    ):
        features.follow(iter([luminance[:cut]]), found, "film")


def test_a_face_that_disappears_is_held_and_then_refused(talk):
    frames, _, _ = talk
    luminance = [planes[0] for planes in frames[:4]]
    rng = np.random.default_rng(0)
    gone = rng.integers(0, 255, luminance[0].shape).astype(np.uint8)
    found = mouth.find(luminance[0], "film")
    _, statuses = features.follow(iter([*luminance, gone]), found, "film")
    assert statuses == ["aligned"] * 4 + ["held"]
    with pytest.raises(UserError, match=r"^film: the face is lost in 3 of 5 frames, first in frame 2; cut the film"):
        features.follow(iter([*luminance[:2], gone, gone, gone]), found, "film")
