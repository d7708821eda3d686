"""Names and units of marker files as other systems write them."""

import numpy as np
import pytest

from cospeech.capture.fitting import marker_file
from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import trc


def written(tmp_path, names):
    places = np.random.default_rng(0).normal(0, 0.3, (60, len(names), 3))
    trc.write(Trajectories(names, places, 50.0), tmp_path / "a.trc")
    return tmp_path / "a.trc"


def test_a_mapped_name_must_be_that_of_one_marker(tmp_path):
    path = written(tmp_path, ("C7", "C7", "STRN"))
    with pytest.raises(UserError, match=r"a\.trc: 2 markers are called 'C7' .mapped to back.;"):
        marker_file.read(path, {"back": "C7"}, "y", "z", 0.5)
    with pytest.raises(UserError, match=r"no marker 'NONE'"):  # but not if nobody maps it
        marker_file.read(path, {"chest": "NONE"}, "y", "z", 0.5)


def test_a_marker_is_mapped_once(tmp_path):
    path = written(tmp_path, ("C7", "STRN"))
    with pytest.raises(UserError, match="'C7' is mapped to both back and chest"):
        marker_file.read(path, {"back": "C7", "chest": "C7"}, "y", "z", 0.5)


def test_names_match_in_either_unicode_composition(tmp_path):
    path = written(tmp_path, ("e\u0301paule", "e\u0301paule"))
    with pytest.raises(UserError, match="2 markers are called '\u00e9paule'"):
        marker_file.read(path, {"chest": "e\u0301paule"}, "y", "z", 0.5)


def test_a_declared_unit_is_used_and_what_was_adjusted_is_reported(tmp_path):
    said = []
    with pytest.raises(UserError, match="no marker 'NONE'"):
        marker_file.read(written(tmp_path, ("C7",)), {"chest": "NONE"}, "y", "z", 0.5, unit="mm", report=said.append)
    assert len(said) == 1
    assert said[0].endswith("a.trc: unit 'm' of the file replaced by the declared mm")
