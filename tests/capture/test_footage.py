"""Films read in step, plane by plane, and what is said of films that do not fit."""

import numpy as np
import pytest
from pictures import draw, write

from cospeech.capture import footage
from cospeech.capture.camera import Camera
from cospeech.errors import UserError

CAMERAS = [Camera("c1", (72, 48), (80, 80), (36, 24)), Camera("c2", (72, 48), (80, 80), (36, 24))]


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """Folder of two views of 6 frames each, in which a red disc goes to the right."""
    folder = tmp_path_factory.mktemp("films")
    for camera in ("c1", "c2"):
        write(folder / f"{camera}.mkv", [draw((72, 48), [(10 + 8 * t, 24, 6, "red")], seed=t) for t in range(6)])
    return folder


def test_planes_are_the_pictures_that_were_written(films):
    both = [footage.examine(films / "c1.mkv"), footage.examine(films / "c2.mkv")]
    assert footage.check(both, CAMERAS, 0) == 6
    sets = list(footage.read(both, 6))
    assert len(sets) == 6
    for t, pictures in enumerate(sets):
        drawn = draw((72, 48), [(10 + 8 * t, 24, 6, "red")], seed=t)
        for planes in pictures:
            read = np.stack([plane[:, :72] for plane in planes]).astype(int)
            assert np.abs(read - drawn).mean() < 1.5


def test_brightness_is_read_of_any_film(films):
    film = footage.examine(films / "c1.mkv", colour=False)
    grey = list(footage.brightness(film))
    assert [picture.shape for picture in grey] == [(48, 72)] * 6
    (first,) = next(footage.read([film], 1))
    assert np.abs(grey[0].astype(int) - first[0][:, :72]).max() <= 1


def test_cameras_go_to_the_films_of_their_names(films):
    both = [footage.examine(films / "c2.mkv"), footage.examine(films / "c1.mkv")]
    assert [camera.name for camera in footage.in_order(both, CAMERAS)] == ["c2", "c1"]
    with pytest.raises(UserError, match="films of c2 for a rig of c1, c2; give one film"):
        footage.in_order(both[:1], CAMERAS)
    with pytest.raises(UserError, match="films of c2, c1 for a rig of c1, left"):
        footage.in_order(both, [CAMERAS[0], Camera("left", (72, 48), (80, 80), (36, 24))])


def test_missing_damaged_and_truncated_films_are_named(films, tmp_path):
    with pytest.raises(UserError, match=r"c9\.mkv: no such film"):
        footage.examine(tmp_path / "c9.mkv")
    whole = (films / "c1.mkv").read_bytes()
    (tmp_path / "noise.mkv").write_bytes(b"no film" * 100)
    with pytest.raises(UserError, match=r"noise\.mkv: no film"):
        footage.examine(tmp_path / "noise.mkv")
    (tmp_path / "short.mkv").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match=r"short\.mkv: cut short: \d of 6 frames"):
        footage.examine(tmp_path / "short.mkv")


def test_films_that_do_not_fit_the_rig_or_each_other(films, tmp_path):
    film = footage.examine(films / "c1.mkv")
    with pytest.raises(UserError, match="1 films for 2 cameras"):
        footage.check([film], CAMERAS, 0)
    turned = [CAMERAS[0], Camera("c2", (48, 72), (80, 80), (24, 36))]
    with pytest.raises(UserError, match="72x48, camera c2 was calibrated at 48x72, it seems turned"):
        footage.check([film, film], turned, 0)
    write(tmp_path / "fast.mkv", [draw((72, 48), [])] * 6, fps=25)
    with pytest.raises(UserError, match=r"fast\.mkv: 25 frames/s, but c1\.mkv has 20"):
        footage.check([film, footage.examine(tmp_path / "fast.mkv")], CAMERAS, 0)
    write(tmp_path / "long.mkv", [draw((72, 48), [])] * 9)
    longer = footage.examine(tmp_path / "long.mkv")
    with pytest.raises(UserError, match=r"long\.mkv: 9 frames, the shortest view has 6: more than 2 apart"):
        footage.check([film, longer], CAMERAS, 2)
    assert footage.check([film, longer], CAMERAS, 3) == 6


def test_a_film_that_ends_early_says_where(films):
    film = footage.examine(films / "c1.mkv")
    with pytest.raises(UserError, match=r"c1\.mkv: ends at frame 6 of 8"):
        list(footage.read([film], 8))
