"""Marker files of other systems are imported with our names and axes."""

from pathlib import Path

import numpy as np
import pytest
import subject

from cospeech.capture.fitting import marker_file
from cospeech.data import tables, trajectories
from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import c3d, trc
from cospeech.motion import markers

ARM = Path(__file__).parents[4] / "shared" / "data" / "pyomeca_arm" / "markers_analogs.c3d"


OTHERS = {name: name.upper() for name in markers.NAMES if not name.endswith(("leg", "foot"))}
"""The marker map of a laboratory that does not put markers on the legs."""


def recording(n_frames=60):
    """Return the markers of ``OTHERS`` under the names of the laboratory, on a swaying body and without gaps."""
    time_s = np.arange(n_frames)[:, None] / 50
    sway = np.concatenate([0.1 * np.sin(3 * time_s), -0.05 * np.cos(2 * time_s), 0.0 * time_s], axis=1)
    standing = subject.marked(subject.range_of_motion(), 0.0)[0]
    places = standing[None, [markers.NAMES.index(name) for name in OTHERS]] + sway[:, None]
    return Trajectories(("SPARE", *OTHERS.values()), np.insert(places, 0, 9.0, axis=1), 50.0)


@pytest.mark.parametrize(("suffix", "write"), [(".c3d", c3d.write), (".trc", trc.write)])
def test_mapped_markers_are_imported_with_z_up_or_y_up(tmp_path, suffix, write):
    given = recording()
    x, y, z = np.moveaxis(given.places_m, -1, 0)
    write(given._replace(places_m=np.stack([x, -z, y], axis=-1)), tmp_path / f"a{suffix}")
    table = marker_file.read(tmp_path / f"a{suffix}", OTHERS, "z", "-y", 0.5)
    tables.validate(table, "markers_3d", "x")
    assert trajectories.frame_rate(table) == 50.0
    found = trajectories.to_array(table, tuple(OTHERS))
    np.testing.assert_allclose(found, given.places_m[:, 1:], atol=2e-4)  # the smoother assumes 0.4 mm of noise
    assert (table.loc[table["marker"].isin(list(OTHERS)), "status"] == "seen").all()
    assert (table.loc[table["marker"].str.endswith(("leg", "foot")), "status"] == "lost").all()


def test_short_gaps_are_filled_and_long_ones_stay(tmp_path):
    given = recording(120)
    gaps = given.places_m.copy()
    hand, elbow, front = (1 + list(OTHERS).index(name) for name in ("left_hand", "right_elbow", "chest"))
    gaps[10:20, hand] = gaps[40:70, elbow] = gaps[30:90, front] = np.nan
    trc.write(given._replace(places_m=gaps), tmp_path / "a.trc")
    table = marker_file.read(tmp_path / "a.trc", OTHERS, "y", "z", longest_hidden_s=0.4)
    status = table.pivot(index="frame", columns="marker", values="status")
    found = trajectories.to_array(table, tuple(OTHERS))
    away = np.linalg.norm(found - given.places_m[:, 1:], axis=2)
    assert set(status.loc[10:19, "left_hand"]) == {"predicted"}
    assert away[10:20, hand - 1].max() < 0.004
    assert set(status.loc[40:69, "right_elbow"]) == {"lost"}  # 0.6 s
    assert np.isnan(found[40:70, elbow - 1]).all()
    assert set(status.loc[30:89, "chest"]) == {"predicted"}  # from the three other markers on the trunk
    assert away[30:90, front - 1].max() < 0.001
    assert (status.drop(columns=[n for n in markers.NAMES if n not in OTHERS]).loc[90:] == "seen").all(axis=None)


def test_files_that_cannot_be_imported_are_reported(tmp_path):
    given = recording(5)
    given.places_m[:, 2] = np.nan
    trc.write(given, tmp_path / "a.trc")
    with pytest.raises(UserError, match=r"no marker 'CHESTS' \(mapped to chest\); did you mean 'CHEST'"):
        marker_file.read(tmp_path / "a.trc", {"chest": "CHESTS"}, "y", "z", 0.5)
    with pytest.raises(UserError, match=r"a\.trc: marker 'HEAD_RIGHT' \(mapped to head_right\) is never visible"):
        marker_file.read(tmp_path / "a.trc", OTHERS, "y", "z", 0.5)
    with pytest.raises(UserError, match="'w' is not an axis"):
        marker_file.read(tmp_path / "a.trc", {"chest": "CHEST"}, "w", "z", 0.5)
    with pytest.raises(UserError, match=r"unknown marker file format; convert it to one of \.c3d, \.trc"):
        marker_file.read(tmp_path / "a.bvh", {}, "y", "z", 0.5)


@pytest.mark.recorded
@pytest.mark.skipif(not ARM.is_file(), reason="needs the real recordings in ../shared/data/pyomeca_arm")
def test_a_real_recording_of_an_arm_is_imported_with_its_gaps():
    names = {"chest": "Daphnee:STER", "left_leg": "Daphnee:ASISl", "left_elbow": "Daphnee:EPICm"}
    table = marker_file.read(ARM, names, up="z", facing="x", longest_hidden_s=0.5)
    tables.validate(table, "markers_3d", "x")
    assert len(table) == len(markers.NAMES) * 580
    places = trajectories.to_array(table, ("chest", "left_leg"))
    assert 0.2 < np.nanmedian(places[:, 0, 1] - places[:, 1, 1]) < 0.7  # the breastbone is above the hip bone
    gaps = {"left_hand": "Daphnee:LASTC", "right_hand": "Daphnee:SCAP_CP"}
    status = marker_file.read(ARM, gaps, "z", "x", 0.5).groupby("marker")["status"].value_counts()
    assert status["left_hand"].to_dict() == {"seen": 557, "predicted": 23}  # eight gaps of at most 4 frames
    assert status["right_hand"].to_dict() == {"seen": 488, "lost": 71, "predicted": 21}  # 71 frames in one gap
