"""Synchronous reading of films, and the errors for films that are damaged or do not match."""

import struct
from itertools import pairwise

import av
import numpy as np
import pytest
from pictures import draw, ordinary, write

from cospeech.capture.tracking import footage
from cospeech.capture.tracking.interlacing import combed
from cospeech.errors import UserError
from cospeech.formats.films import pictures as all_pictures_of
from cospeech.formats.films import stills as pictures_of
from cospeech.geometry.camera import Camera

CAMERAS = [Camera("c1", (72, 48), (80, 80), (36, 24)), Camera("c2", (72, 48), (80, 80), (36, 24))]


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """Folder with two views of 6 frames each, in which a red disc moves to the right."""
    folder = tmp_path_factory.mktemp("films")
    for camera in ("c1", "c2"):
        write(folder / f"{camera}.mkv", [draw((72, 48), [(10 + 8 * t, 24, 6, "red")], seed=t) for t in range(6)])
    return folder


def test_planes_are_those_that_were_written(films):
    both = [footage.probe(films / "c1.mkv"), footage.probe(films / "c2.mkv")]
    assert footage.check(both, CAMERAS, 0) == 6
    sets = list(footage.read(both, 6))
    assert len(sets) == 6
    for t, pictures in enumerate(sets):
        drawn = draw((72, 48), [(10 + 8 * t, 24, 6, "red")], seed=t)
        for planes in pictures:
            read = np.stack([plane[:, :72] for plane in planes]).astype(int)
            assert np.abs(read - drawn).mean() < 1.5


def test_luma_is_read_from_any_film(films):
    film = footage.probe(films / "c1.mkv", colour=False)
    grey = list(footage.brightness(film))
    assert [picture.shape for picture in grey] == [(48, 72)] * 6
    (first,) = next(footage.read([film], 1))
    assert np.abs(grey[0].astype(int) - first[0][:, :72]).max() <= 1


def test_cameras_are_matched_to_films_by_name(films):
    both = [footage.probe(films / "c2.mkv"), footage.probe(films / "c1.mkv")]
    assert [camera.name for camera in footage.match_cameras(both, CAMERAS)] == ["c2", "c1"]
    with pytest.raises(UserError, match="films of c2 for a rig of c1, c2; provide one film"):
        footage.match_cameras(both[:1], CAMERAS)
    with pytest.raises(UserError, match="films of c2, c1 for a rig of c1, left"):
        footage.match_cameras(both, [CAMERAS[0], Camera("left", (72, 48), (80, 80), (36, 24))])


