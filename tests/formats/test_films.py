"""Frames of a video as RGB, one after another or selected by number."""

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.formats import films
from cospeech.studio import film, stage

COLOURS = [(200, 30, 40), (40, 175, 70), (60, 60, 200), (235, 235, 230)]


@pytest.fixture
def path(tmp_path):
    """Four frames of 64 x 48 pixels, each of one colour."""
    planes = [np.broadcast_to(np.rint(stage.ycbcr(c))[:, None, None], (3, 48, 64)).astype(np.uint8) for c in COLOURS]
    film.encode(tmp_path / "c1.mkv", planes, 20.0)
    return tmp_path / "c1.mkv"


def test_frames_have_the_colours_that_were_written(path):
    shown = list(films.pictures(path))
    assert [picture.shape for picture in shown] == [(48, 64, 3)] * 4
    for picture, colour in zip(shown, COLOURS, strict=True):
        assert np.abs(picture.reshape(-1, 3).astype(int) - colour).max() <= 4
    assert [picture.shape for picture in films.pictures(path, 24)] == [(24, 32, 3)] * 4


def test_stills_are_the_frames_with_their_numbers(path):
    found = films.stills(path, {3, 1})
    every = list(films.pictures(path))
    assert sorted(found) == [1, 3]
    for number, picture in found.items():
        np.testing.assert_array_equal(picture, every[number])


def test_missing_frames_and_files_are_reported(path, tmp_path):
    with pytest.raises(UserError, match=r"c1\.mkv: ends before frame 4"):
        films.stills(path, {2, 4})
    (tmp_path / "no.mkv").write_bytes(b"no film")
    for ask in (lambda: films.stills(tmp_path / "no.mkv", {0}), lambda: list(films.pictures(tmp_path / "no.mkv"))):
        with pytest.raises(UserError, match=r"no\.mkv: cannot be read as a video"):
            ask()
