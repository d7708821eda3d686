"""Marker files of other laboratories come in under our names and axes."""

from pathlib import Path

import numpy as np
import pytest

from cospeech import c3d, tables, trajectories, trc
from cospeech.corpus import marker_file
from cospeech.errors import UserError
from cospeech.trajectories import Trajectories

ARM = Path(__file__).parents[3] / "shared" / "data" / "pyomeca_arm" / "markers_analogs.c3d"


def recording():
    places = np.random.default_rng(0).normal(0, 1, (5, 3, 3))
    places[2, 1] = np.nan
    return Trajectories(("HEAD", "LELB", "RELB"), places, 50.0)


@pytest.mark.parametrize(("suffix", "write"), [(".c3d", c3d.write), (".trc", trc.write)])
def test_mapped_markers_come_in_z_up_or_y_up(tmp_path, suffix, write):
    given = recording()
    write(given, tmp_path / f"a{suffix}")
    names = {"left_elbow": "LELB", "right_elbow": "RELB"}
    table = marker_file.read(tmp_path / f"a{suffix}", names, up="z", facing="-y")
    tables.validate(table, "markers_3d", "x")
    assert trajectories.frame_rate(table) == 50.0
    assert table["status"].value_counts().to_dict() == {"seen": 9, "lost": 1}
    found = trajectories.to_array(table, ("right_elbow", "left_elbow"))
    x, y, z = np.moveaxis(given.places_m[:, [2, 1]], -1, 0)
    np.testing.assert_allclose(found, np.stack([x, z, -y], axis=-1), atol=2e-6)
    np.testing.assert_array_equal(marker_file.axes("y", "z"), np.eye(3))


@pytest.mark.parametrize("up", marker_file.DIRECTIONS)
@pytest.mark.parametrize("facing", marker_file.DIRECTIONS)
def test_axes_are_a_right_handed_frame_or_refused(up, facing):
    if up[-1] == facing[-1]:
        with pytest.raises(UserError, match="must lie along different axes"):
            marker_file.axes(up, facing)
    else:
        turn = marker_file.axes(up, facing)
        np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
        assert np.linalg.det(turn) == pytest.approx(1)


def test_what_cannot_come_in_is_said(tmp_path):
    trc.write(recording(), tmp_path / "a.trc")
    with pytest.raises(UserError, match=r"no marker 'LELBW' \(mapped to left_elbow\); did you mean 'LELB'"):
        marker_file.read(tmp_path / "a.trc", {"left_elbow": "LELBW"}, "y", "z")
    with pytest.raises(UserError, match="'w' is no axis"):
        marker_file.read(tmp_path / "a.trc", {"left_elbow": "LELB"}, "w", "z")
    with pytest.raises(UserError, match=r"markers come as \.c3d, \.trc"):
        marker_file.read(tmp_path / "a.bvh", {}, "y", "z")


@pytest.mark.recorded
@pytest.mark.skipif(not ARM.is_file(), reason="needs the real recordings in ../shared/data/pyomeca_arm")
def test_a_real_arm_comes_in_as_a_table():
    table = marker_file.read(ARM, {"chest": "Daphnee:STER", "left_leg": "Daphnee:ASISl"}, up="z", facing="x")
    tables.validate(table, "markers_3d", "x")
    assert len(table) == 2 * 580
    places = trajectories.to_array(table, ("chest", "left_leg"))
    assert 0.2 < np.nanmedian(places[:, 0, 1] - places[:, 1, 1]) < 0.7  # the breastbone is above the hip bone