def write_420(path, pictures, fps=20, options=None):
    """Write an H.264 film in the format of most cameras."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=fps, options={"crf": "8"} | (options or {}))
        stream.height, stream.width = pictures[0].shape[1:]
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(ordinary(picture)))
        container.mux(stream.encode())


def centre(plane):
    """Return the centroid of the coloured region in a chroma plane."""
    weight = np.clip(np.abs(plane.astype(float) - 128) - 15, 0, None)
    y, x = np.indices(plane.shape)
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


def test_a_film_with_subsampled_chroma_gives_the_same_planes(tmp_path):
    drawn = [draw((144, 96), [(30.3 + 6 * t, 40.4, 7, "red")], seed=t) for t in range(5)]
    write_420(tmp_path / "c1.mp4", drawn)
    film = footage.probe(tmp_path / "c1.mp4")
    assert (film.size_px, film.fps, film.n_frames) == ((144, 96), 20.0, 5)
    for picture, (planes,) in zip(drawn, footage.read([film], 5), strict=True):
        read = np.stack([plane[:, :144] for plane in planes]).astype(int)
        assert np.abs(read - picture).mean() < 1.5
        assert np.abs(centre(read[2]) - centre(picture[2])).max() < 0.1


@pytest.mark.parametrize(("matrix", "quarter_turns"), [((0, 1, -1, 0), 3), ((-1, 0, 0, -1), 2), ((0, -1, 1, 0), 1)])
def test_a_film_of_a_turned_phone_is_read_upright(tmp_path, matrix, quarter_turns):
    path = tmp_path / "c1.mp4"
    write_420(path, [draw((72, 48), [(20, 10, 6, "red")])] * 3)
    (straight,) = next(footage.read([footage.probe(path)], 3))
    content = bytearray(path.read_bytes())
    a, b, c, d = (number << 16 for number in matrix)
    upright, turned = (
        struct.pack(">9i", *m, 0, 0, 1 << 30) for m in ((1 << 16, 0, 0, 0, 1 << 16, 0), (a, b, 0, c, d, 0))
    )
    place = content.index(upright, content.index(b"tkhd"))  # the display matrix of the track
    content[place : place + len(turned)] = turned
    path.write_bytes(content)
    film = footage.probe(path)
    assert film.size_px == ((48, 72) if quarter_turns % 2 else (72, 48))
    (read,) = next(footage.read([film], 3))
    for plane, whole in zip(read, straight, strict=True):
        np.testing.assert_array_equal(plane[:, : film.size_px[0]], np.rot90(whole[:, :72], quarter_turns))
    luma = next(footage.brightness(film))
    assert luma.shape == film.size_px[::-1]
    shown = pictures_of(path, {1})[1]
    assert shown.shape == (*film.size_px[::-1], 3)
    red = np.argwhere((shown[..., 0] > 100) & (shown[..., 1] < 80)).mean(axis=0)[::-1]
    x, y = 20 - 35.5, 10 - 23.5
    for _ in range(quarter_turns):  # counterclockwise, with y down
        x, y = y, -x
    np.testing.assert_allclose(red, np.array(film.size_px) / 2 - 0.5 + (x, y), atol=1.0)
    assert next(iter(all_pictures_of(path, 24))).shape == (24, 16 if quarter_turns % 2 else 36, 3)


def test_frames_hidden_by_an_edit_list_are_not_read(tmp_path):
    """A cut without re-encoding keeps the frames from the last key frame on and hides those before the cut."""
    path = tmp_path / "c1.mp4"
    drawn = [draw((72, 48), [(10 + 8 * t, 24, 6, "red")], seed=t) for t in range(8)]
    write_420(path, drawn)
    content = bytearray(path.read_bytes())
    place = content.index(b"elst") + 12  # after version and flags, and the number of edits: duration, start
    duration, start = struct.unpack_from(">ii", content, place)
    ticks = round(float(1 / (av.open(str(path)).streams.video[0].time_base * 20)))
    struct.pack_into(">ii", content, place, duration - 2 * duration // 8, start + 2 * ticks)
    path.write_bytes(content)
    film = footage.probe(path)
    assert (film.n_frames, film.fps) == (6, 20.0)
    for picture, (planes,) in zip(drawn[2:], footage.read([film], 6), strict=True):
        assert np.abs(centre(planes[2][:, :72]) - centre(picture[2])).max() < 0.3


@pytest.mark.parametrize("lost", [1, 300, 649, 650, 1000, 1297])
def test_one_lost_frame_is_found_wherever_it_is(lost):
    starts_s = np.delete(np.arange(1300), lost) / 30.0
    with pytest.raises(UserError, match=rf"c1\.mp4: 1 frame before frame {lost} \(at .* s\) is missing"):
        footage._check_times(starts_s, 30.0 * 1299 / 1300, "c1.mp4")


@pytest.mark.parametrize("extra", [0.5, 649.5, 1298.5])
def test_one_frame_too_many_is_found_wherever_it_is(extra):
    starts_s = np.sort([*range(1300), extra]) / 30.0
    with pytest.raises(UserError, match=rf"c1\.mp4: frame {int(extra) + 1} \(at .* s\) is one too many"):
        footage._check_times(starts_s, 30.0 * 1301 / 1300, "c1.mp4")


@pytest.mark.parametrize("fps", [24.0, 29.97, 59.94, 120.0])
def test_times_in_milliseconds_are_a_constant_rate(fps):
    footage._check_times(np.round(np.arange(5000) / fps, 3), fps, "c1.mkv")
    with pytest.raises(UserError, match=r"c1\.mkv: 2 frames before frame 700 \(at .* s\) are missing"):
        footage._check_times(np.round(np.delete(np.arange(5000), [700, 701]) / fps, 3), fps, "c1.mkv")


def test_a_drifting_frame_rate_is_reported():
    with pytest.raises(UserError, match=r"deviates by 14\.9 frames from a constant 30 frames/s"):
        footage._check_times(np.cumsum(np.linspace(0.9, 1.1, 600)) / 30.0, 30.0, "c1.mp4")


def woven(pictures):
    """Return images whose odd lines show the next moment."""
    weaved = []
    for now, then in pairwise(pictures):
        weaved.append(now.copy())
        weaved[-1][:, 1::2] = then[:, 1::2]
    return weaved


def test_an_interlaced_film_is_refused_whether_it_says_so_or_not(tmp_path):
    moving = [draw((144, 96), [(20 + 4 * t % 80, 40, 12, "white")], seed=t) for t in range(23)]
    write_420(tmp_path / "flagged.mp4", moving, options={"x264-params": "interlaced=1"})
    with pytest.raises(UserError, match=r"flagged\.mp4: the film is interlaced, as it says itself; .* bwdif"):
        footage.probe(tmp_path / "flagged.mp4")
    write_420(tmp_path / "silent.mp4", woven(moving))
    film = footage.probe(tmp_path / "silent.mp4")
    for read in (lambda: list(footage.read([film], 22)), lambda: list(footage.brightness(film))):
        with pytest.raises(UserError, match=r"silent\.mp4: the film is interlaced: the edges .* frame 10 are combed"):
            read()
    write_420(tmp_path / "progressive.mp4", moving)
    assert len(list(footage.read([footage.probe(tmp_path / "progressive.mp4")], 23))) == 23


def test_noise_and_textures_are_not_combs():
    rng = np.random.default_rng(0)
    noise = np.clip(rng.normal(128, 25, (96, 144)), 0, 255).astype(np.uint8)
    assert not combed(noise)
    assert not combed(np.full((96, 144), 40, np.uint8))
    checks = (60 + 100 * (np.add.outer(np.arange(96), np.arange(144)) % 2)).astype(np.uint8)
    assert not combed(checks)
    comb = np.full((96, 144), 40, np.uint8)
    comb[20:60:2, 30:36] = 200
    assert combed(comb)
    assert not combed(np.ascontiguousarray(comb.T))


def test_the_first_frames_of_a_film_can_be_skipped(films):
    film = footage.probe(films / "c1.mkv")
    late = film.after(2)
    assert (late.n_frames, late.after(1).first) == (4, 3)
    for (whole,), (part,) in zip(list(footage.read([film], 6))[2:], footage.read([late], 4), strict=True):
        np.testing.assert_array_equal(part[0], whole[0])


def test_variable_frame_rate_and_missing_colour_are_reported(films, tmp_path):
    with av.open(str(tmp_path / "uneven.mkv"), "w") as out, av.open(str(films / "c1.mkv")) as container:
        stream = out.add_stream_from_template(container.streams.video[0])
        for number, packet in enumerate(container.demux(video=0)):
            if packet.size:
                packet.pts = packet.dts = (packet.pts or 0) + (100 if number > 2 else 0)  # milliseconds: two dropped
                packet.stream = stream
                out.mux(packet)
    with pytest.raises(UserError, match=r"uneven\.mkv: 2 frames before frame 3 \(at 0\.250 s\) are missing"):
        footage.probe(tmp_path / "uneven.mkv")
    with av.open(str(tmp_path / "grey.mkv"), "w") as out:
        stream = out.add_stream("ffv1", rate=20)
        stream.width, stream.height, stream.pix_fmt = 72, 48, "gray"
        out.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((48, 72), np.uint8), format="gray")))
        out.mux(stream.encode())
    with pytest.raises(UserError, match=r"grey\.mkv: the film has no colour"):
        footage.probe(tmp_path / "grey.mkv")
    assert footage.probe(tmp_path / "grey.mkv", colour=False).n_frames == 1


def test_missing_damaged_and_truncated_films_are_reported(films, tmp_path):
    with pytest.raises(UserError, match=r"c9\.mkv: no such file"):
        footage.probe(tmp_path / "c9.mkv")
    whole = (films / "c1.mkv").read_bytes()
    (tmp_path / "noise.mkv").write_bytes(b"no film" * 100)
    with pytest.raises(UserError, match=r"noise\.mkv: not a video"):
        footage.probe(tmp_path / "noise.mkv")
    (tmp_path / "short.mkv").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match=r"short\.mkv: truncated: it has \d of 6 frames"):
        footage.probe(tmp_path / "short.mkv")


def test_films_that_do_not_match_the_rig_or_each_other_are_rejected(films, tmp_path):
    film = footage.probe(films / "c1.mkv")
    with pytest.raises(UserError, match="1 films for 2 cameras"):
        footage.check([film], CAMERAS, 0)
    turned = [CAMERAS[0], Camera("c2", (48, 72), (80, 80), (24, 36))]
    with pytest.raises(UserError, match=r"72x48, but camera c2 was calibrated at 48x72 \(rotated by 90 degrees\?\)"):
        footage.check([film, film], turned, 0)
    write(tmp_path / "fast.mkv", [draw((72, 48), [])] * 6, fps=25)
    with pytest.raises(UserError, match=r"fast\.mkv: 25 frames/s, but c1\.mkv has 20"):
        footage.check([film, footage.probe(tmp_path / "fast.mkv")], CAMERAS, 0)
    write(tmp_path / "long.mkv", [draw((72, 48), [])] * 9)
    longer = footage.probe(tmp_path / "long.mkv")
    with pytest.raises(
        UserError, match=r"long\.mkv: 9 frames, but the shortest view has 6, a difference of more than 2"
    ):
        footage.check([film, longer], CAMERAS, 2)
    assert footage.check([film, longer], CAMERAS, 3) == 6


def test_every_camera_has_its_film_and_every_film_its_camera(films):
    both = [footage.probe(films / "c1.mkv"), footage.probe(films / "c2.mkv")]
    assert footage.match_cameras(both, CAMERAS[::-1]) == CAMERAS
    with pytest.raises(
        UserError, match=r"films of c1 for a rig of c1, c2; provide one film for each camera of the rig"
    ):
        footage.match_cameras(both[:1], CAMERAS)
    with pytest.raises(UserError, match=r"films of c1, c2 for a rig of c1;"):
        footage.match_cameras(both, CAMERAS[:1])


def test_a_film_that_ends_early_is_reported(films):
    film = footage.probe(films / "c1.mkv")
    with pytest.raises(UserError, match=r"c1\.mkv: ends after 6 of 8 frames"):
        list(footage.read([film], 8))
