"""Synchronous reading of films, and the errors for films that are damaged or do not match."""

import struct

import av
import numpy as np
import pytest
from pictures import draw, ordinary, write

from cospeech.capture.tracking import footage
from cospeech.errors import UserError
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


def write_420(path, pictures, fps=20):
    """Write an H.264 film in the format of most cameras."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=fps, options={"crf": "8"})
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


def test_a_film_flagged_as_rotated_is_rejected(tmp_path):
    write_420(tmp_path / "c1.mp4", [draw((72, 48), [])] * 3)
    content = bytearray((tmp_path / "c1.mp4").read_bytes())
    upright, turned = (struct.pack(">9i", s << 16, 0, 0, 0, s << 16, 0, 0, 0, 1 << 30) for s in (1, -1))
    place = content.index(upright, content.index(b"tkhd"))  # the display matrix of the track
    content[place : place + len(turned)] = turned
    (tmp_path / "c1.mp4").write_bytes(content)
    with pytest.raises(UserError, match=r"c1\.mp4: the film is flagged to be rotated by -?180 degrees"):
        next(footage.read([footage.probe(tmp_path / "c1.mp4")], 3))


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
    with pytest.raises(UserError, match=r"uneven\.mkv: frame \d deviates by \d\.\d frames from a constant"):
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
